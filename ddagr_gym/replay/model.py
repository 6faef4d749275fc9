"""The simulator over windows: predictions and their derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.parameters import Imu, Numerics, PoseReceiver, Robot, Sensors, Soil, WheelEncoder
from ddagr_gym.physics import layout
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.terrain import SoilField
from ddagr_gym.replay.parameters import ModelParameter
from ddagr_gym.replay.windows import CHANNELS, STATE, WindowSet
from ddagr_gym.simulator import Simulator, build_row

Array = NDArray[np.float64]

IMPOSED_MOTOR_RATE = 400.0
"""Motor rate that makes the wheels follow recorded speeds within a few milliseconds [1/s]."""

STATE_STEPS = np.array([1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 2e-3, 2e-3])
"""Finite-difference steps of STATE [m, m, rad, m/s, m/s, rad/s, rad/s, rad/s]."""

_MOVING_STATE = range(3, len(STATE))


def ideal_sensors(period: float) -> Sensors:
    """Sensors without noise or quantisation, and a pose at every sample."""
    imu = Imu(
        sample_rate=1.0 / period, accelerometer_noise=0.0, gyro_noise=0.0, accelerometer_resolution=0.0,
        gyro_resolution=0.0, accelerometer_range=1e4, gyro_range=1e3,
    )  # fmt: skip
    return Sensors(imu, WheelEncoder(counts_per_revolution=0.0), PoseReceiver(1.0 / period, 0.0, 0.0))


class WindowModel:
    """Predicts all windows of a set at once.

    Args:
        robot: nominal robot.
        soil: nominal soil.
        windows: what to predict.
        parameters: what may move.
        imposed: True where the windows' commands are recorded wheel speeds.
        numerics: accuracy; ``Numerics.smooth()`` by default.
        threads: see :class:`Simulator`.
        field: soil by place in world coordinates, instead of ``soil``.
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
        field: SoilField | None = None,
    ) -> None:
        self.windows = windows
        self.parameters = tuple(parameters)
        self._numerics = Numerics.smooth() if numerics is None else numerics
        self._threads = threads
        self._field = field
        if imposed:
            robot = replace(robot, motor_rate=IMPOSED_MOTOR_RATE, maximum_wheel_speed=1e3)
        self._row = build_row(robot, soil, ideal_sensors(windows.period))
        self._no_noise = np.zeros((windows.count, windows.samples, layout.NOISE_CHANNELS))

    def predict(self, values: Array, states: Array, effects: Sequence[Effect] = ()) -> Array:
        """Channels of all windows, (W, T, 8).

        Args:
            values: (P,) of the parameters.
            states: (W, 8) initial STATE.
            effects: missing physics.
        """
        fields = () if self._field is None else (self._field,)
        simulator = Simulator(
            self.windows.count, numerics=self._numerics, effects=tuple(effects), threads=self._threads, fields=fields
        )
        simulator.rows[:] = self._row
        if self._field is not None:
            simulator.field_index[:] = 0
        for parameter, value in zip(self.parameters, values, strict=True):
            parameter.apply(simulator.rows, float(value), self.windows.recording)
        simulator.reset(state=dict(zip(STATE, states.T, strict=True)))
        simulator.rows[:, layout.TIME] = self.windows.time
        simulator.rows[:, layout.NEXT_POSE_TIME] = self.windows.time
        readings = np.empty((self.windows.count, self.windows.samples, len(CHANNELS)))
        record = np.empty((self.windows.count, self.windows.samples, 0))
        simulator.advance(self._commands(values), self._no_noise, np.empty(0, dtype=np.int64), readings, record)
        simulator.close()
        return readings

    def _commands(self, values: Array) -> Array:
        """(W, T, 2) commands, delayed by the shift parameters."""
        delay = sum(float(v) for p, v in zip(self.parameters, values, strict=True) if p.shift) / self.windows.period
        whole = int(np.floor(delay))
        part = delay - whole
        given, past, samples = self.windows.commands, self.windows.history, self.windows.samples
        newer = given[:, past - whole : past - whole + samples]
        older = given[:, past - whole - 1 : past - whole - 1 + samples]
        return np.ascontiguousarray((1.0 - part) * newer + part * older)

    def state_derivatives(self, values: Array, states: Array, base: Array, effects: Sequence[Effect] = ()) -> Array:
        """d prediction / d STATE, (W, T, 8, 8), by forward differences; the pose's own part is exact."""
        derivatives = np.zeros((*base.shape, len(STATE)))
        derivatives[..., 5, 0] = derivatives[..., 6, 1] = derivatives[..., 7, 2] = 1.0
        derivatives[..., 5, 2] = -(base[..., 6] - states[:, None, 1])
        derivatives[..., 6, 2] = base[..., 5] - states[:, None, 0]
        for k in _MOVING_STATE:
            moved = states.copy()
            moved[:, k] += STATE_STEPS[k]
            derivatives[..., k] = (self.predict(values, moved, effects) - base) / STATE_STEPS[k]
        return derivatives

    def parameter_derivatives(self, values: Array, states: Array, base: Array, effects: Sequence[Effect] = ()) -> Array:
        """d prediction / d parameters, (W, T, 8, P), by differences that stay inside the bounds."""
        derivatives = np.zeros((*base.shape, len(self.parameters)))
        for k, parameter in enumerate(self.parameters):
            step = parameter.step if values[k] + parameter.step <= parameter.high else -parameter.step
            moved = values.copy()
            moved[k] += step
            derivatives[..., k] = (self.predict(moved, states, effects) - base) / step
        return derivatives
