"""The simulator: functions of (state, command, noise, parameters) over a batch of environments.

The environment, the command line, replay, diagnosis and the tests all run :class:`Simulator`; a single robot is a
batch of one, so that single and vectorised runs agree to the bit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.parameters import Numerics, Robot, Sensors, Soil
from ddagr_gym.physics import layout
from ddagr_gym.physics.drivetrain import NO_LIMIT
from ddagr_gym.physics.effects import Effect, effect_table, load_effects
from ddagr_gym.physics.force_record import ForceRecord, no_record
from ddagr_gym.physics.numerics import step_numerics
from ddagr_gym.physics.terrain import SoilField
from ddagr_gym.physics.wheel_forces import finite_array, soil_vector
from ddagr_gym.row_threads import RowThreads
from ddagr_gym.sensors.normal_draws import FILL, GIVEN
from ddagr_gym.simulator_kernel import remember_rows, settle_rows

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

INITIAL_STATE = ("x", "y", "yaw", "v_x", "v_y", "yaw_rate", "omega_right", "omega_left")
"""Names that an initial state may set; the others start at zero."""

_MOTION = {
    "x": layout.X,
    "y": layout.Y,
    "yaw": layout.YAW,
    "v_x": layout.V_X,
    "v_y": layout.V_Y,
    "yaw_rate": layout.YAW_RATE,
    "omega_right": layout.OMEGA,
    "omega_left": layout.OMEGA + 1,
}

TRUTH: dict[str, int] = {f"true_{name}": index for name, index in _MOTION.items()}
for _name, _first in (
    ("slip_ratio", layout.SLIP_RATIO),
    ("sinkage", layout.SINKAGE),
    ("load", layout.LOAD),
    ("force_x", layout.FORCE_X),
    ("force_y", layout.FORCE_Y),
    ("yaw_moment", layout.YAW_MOMENT),
    ("axle_torque", layout.AXLE_TORQUE),
    ("bogged", layout.BOGGED),
):
    TRUTH |= {f"true_{_name}_{wheel + 1}": _first + wheel for wheel in range(4)}
"""Truth columns of a simulated drive and their places in a row."""

Soils = Soil | Sequence[Soil]

_FORGOTTEN = (
    (layout.WHEEL_ANGLE, 2),
    (layout.LAST_COUNT, 2),
    (layout.SINKAGE, 4),
    (layout.INTEGRAL, 3),
    (layout.TARGET_RING, layout.SIZE - layout.TARGET_RING),
)
"""First entries and sizes of what a reset sets to zero."""


def _soils(soil: Soils) -> Array:
    per_wheel = [soil] * 4 if isinstance(soil, Soil) else list(soil)
    if len(per_wheel) != 4:
        raise InputError(
            f"{len(per_wheel)} soils given: give one for all wheels, or four (1 front right ... 4 rear left)."
        )
    return np.concatenate([soil_vector(item) for item in per_wheel])


def _sensor_entries(sensors: Sensors) -> dict[int, Any]:
    imu, encoder, pose = sensors.imu, sensors.encoder, sensors.pose
    return {
        layout.SAMPLE_PERIOD: sensors.period,
        layout.ACCELEROMETER_NOISE: imu.accelerometer_noise,
        layout.ACCELEROMETER_VIBRATION: imu.accelerometer_vibration,
        layout.ACCELEROMETER_BIAS: imu.accelerometer_bias,
        layout.ACCELEROMETER_SCALE: imu.accelerometer_scale,
        layout.ACCELEROMETER_RANGE: imu.accelerometer_range,
        layout.ACCELEROMETER_RESOLUTION: imu.accelerometer_resolution,
        layout.GYRO_NOISE: imu.gyro_noise,
        layout.GYRO_BIAS: imu.gyro_bias,
        layout.GYRO_SCALE: imu.gyro_scale,
        layout.GYRO_RANGE: imu.gyro_range,
        layout.GYRO_RESOLUTION: imu.gyro_resolution,
        layout.IMU_POSITION: imu.position,
        layout.IMU_MOUNTING_YAW: imu.mounting_yaw,
        layout.ENCODER_COUNTS: encoder.counts_per_revolution,
        layout.ENCODER_NOISE: encoder.speed_noise,
        layout.ENCODER_SCALE: encoder.scale,
        layout.POSE_PERIOD: 1.0 / pose.rate if pose.rate > 0 else 0.0,
        layout.POSE_POSITION_NOISE: pose.position_noise,
        layout.POSE_YAW_NOISE: pose.yaw_noise,
    }


def build_row(robot: Robot, soil: Soils, sensors: Sensors) -> Array:
    """Row of a robot at rest at the world origin, shape (layout.SIZE,)."""
    row = np.zeros(layout.SIZE)
    wheels = [[getattr(w, name) for w in robot.wheels] for name in ("minor_radius", "half_width", "major_radius")]
    entries: dict[int, Any] = {
        layout.BASE_BODY: (robot.mass, robot.yaw_inertia, *robot.centre_of_mass, 0.0, 0.0),
        layout.BASE_WHEEL: np.ravel(wheels),
        layout.HALF_WHEELBASE: robot.half_wheelbase,
        layout.HALF_TRACK: robot.half_track,
        layout.SIDE_SLIP_LEAD: robot.side_slip_lead,
        layout.SINKAGE_TILT: robot.sinkage_tilt,
        layout.BASE_MOTOR_RATE: robot.motor_rate,
        layout.MAXIMUM_WHEEL_SPEED: robot.maximum_wheel_speed,
        layout.BASE_DRIVETRAIN: [getattr(robot.drivetrain, name) for name in layout.DRIVETRAIN_PARAMETERS],
        layout.COMMAND_GAIN: (1.0, 1.0),
        layout.COMMAND_DELAY: robot.drivetrain.command_delay,
        layout.COMMAND_DEADBAND: robot.drivetrain.command_deadband,
        layout.TURNING_LIMIT: robot.drivetrain.turning_limit,
        layout.MEAN_RAMP: robot.drivetrain.mean_ramp,
        layout.TURNING_RAMP: robot.drivetrain.turning_ramp,
        layout.COMMAND_RAMP: robot.drivetrain.command_ramp,
        layout.COMMAND_FILTER: robot.drivetrain.command_filter,
        layout.BASE_SOIL: _soils(soil),
        **_sensor_entries(sensors),
    }
    for index, value in entries.items():
        values = np.atleast_1d(np.asarray(value, dtype=np.float64))
        row[index : index + values.size] = values
    return row


def _plain(bundle: tuple[Any, ...]) -> tuple[Any, ...]:
    """A named tuple, and those inside it, as plain ones."""
    return tuple(_plain(item) if isinstance(item, tuple) else item for item in bundle)


class Simulator:
    """A batch of robots, stepped at the sensor rate.

    Args:
        count: number of environments N.
        numerics: accuracy against cost.
        effects: missing physics, the same kinds in every environment (see ``effect_parameters`` for sizes).
        fields: soil grids of equal shape that environments may drive on.
        threads: threads that share the batch; results do not depend on it.

    Attributes:
        rows: (N, layout.SIZE) state and parameters; copy to save, assign to restore.
        effect_parameters: (N, actions, layout.EFFECT_PARAMETERS).
        effect_memory: (N, actions, layout.EFFECT_MEMORY).
        field_index: (N,) soil grid of each environment, -1 for the row's own soils.
    """

    def __init__(
        self,
        count: int = 1,
        *,
        numerics: Numerics = Numerics(),
        effects: Sequence[Effect | str] = (),
        fields: Sequence[SoilField] = (),
        threads: int = 1,
    ) -> None:
        if count < 1 or threads < 1:
            raise InputError(f"count is {count} and threads {threads}: both must be at least 1.")
        self.count = count
        self.numerics = numerics
        self.effects = load_effects(effects)
        self.rows = np.zeros((count, layout.SIZE))
        self._points, self._addresses, parameters = effect_table(self.effects)
        self.effect_parameters = np.repeat(parameters[None], count, axis=0)
        self.effect_memory = np.zeros((count, len(parameters), layout.EFFECT_MEMORY))
        self.field_index = np.full(count, -1, dtype=np.int64)
        self._set_fields(fields)
        self._numerics = _plain(step_numerics(numerics))
        self._given = np.full(count, GIVEN, dtype=np.int64)
        self._no_record = tuple(no_record(count))
        self._threads = RowThreads(count, threads)

    def __setstate__(self, state: dict[str, Any]) -> None:
        # functions lie elsewhere in another process
        self.__dict__ |= state | {"_addresses": effect_table(state["effects"])[1]}

    def _set_fields(self, fields: Sequence[SoilField]) -> None:
        if len({field.values.shape for field in fields}) > 1:
            shapes = sorted({field.values.shape for field in fields})
            raise InputError(f"soil fields of shapes {shapes}: give all fields of one batch the same shape.")
        values = [field.values for field in fields] or [np.zeros((2, 2, 9))]
        geometry = [(*field.origin, *field.spacing) for field in fields] or [(0.0, 0.0, 1.0, 1.0)]
        self._fields = np.ascontiguousarray(np.stack(values), dtype=np.float64)
        self._field_geometry = np.array(geometry, dtype=np.float64)

    def set_field(self, index: int, field: SoilField | None) -> None:
        """Let environment ``index`` drive on a soil grid of its own, or, with None, on its row's soils.

        Raises:
            InputError: a grid of another shape than the batch's.
        """
        if field is None:
            self.field_index[index] = -1
            return
        if self._fields.shape[0] != self.count or self._fields.shape[1:] != field.values.shape:
            if (np.delete(self.field_index, index) >= 0).any():
                raise InputError(
                    f"soil field of shape {field.values.shape} in a batch of shape {self._fields.shape[1:]}: "
                    "give all fields of one batch the same shape."
                )
            self._fields = np.zeros((self.count, *field.values.shape))
            self._field_geometry = np.ones((self.count, 4))
        self._fields[index] = field.values
        self._field_geometry[index] = (*field.origin, *field.spacing)
        self.field_index[index] = index

    def configure(self, index: int, robot: Robot, soil: Soils, sensors: Sensors = Sensors()) -> None:
        """Give environment ``index`` its robot, soil and sensors; it stands at rest until :meth:`reset`."""
        self.rows[index] = build_row(robot, soil, sensors)

    def reset(
        self, chosen: ArrayLike | None = None, state: Mapping[str, ArrayLike] | None = None, *, time: float = 0.0
    ) -> None:
        """Put environments at a state, forget the past, and settle their sinkages.

        Args:
            chosen: indices, all by default.
            state: values or (len(chosen),) arrays for some of ``INITIAL_STATE``; zero for the others.
            time: of the state [s].

        Raises:
            InputError: unknown name or a value that is not finite.
        """
        indices = np.arange(self.count) if chosen is None else np.atleast_1d(np.asarray(chosen, dtype=np.int64))
        given = dict(state or {})
        for name in given:
            if name not in _MOTION:
                raise InputError(f"initial state has no {name!r}: it takes {', '.join(_MOTION)}.")
        for name, index in _MOTION.items():
            values = finite_array(f"initial {name}", given.get(name, 0.0))
            if values.shape not in ((), indices.shape):
                raise InputError(f"initial {name} has shape {values.shape}: give one value, or {indices.shape}.")
            self.rows[indices, index] = values
        self.rows[indices, layout.TIME] = time
        self.rows[indices, layout.NEXT_POSE_TIME] = time
        for index, size in _FORGOTTEN:
            self.rows[np.ix_(indices, np.arange(index, index + size))] = 0.0
        for bank in range(2):
            self.rows[indices, layout.SET_POINT + bank] = self.rows[indices, layout.OMEGA + bank]
            self.rows[indices, layout.FILTERED + bank] = self.rows[indices, layout.OMEGA + bank]
        self.effect_memory[indices] = 0.0
        settle_rows(self.rows, indices, self._grids(), self._actions(), self._numerics)

    def remember(self, past: Array, speeds: Array | None = None) -> None:
        """Give drivetrains and effects on motors what was commanded before the present motion, which stays as it is.

        A delay or a lag without past commands assumes that the motors have settled at their speeds of the start; with
        past commands it assumes the same of the time before them.

        Args:
            past: (N, H, 2) commands of the samples before, the latest last [rad/s]; NaN where unknown.
            speeds: (N, H, 2) bank speeds at the ends of these samples [rad/s], NaN where unknown: the integral parts of
                speed loops grow by their errors. Without them the loops are taken to have settled at the start.
        """
        on_motors = np.isin(self._points, (layout.POINT_COMMANDS, layout.POINT_SET_POINTS, layout.POINT_MOTORS)).any()
        if on_motors or self._remembers():
            known = np.full(past.shape, np.nan) if speeds is None else speeds
            remember_rows(self.rows, np.ascontiguousarray(past), np.ascontiguousarray(known), self._actions())

    def _remembers(self) -> bool:
        """Whether any drivetrain depends on commands of the past."""
        ramps = self.rows[:, [layout.MEAN_RAMP, layout.TURNING_RAMP, layout.COMMAND_RAMP]].min(axis=1) < NO_LIMIT
        integral = self.rows[:, layout.BASE_DRIVETRAIN + layout.INTEGRAL_RATE] > 0.0
        late = self.rows[:, [layout.COMMAND_DELAY, layout.COMMAND_FILTER]].max(axis=1) > 0.0
        return bool((ramps | integral | late).any())

    def _grids(self) -> tuple[Any, ...]:
        return self._fields, self._field_geometry, self.field_index

    def _actions(self) -> tuple[Any, ...]:
        return self._points, self._addresses, self.effect_parameters, self.effect_memory

    def advance(
        self,
        commands: Array,
        noise: Array,
        recorded: Integers,
        readings: Array,
        record: Array,
        generators: Integers | None = None,
        forces: ForceRecord | None = None,
    ) -> None:
        """Advance all environments by the samples in ``noise``, without checks; see :func:`advance_rows`.

        Args:
            commands: (N, samples or 1, 2) right and left bank speed commands [rad/s].
            noise: (N, samples, layout.NOISE_CHANNELS) standard normal draws; written where generators are given.
            recorded: (K,) row entries to record after each sample.
            readings: (N, samples, 8), written in the order of ``layout.READINGS``.
            record: (N, samples, K), written.
            generators: (N,) of :meth:`NormalDraws.prepare`.
            forces: that the environments keep, or follow.
        """
        drawn = self._given if generators is None else generators
        stretch = (commands, noise, FILL, drawn, recorded, readings, record)
        shared = (stretch, self._grids(), self._actions(), self._numerics)
        self._threads.advance(self.rows, noise.shape[1], *shared, self._no_record if forces is None else tuple(forces))

    def step(
        self, commands: ArrayLike, noise: ArrayLike | None = None, *, recorded: Sequence[int] = (), samples: int = 1
    ) -> tuple[Array, Array]:
        """Advance by ``samples`` sensor samples, or by as many as ``commands`` has.

        Args:
            commands: (N, 2) constant, or (N, T, 2) one per sample [rad/s].
            noise: (N, T, layout.NOISE_CHANNELS) standard normal draws; none by default.
            recorded: row entries to record.
            samples: T, for constant commands.

        Returns:
            readings (N, T, 8) and record (N, T, len(recorded)).

        Raises:
            InputError: commands or noise of the wrong shape or not finite, entries that a row does not have.
        """
        given = np.ascontiguousarray(finite_array("commands", commands))
        if given.ndim == 2:
            given = given[:, None, :]
        if given.ndim != 3 or given.shape[0] != self.count or given.shape[2] != 2:
            raise InputError(f"commands have shape {given.shape}: give ({self.count}, 2) or ({self.count}, T, 2).")
        steps = given.shape[1] if given.shape[1] > 1 else samples
        shape = (self.count, steps, layout.NOISE_CHANNELS)
        draws = np.zeros(shape) if noise is None else finite_array("noise", noise)
        if draws.shape != shape or steps < 1:
            raise InputError(f"noise has shape {draws.shape} for {steps} samples: give {shape}, samples >= 1.")
        entries = np.asarray(recorded, dtype=np.int64).reshape(-1)
        if ((entries < 0) | (entries >= layout.SIZE)).any():
            raise InputError(f"recorded holds {entries.tolist()}: give row entries from 0 to {layout.SIZE - 1}.")
        readings = np.empty((self.count, steps, len(layout.READINGS)))
        record = np.empty((self.count, steps, entries.size))
        self.advance(given, np.ascontiguousarray(draws), entries, readings, record)
        return readings, record

    def close(self) -> None:
        """Stop the threads; may be called again."""
        self._threads.close()

    @property
    def bogged(self) -> NDArray[np.bool_]:
        """(N,) whether any wheel has found no sinkage that carries it."""
        return np.asarray(self.rows[:, layout.BOGGED : layout.BOGGED + 4].any(axis=1))


def simulate(
    robot: Robot,
    soil: Soils,
    commands: ArrayLike,
    *,
    sensors: Sensors = Sensors(),
    effects: Sequence[Effect | str] = (),
    field: SoilField | None = None,
    numerics: Numerics = Numerics(),
    initial_state: Mapping[str, float] | None = None,
    seed: int = 0,
) -> dict[str, Array]:
    """Drive one robot by a series of commands and return what a recording of it would hold, and the truth.

    Args:
        robot: the robot.
        soil: one soil, or one per wheel.
        commands: (T, 2) right and left bank speed commands at the sensor rate [rad/s].
        sensors: instruments; ``sensors.imu.sample_rate`` sets the rate.
        effects: objects or ``name=size`` texts.
        field: soil by place, instead of ``soil``.
        numerics: accuracy.
        initial_state: see :meth:`Simulator.reset`; at rest at the origin by default.
        seed: of the sensor noise.

    Returns:
        Columns (T,) by name: ``t``, commands, readings (NaN where a channel has no new sample) and ``true_*``.
        Row k holds the command applied from ``t[k] - period`` to ``t[k]`` and the readings at ``t[k]``.

    Raises:
        InputError: bad shapes or values, each in one sentence.
    """
    given = finite_array("commands", commands)
    if given.ndim != 2 or given.shape[1] != 2 or given.shape[0] < 1:
        raise InputError(f"commands have shape {given.shape}: give (T, 2) right and left bank speeds, T >= 1.")
    simulator = Simulator(1, numerics=numerics, effects=effects, fields=() if field is None else (field,))
    simulator.configure(0, robot, soil, sensors)
    simulator.field_index[0] = -1 if field is None else 0
    simulator.reset(state=initial_state)
    noise = np.random.default_rng(seed).standard_normal((1, len(given), layout.NOISE_CHANNELS))
    readings, record = simulator.step(given[None], noise, recorded=list(TRUTH.values()))
    columns: dict[str, Array] = {"t": np.arange(1.0, len(given) + 1.0) * sensors.period}
    columns |= {"command_right": given[:, 0].copy(), "command_left": given[:, 1].copy()}
    columns |= {name: readings[0, :, i].copy() for i, name in enumerate(layout.READINGS)}
    columns |= {name: record[0, :, i].copy() for i, name in enumerate(TRUTH)}
    return columns
