"""The simulator over windows: predictions and their derivatives."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.fit_numerics import FOLLOWED_CHANGE, reference_numerics, run_in_numerics
from ddagr_gym.identification.motor_currents import CurrentModel
from ddagr_gym.identification.parameters import ModelParameter
from ddagr_gym.identification.side_by_side import side_by_side
from ddagr_gym.identification.spells import Spell
from ddagr_gym.identification.windows import CHANNELS, STATE, RunIn, WindowSet
from ddagr_gym.parameters import Drivetrain, Imu, Numerics, PoseReceiver, Robot, Sensors, Soil, WheelEncoder
from ddagr_gym.physics import layout
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.base import GROUPS
from ddagr_gym.physics.force_record import ForceRecord, new_record, to_follow
from ddagr_gym.physics.motor_torque import RECORDED, motor_torques
from ddagr_gym.simulator import Simulator, build_row

Array = NDArray[np.float64]

IMPOSED_RATE_PERIODS = 2.0
"""Motor rate times the sample period where wheel speeds are imposed: the motor is inverted exactly, and a wrong speed
decays by exp(-2) in a sample."""

STATE_STEPS = np.array([1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 2e-3, 2e-3])
"""Finite-difference steps of STATE [m, m, rad, m/s, m/s, rad/s, rad/s, rad/s]."""

STATE_ENTRIES = (
    layout.X, layout.Y, layout.YAW, layout.V_X, layout.V_Y, layout.YAW_RATE, layout.OMEGA, layout.OMEGA + 1,
)  # fmt: skip
"""Entries of the simulator's row that are STATE."""

RUN_IN = 4.0
"""What was driven right before a window, from which a simulation finds the integral parts at its start [s] (ours): on
one drive of a Warthog on asphalt median errors of the wheel speeds fall by 7 % with it, by 11 % with all of a step of
6 s, on most others by less (benchmarks/run_in.py)."""

_MOVING_STATE = range(3, len(STATE))
_OMEGA = slice(6, 8)
_INTEGRALS = (layout.INTEGRAL, layout.INTEGRAL + 1)
_INTEGRAL_RATE = layout.BASE_DRIVETRAIN + layout.INTEGRAL_RATE
_MOTORS = GROUPS[0]


def ideal_sensors(period: float) -> Sensors:
    """Sensors without noise or quantisation, and a pose at every sample."""
    imu = Imu(
        sample_rate=1.0 / period, accelerometer_noise=0.0, gyro_noise=0.0, accelerometer_resolution=0.0,
        gyro_resolution=0.0, accelerometer_range=1e4, gyro_range=1e3,
    )  # fmt: skip
    return Sensors(imu, WheelEncoder(counts_per_revolution=0.0), PoseReceiver(1.0 / period, 0.0, 0.0))


def pose_derivatives(states: Array, base: Array) -> Array:
    """d prediction / d x, y, yaw of the initial state, (W, T, 8, 3); exact where the ground is the same everywhere.

    A shifted or turned start moves all of the path after it.

    Args:
        states: (W, 8) initial STATE.
        base: (W, T, 8) prediction from there.
    """
    derivatives = np.zeros((*base.shape, 3))
    derivatives[..., 5, 0] = derivatives[..., 6, 1] = derivatives[..., 7, 2] = 1.0
    derivatives[..., 5, 2] = -(base[..., 6] - states[:, None, 1])
    derivatives[..., 6, 2] = base[..., 5] - states[:, None, 0]
    return derivatives


@dataclass(frozen=True, eq=False)
class Reference:
    """A prediction of windows, with what predictions near it need to be made fast.

    Attributes:
        prediction: (W, T, 8), or (W, T, 10) with the currents of the motors.
        forces: of the wheels in the windows.
        run_in: the same in what was driven right before them; None where that is not simulated.
        integrals: (W, 2) of :meth:`WindowModel.first_integrals`.
    """

    prediction: Array
    forces: ForceRecord
    run_in: ForceRecord | None
    integrals: Array


