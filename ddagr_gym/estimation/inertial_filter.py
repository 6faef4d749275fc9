"""The inertial filter: velocities by the accelerometer, gravity as a state, the force law as a measurement.

Theory: filter, section 9.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.estimation import inertial_layout as layout
from ddagr_gym.estimation.columns import sample_times, stack_columns
from ddagr_gym.estimation.filter_model import FilterModel, FilterNoise, SoilPrior
from ddagr_gym.estimation.inertial_kernels import inertial_rows, inertial_series
from ddagr_gym.estimation.layout import CHANNELS, COMMANDS, X
from ddagr_gym.parameters import Robot, Sensors
from ddagr_gym.validated import Validated, bounded

Array = NDArray[np.float64]


@dataclass(frozen=True)
class InertialKnowledge(Validated):
    """What the inertial filter is given beyond a :class:`~ddagr_gym.estimation.FilterModel`.

    Attributes:
        balance_x: what the force law misses of F_x/m, standard deviation of one balance [m/s^2].
        balance_y: of F_y/m [m/s^2].
        balance_turn: of M/I [rad/s^2].
        balance_learning: further variance that only the gain of the soil's parameters sees, over that of a balance.
        balance_interval: forces are balanced at every how-manieth sample.
        launch_speed: mean speed of the rims below which the robot is taken to roll instead [m/s]: near rest the law's
            forces depend too steeply on the velocities.
        launch_slip: standard deviation of slip and slip angle there [-].
        launch_floor: that of the velocities at rest [m/s].
        known_pull: while gravity along the robot less the accelerometer's bias is not known this well, slip is also
            taken to be as small as at launch [m/s^2]; 0.13 s of standing are enough.
        vibration: further noise of the accelerometer per speed of the rims [(m/s^2)/(m/s)]; the least that is taken.
        learns_vibration: whether more is learnt on the way (theory: filter, eq. (13d)).
        vibration_weight: how many blocks of readings what is known before counts for then.
        largest_acceleration: of the robot; a reading of the accelerometer that says more counts as missing [m/s^2].
        unknown_acceleration: random walk of the velocities where the accelerometer is missing [m/s^2/sqrt(Hz)].
        gravity_deviation: initial, of either component of gravity along the ground [m/s^2].
        gravity_walk: how the ground's slope changes along the drive [m/s^2/sqrt(s)].
        patch_ahead: mean distance ahead of the hubs at which lateral forces act [m].
        patch_deviation: of it [m], from soil to soil and along a turn.
        patch_time: in which it is forgotten [s].
    """

    balance_x: float = bounded("m/s^2", 0.0, 1e3, default=0.1, open_low=True)
    balance_y: float = bounded("m/s^2", 0.0, 1e3, default=0.1, open_low=True)
    balance_turn: float = bounded("rad/s^2", 0.0, 1e3, default=0.1, open_low=True)
    balance_learning: float = bounded("-", 0.0, 1e9, default=10.0)
    balance_interval: int = 3
    launch_speed: float = bounded("m/s", 0.0, 10.0, default=0.1)
    launch_slip: float = bounded("-", 0.0, 10.0, default=0.3)
    launch_floor: float = bounded("m/s", 0.0, 10.0, default=2e-3, open_low=True)
    known_pull: float = bounded("m/s^2", 0.0, 1e3, default=0.008, open_low=True)
    vibration: float = bounded("1/s", 0.0, 100.0, default=0.0)
    learns_vibration: bool = True
    vibration_weight: float = bounded("-", 0.0, 1e9, default=10.0, open_low=True)
    largest_acceleration: float = bounded("m/s^2", 0.0, 1e3, default=5.0, open_low=True)
    unknown_acceleration: float = bounded("m/s^2/sqrt(Hz)", 0.0, 1e3, default=0.1)
    gravity_deviation: float = bounded("m/s^2", 0.0, 10.0, default=0.6, open_low=True)
    gravity_walk: float = bounded("m/s^2/sqrt(s)", 0.0, 10.0, default=3e-4)
    patch_ahead: float = bounded("m", -1.0, 1.0, default=0.026)
    patch_deviation: float = bounded("m", 0.0, 1.0, default=0.025, open_low=True)
    patch_time: float = bounded("s", 0.0, 1e3, default=5.0, open_low=True)

    def _check(self) -> None:
        if self.balance_interval < 1:
            raise InputError(f"InertialKnowledge.balance_interval is {self.balance_interval}: give 1 or more.")


@dataclass(frozen=True)
class InertialModel:
    """Model of the inertial filter.

    Attributes:
        flat: robot, sensors and soil, as for the filter that takes the ground for level.
        knowledge: the rest.
    """

    flat: FilterModel
    knowledge: InertialKnowledge = InertialKnowledge()

    @classmethod
    def of(cls, robot: Robot, sensors: Sensors, prior: SoilPrior | None = None) -> InertialModel:
        """Model of a robot with its instruments, and what turns on simulated plants chose of the rest.

        The lateral law is not taken as known (``coupling_deviation``): bulldozing and side walls change it by a fifth.
        How much the accelerometer shakes is learnt on the way where the sensors say nothing of it.

        Args:
            robot: of the filter.
            sensors: likewise.
            prior: of the soil, but for ``coupling_deviation``; that of all soils where it is left out.
        """
        noise = FilterNoise.from_sensors(sensors, acceleration=5e-4, yaw_acceleration=0.02, soil=0.05)
        prior = replace(prior or SoilPrior(), coupling_deviation=0.15)
        knowledge = InertialKnowledge(vibration=sensors.imu.accelerometer_vibration)
        model = cls(FilterModel.of(robot, sensors, noise=noise, prior=prior), knowledge)
        return model.with_known_vibration() if knowledge.vibration > 0.0 else model

    def with_known_vibration(self) -> InertialModel:
        """The same, whose accelerometer shakes just as much as it is told; nothing is learnt of it on the way."""
        return replace(self, knowledge=replace(self.knowledge, learns_vibration=False))

    def initial(self) -> tuple[Array, Array]:
        """State (15,) at rest and covariance (15, 15) before any sample."""
        state, covariance = self.flat.initial()
        own = self.knowledge
        added = [own.gravity_deviation] * 2 + [own.patch_deviation]
        whole = np.diag(np.concatenate([np.zeros(len(state)), np.square(added)]))
        whole[: len(state), : len(state)] = covariance
        return np.concatenate([state, [0.0, 0.0, own.patch_ahead]]), whole

    def pack(self) -> Array:
        """The model as the kernels read it, (inertial_layout.MODEL_SIZE,)."""
        own = self.knowledge
        packed = np.zeros(layout.MODEL_SIZE)
        flat = self.flat.pack()
        packed[: len(flat)] = flat
        packed[layout.BALANCE : layout.BALANCE + 3] = np.square([own.balance_x, own.balance_y, own.balance_turn])
        packed[layout.BALANCE_LEARNING] = own.balance_learning
        packed[layout.BALANCE_INTERVAL] = own.balance_interval
        packed[layout.LAUNCH_SPEED] = own.launch_speed
        packed[layout.LAUNCH_SLIP] = own.launch_slip
        packed[layout.LAUNCH_FLOOR] = own.launch_floor
        packed[layout.KNOWN_PULL] = own.known_pull**2
        packed[layout.VIBRATION] = own.vibration
        packed[layout.VIBRATION_WEIGHT] = own.vibration_weight
        packed[layout.LARGEST_ACCELERATION] = own.largest_acceleration
        packed[layout.UNKNOWN_ACCELERATION] = own.unknown_acceleration**2
        packed[layout.GRAVITY_WALK] = own.gravity_walk**2
        packed[layout.PATCH_MEAN] = own.patch_ahead
        packed[layout.PATCH_VARIANCE] = own.patch_deviation**2
        packed[layout.PATCH_RATE] = 1.0 / own.patch_time
        packed[layout.ADDED_FLOOR : layout.ADDED_FLOOR + 3] = 1e-8
        packed[layout.ADDED_CEILING : layout.ADDED_CEILING + 3] = np.square([3.0, 3.0, 0.2])
        packed[layout.ADDED_LIMIT : layout.ADDED_LIMIT + 3] = [5.0, 5.0, 0.3]
        return packed


class InertialFilter:
    """Extended Kalman filter of one robot on ground that may slope.

    Args:
        model: what the filter knows.
    """

    def __init__(self, model: InertialModel) -> None:
        self.model = model
        self._packed = model.pack()
        self._work = np.zeros(layout.WORK_SIZE)
        self._period = np.array([model.flat.sample_period])
        self.reset()

    @property
    def state(self) -> Array:
        """(15,), see :data:`~ddagr_gym.estimation.inertial_layout.INERTIAL_STATE`; a view."""
        return self._work[X : X + layout.INERTIAL_STATE_SIZE]

    @property
    def covariance(self) -> Array:
        """(15, 15); a view."""
        return _covariances(self._work[None])[0]

    @property
    def pose(self) -> Array:
        """(3,) x, y [m] and continuous yaw [rad] in the world in which the filter was placed; a view."""
        return self._work[layout.POSE : layout.POSE + layout.POSE_SIZE]

    @property
    def pose_covariance(self) -> Array:
        """(3, 3); a view."""
        return _pose_covariances(self._work[None, layout.POSE :])[0]

    @property
    def known_push(self) -> Array:
        """(3,) what pushes the robot besides wheels and gravity: F_x/m, F_y/m [m/s^2], M/I [rad/s^2]; a view."""
        return self._work[layout.KNOWN_PUSH : layout.KNOWN_PUSH + 3]

    @property
    def vibration(self) -> float:
        """Noise of the accelerometer per speed of the rims [(m/s^2)/(m/s)], as far as it is known by now."""
        return max(self.model.knowledge.vibration, float(self._work[layout.VIBRATION_LEARNT]))

    def reset(self, pose: ArrayLike = (0.0, 0.0, 0.0), gravity: ArrayLike = (0.0, 0.0)) -> None:
        """Start again from the prior, at rest, without a known push.

        Args:
            pose: known, x, y [m], yaw [rad].
            gravity: mean of its pull along body x and y [m/s^2]; the model's knowledge has its deviation.
        """
        self._work[:] = 0.0
        self._work[layout.LEARNS_VIBRATION] = float(self.model.knowledge.learns_vibration)
        self.state[:], self.covariance[:] = self.model.initial()
        self.state[layout.GRAVITY : layout.GRAVITY + 2] = gravity
        self.pose[:] = pose
        self._count = 0

    def learn_vibration(self) -> None:
        """Learn until the next reset how much the accelerometer shakes, whatever the model says."""
        self._work[layout.LEARNS_VIBRATION] = 1.0

    def run(self, commands: Array, readings: Array, durations: Array | None = None) -> tuple[Array, Array]:
        """Predict and correct through samples.

        Args:
            commands: (T or 1, 2) right and left bank speed commands [rad/s]; NaN: unknown.
            readings: (T, 5) in the order of ``CHANNELS``; NaN where a channel has no sample.
            durations: (T,) since the sample before [s]; the model's sample period by default.

        Returns:
            States after each sample (T, 15), and standardised innovations (T, 5).
        """
        states, _, standardised = self._through(commands, readings, durations)
        return states, standardised

    def track(self, commands: Array, readings: Array, durations: Array | None = None) -> tuple[Array, Array]:
        """As :meth:`run`; returns poses after each sample (T, 3) and their covariances (T, 3, 3)."""
        _, poses, _ = self._through(commands, readings, durations)
        return poses[:, : layout.POSE_SIZE], _pose_covariances(poses)

    def _through(self, commands: Array, readings: Array, durations: Array | None) -> tuple[Array, Array, Array]:
        """States (T, 15), poses with covariances (T, 12) and innovations (T, 5)."""
        count = len(readings)
        states, standardised = np.empty((count, layout.INERTIAL_STATE_SIZE)), np.empty(readings.shape)
        poses = np.empty((count, layout.POSE_SIZE * (layout.POSE_SIZE + 1)))
        inertial_series(
            self._packed, self._count, commands, readings, self._period if durations is None else durations, states,
            poses, standardised, self._work,
        )  # fmt: skip
        self._count += count
        return states, poses, standardised


class InertialBatch:
    """Inertial filters of N robots that share one model, with the face of :class:`~ddagr_gym.estimation.BatchFilter`.

    Args:
        model: what the filters know.
        count: N.
    """

    REMEMBERED: tuple[str, ...] = ("works", "_counts")
    """Arrays that it goes on from."""

    def __init__(self, model: InertialModel, count: int = 1) -> None:
        if count < 1:
            raise InputError(f"count is {count}: give at least one robot.")
        self.model = model
        self.count = count
        self.works = np.zeros((count, layout.WORK_SIZE))
        self._packed = model.pack()
        self._counts = np.zeros(count, dtype=np.int64)
        self.reset()

    @property
    def states(self) -> Array:
        """(N, 15), see :data:`~ddagr_gym.estimation.inertial_layout.INERTIAL_STATE`; a copy."""
        return self.works[:, X : X + layout.INERTIAL_STATE_SIZE].copy()

    @property
    def covariances(self) -> Array:
        """(N, 15, 15); a copy."""
        return _covariances(self.works).copy()

    @property
    def poses(self) -> Array:
        """(N, 3) x, y [m] and continuous yaw [rad] since the start; a copy."""
        return self.works[:, layout.POSE : layout.POSE + layout.POSE_SIZE].copy()

    @property
    def pose_covariances(self) -> Array:
        """(N, 3, 3); a copy."""
        return _pose_covariances(self.works[:, layout.POSE :]).copy()

    def reset(self, chosen: ArrayLike | None = None) -> None:
        """Start from the prior, at rest; ``chosen``: indices of robots, all by default."""
        indices = np.arange(self.count) if chosen is None else np.atleast_1d(np.asarray(chosen))
        state, covariance = self.model.initial()
        self.works[indices] = 0.0
        self.works[indices, layout.LEARNS_VIBRATION] = float(self.model.knowledge.learns_vibration)
        self.works[indices, X : X + len(state)] = state
        _covariances(self.works)[indices] = covariance
        self._counts[indices] = 0

    def learn_vibration(self, chosen: ArrayLike) -> None:
        """As :meth:`InertialFilter.learn_vibration`, for robots by index."""
        self.works[np.asarray(chosen), layout.LEARNS_VIBRATION] = 1.0

    def step(self, commands: ArrayLike, readings: ArrayLike) -> Array:
        """Predict and correct through samples.

        Args:
            commands: (N, 2) right and left bank speed commands, constant over the samples [rad/s]; NaN: unknown.
            readings: (N, K, 5) in the order of ``CHANNELS``; NaN where a channel has no sample.

        Returns:
            Standardised innovations (N, K, 5).

        Raises:
            InputError: shapes that do not fit.
        """
        drive = np.ascontiguousarray(commands, dtype=np.float64)
        samples = np.ascontiguousarray(readings, dtype=np.float64)
        if drive.shape != (self.count, 2) or samples.ndim != 3 or samples.shape[::2] != (self.count, len(CHANNELS)):
            raise InputError(
                f"commands and readings have shapes {drive.shape}, {samples.shape}: give ({self.count}, 2) and "
                f"({self.count}, K, {len(CHANNELS)})."
            )
        standardised = np.empty(samples.shape)
        period = float(self.model.flat.sample_period)
        inertial_rows(self._packed, self._counts, drive, samples, period, standardised, self.works)
        return standardised


def _covariances(works: Array) -> Array:
    """(N, 15, 15) of workspaces (N, WORK_SIZE); a view."""
    size = layout.INERTIAL_STATE_SIZE
    whole = works[:, layout.Q : layout.Q + 16 * layout.STRIDE]
    return whole.reshape(len(works), 16, layout.STRIDE)[:, :size, :size]


def _pose_covariances(poses: Array) -> Array:
    """(N, 3, 3) of rows that begin with a pose and its covariance (N, 12 or more); a view."""
    size = layout.POSE_SIZE
    return poses[:, size : size * (size + 1)].reshape(len(poses), size, size)


def run_inertial_filter(model: InertialModel, columns: Mapping[str, ArrayLike]) -> tuple[Array, Array]:
    """Filter a recording as :func:`~ddagr_gym.estimation.run_filter` does; states (T, 15), innovations (T, 5)."""
    _, durations = sample_times(columns, model.flat.sample_period)
    commands, readings = stack_columns(columns, COMMANDS, np.nan), stack_columns(columns, CHANNELS, np.nan)
    return InertialFilter(model).run(commands, readings, durations)


def run_inertial_track(
    model: InertialModel, columns: Mapping[str, ArrayLike], start: ArrayLike = (0.0, 0.0, 0.0)
) -> tuple[Array, Array]:
    """Where the inertial filter takes the robot to be along a recording (theory: filter, section 9, eq. (13a)).

    Args:
        model: what the filter knows.
        columns: recording, as for :func:`run_inertial_filter`.
        start: pose x, y [m], yaw [rad] at rest before the first sample.

    Returns:
        Poses after each sample (T, 3) and their covariances (T, 3, 3).
    """
    _, durations = sample_times(columns, model.flat.sample_period)
    commands, readings = stack_columns(columns, COMMANDS, np.nan), stack_columns(columns, CHANNELS, np.nan)
    one = InertialFilter(model)
    one.reset(start)
    return one.track(commands, readings, durations)