class WindowModel:
    """Predicts all windows of a set at once.

    Args:
        robot: nominal robot.
        soil: nominal soil.
        windows: what to predict.
        parameters: what may move.
        imposed: True where the windows' commands are recorded wheel speeds. The wheels then have these speeds at the
            samples, whatever the initial state says, and effects on commands and motors are left out.
        numerics: accuracy; ``Numerics.smooth()`` by default.
        threads: see :class:`Simulator`.
        delay: by which the commands act late, besides the shift parameters [s]; negative where their clock is late.
        currents: how motor currents follow, where the windows compare them; they are channels 8 and 9 then.
        known: missing physics that is taken as it is, beside the effects that a prediction is asked for with.
    """

    def __init__(
        self,
        robot: Robot,
        soil: Soil,
        windows: WindowSet,
        parameters: Sequence[ModelParameter] = (),
        *,
        imposed: bool = False,
        numerics: Numerics | None = None,
        threads: int = 1,
        delay: float = 0.0,
        currents: CurrentModel | None = None,
        known: Sequence[Effect] = (),
    ) -> None:
        self.windows = windows
        self._known = tuple(known)
        self.currents = currents
        self.parameters = tuple(parameters)
        self._numerics = Numerics.smooth() if numerics is None else numerics
        self.threads = threads
        self._delay = delay
        self._imposed = imposed
        if imposed:
            robot = replace(
                robot, motor_rate=IMPOSED_RATE_PERIODS / windows.period, maximum_wheel_speed=1e3,
                drivetrain=Drivetrain(),
            )  # fmt: skip
        self._row = build_row(robot, soil, ideal_sensors(windows.period))
        self._no_noise = np.zeros((windows.count, windows.samples, layout.NOISE_CHANNELS))
        self.spells: Mapping[str, Spell] = {}

    def during(self, spells: Mapping[str, Spell]) -> WindowModel:
        """The same model with effects that are present in a part of the windows only, by name."""
        other = copy(self)
        other.spells = dict(spells)
        return other

    def predict(
        self,
        values: Array,
        states: Array,
        effects: Sequence[Effect] = (),
        integrals: Array | None = None,
        near: Reference | None = None,
    ) -> Array:
        """Channels of all windows, (W, T, 8), or (W, T, 10) with the currents of the motors.

        Args:
            values: (P,) of the parameters.
            states: (W, 8) initial STATE.
            effects: missing physics.
            integrals: of :meth:`first_integrals` at these values and effects; found where it is None.
            near: a prediction that hardly differs, whose forces are extrapolated.
        """
        if near is None:
            return self._channels(values, states, effects, integrals)
        model = self._as_reference()
        if integrals is None:
            integrals = model._integrals_near(near.run_in, values, effects)
        return model._channels(values, states, effects, integrals, to_follow(near.forces))

    def on_threads(self, threads: int) -> WindowModel:
        """The same model on another number of threads."""
        model = copy(self)
        model.threads = threads
        return model

    def _integrals_near(self, run_in: ForceRecord | None, values: Array, effects: Sequence[Effect]) -> Array:
        return self.first_integrals(values, effects, None if run_in is None else to_follow(run_in))

    def _as_reference(self) -> WindowModel:
        """The same model as precise as a reference."""
        model = copy(self)
        model._numerics = reference_numerics(self._numerics)
        return model

    def _channels(
        self,
        values: Array,
        states: Array,
        effects: Sequence[Effect],
        integrals: Array | None,
        forces: ForceRecord | None = None,
    ) -> Array:
        entries = () if self.currents is None else RECORDED
        readings, record = self.predict_recorded(values, states, entries, effects, integrals, forces)
        if self.currents is None:
            return readings
        currents = self.currents.currents(motor_torques(record), record[..., :2], self.named(values))
        return np.concatenate([readings, currents], axis=2)

    def reference(self, values: Array, states: Array, effects: Sequence[Effect] = ()) -> Reference:
        """A prediction with what others near it need to be made fast. Arguments as :meth:`predict`."""
        model = self._as_reference()
        before = self._run_in_at(values)
        run_in = None if before is None else model._new_record(before.windows, run_in_numerics(model._numerics))
        integrals = model.first_integrals(values, effects, run_in)
        forces = model._new_record(self.windows, model._numerics)
        model._channels(values, states, effects, integrals, forces)
        # what others are held against follows the record, too: extrapolation by nothing changes a little
        integrals = model._integrals_near(run_in, values, effects)
        prediction = model._channels(values, states, effects, integrals, to_follow(forces))
        return Reference(prediction, forces, run_in, integrals)

    @staticmethod
    def _new_record(windows: WindowSet, numerics: Numerics) -> ForceRecord:
        steps = max(numerics.substeps, math.ceil(windows.period / numerics.maximum_step - 1e-9))
        return new_record(windows.count, windows.samples, steps, FOLLOWED_CHANGE)

    def named(self, values: Array) -> dict[str, float]:
        """Values (P,) of the parameters by name."""
        return dict(zip((parameter.name for parameter in self.parameters), values.tolist(), strict=True))

    def predict_recorded(
        self,
        values: Array,
        states: Array,
        entries: Sequence[int],
        effects: Sequence[Effect] = (),
        integrals: Array | None = None,
        forces: ForceRecord | None = None,
    ) -> tuple[Array, Array]:
        """Channels of all windows, (W, T, 8), and entries of the simulator's row at the samples, (W, T, K).

        Args:
            values: see :meth:`predict`.
            states: see there.
            entries: (K,) of :mod:`ddagr_gym.physics.layout`.
            effects: see there.
            integrals: see there.
            forces: that are kept, or followed.
        """
        chosen = tuple(e for e in (*self._known, *effects) if not (self._imposed and e.group == _MOTORS))
        simulator = Simulator(self.windows.count, numerics=self._numerics, effects=chosen, threads=self.threads)
        simulator.rows[:] = self._row
        self._silence(simulator)
        for parameter, value in zip(self.parameters, values, strict=True):
            parameter.apply(simulator.rows, float(value), self.windows.recording)
        delay = self._delays(values)
        commands, start = self._drive(delay, states)
        simulator.reset(state=dict(zip(STATE, start.T, strict=True)))
        simulator.rows[:, layout.TIME] = self.windows.time
        simulator.rows[:, layout.NEXT_POSE_TIME] = self.windows.time
        if not self._imposed:
            simulator.remember(self.windows.past(delay), self.windows.past_speeds)
            found = self.first_integrals(values, effects) if integrals is None else integrals
            simulator.rows[:, _INTEGRALS] = np.where(np.isfinite(found), found, simulator.rows[:, _INTEGRALS])
        recorded = np.asarray(entries, dtype=np.int64).reshape(-1)
        readings = np.empty((self.windows.count, self.windows.samples, len(CHANNELS)))
        record = np.empty((self.windows.count, self.windows.samples, recorded.size))
        simulator.advance(commands, self._no_noise, recorded, readings, record, forces=forces)
        simulator.close()
        return readings, record

    def first_integrals(
        self, values: Array, effects: Sequence[Effect] = (), forces: ForceRecord | None = None
    ) -> Array:
        """Integral parts of the speed loops at the start of the windows, (W, 2) [rad/s^2]; NaN where unknown.

        They are what a simulation of what was driven right before leaves; the motion at the start itself is known from
        readings. Arguments as :meth:`predict`.
        """
        found = np.full((self.windows.count, 2), np.nan)
        run_in = self._run_in_at(values)
        if run_in is None:
            return found
        before = self.on(run_in.windows)
        before._numerics = run_in_numerics(self._numerics)
        _, record = before.predict_recorded(values, run_in.windows.initial, _INTEGRALS, effects, forces=forces)
        found[run_in.leads_to] = record[:, -1]
        return found

    def _run_in_at(self, values: Array) -> RunIn | None:
        """What was driven before the windows, where it is simulated at these values of the parameters."""
        run_in = self.windows.run_in
        return run_in if run_in is not None and len(run_in.leads_to) and self._has_integral(values) else None

    def _has_integral(self, values: Array) -> bool:
        """Whether the speed loops have an integral part at these values of the parameters."""
        rate = float(self._row[_INTEGRAL_RATE])
        pairs = zip(self.parameters, values, strict=True)
        return rate > 0.0 or any(_INTEGRAL_RATE in parameter.entries and value > 0.0 for parameter, value in pairs)

    def _silence(self, simulator: Simulator) -> None:
        """Make effects neutral in the windows in which they are absent; those that are known are in all of them."""
        first = 0
        for effect in simulator.effects:
            actions = slice(first, first + len(effect.acting))
            first = actions.stop
            if effect.name in self.spells and effect not in self._known:
                sizes = {name: effect.parameter(name).metadata["neutral"] for name in effect.size_names()}
                absent = ~self.spells[effect.name].in_windows(self.windows)
                simulator.effect_parameters[absent, actions] = effect.with_values(**sizes).vector()

    def on(self, windows: WindowSet) -> WindowModel:
        """The same model over other windows of the same period."""
        other = copy(self)
        other.windows = windows
        other._no_noise = np.zeros((windows.count, windows.samples, layout.NOISE_CHANNELS))
        return other

    def _delays(self, values: Array) -> Array:
        """(W,) by which the commands of each window act late [s]."""
        delays = np.full(self.windows.count, self._delay)
        for parameter, value in zip(self.parameters, values, strict=True):
            if parameter.shift:
                delays[parameter.acts_in(self.windows.recording)] += value
        return delays

    def _drive(self, delay: Array, states: Array) -> tuple[Array, Array]:
        """(W, T, 2) commands as they act after ``delay`` (W,) [s], and the states to start from."""
        commands = self.windows.drive(delay)
        if not self._imposed:
            return commands, states
        # the first-order motor inverted: with these targets it has the recorded speed at every sample
        start = states.copy()
        start[:, _OMEGA] = self.windows.drive(delay + self.windows.period)[:, 0]
        before = np.concatenate([start[:, None, _OMEGA], commands[:, :-1]], axis=1)
        return before + (commands - before) / (1.0 - np.exp(-IMPOSED_RATE_PERIODS)), start

    def state_derivatives(self, values: Array, states: Array, near: Reference, effects: Sequence[Effect] = ()) -> Array:
        """d prediction / d STATE, (W, T, 8, 8), by forward differences; the pose's own part is exact."""
        base = near.prediction
        derivatives = np.zeros((*base.shape, len(STATE)))
        derivatives[..., :3] = pose_derivatives(states, base)

        def derivative(k: int, threads: int) -> Array:
            moved = states.copy()
            moved[:, k] += STATE_STEPS[k]
            varied = self.on_threads(threads).predict(values, moved, effects, near.integrals, near=near)
            return np.asarray((varied - base) / STATE_STEPS[k])

        # imposed wheel speeds leave nothing of the initial ones
        moving = range(3, _OMEGA.start) if self._imposed else _MOVING_STATE
        for k, found in zip(moving, side_by_side(derivative, moving, self.threads), strict=True):
            derivatives[..., k] = found
        return derivatives
