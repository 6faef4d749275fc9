"""Settings of the row-turn environment, and the episodes that they draw."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, field, fields, replace
from numbers import Real

import numpy as np

from ddagr_gym.control.observation import OBSERVATION
from ddagr_gym.control.row_turn import SIDES, RowTurn
from ddagr_gym.control.timing import CONTROL_INTERVAL, CONTROL_PERIOD
from ddagr_gym.envs.calibrated_draws import CalibratedDraws, GroundDraws
from ddagr_gym.envs.constants import EPISODE_DURATION, HEADLAND_DEPTH, OBSERVATION_LIMIT, ROW_MARGIN
from ddagr_gym.envs.ekf_features import check_filter
from ddagr_gym.errors import InputError, InputWarning, unknown_name
from ddagr_gym.parameters import Imu, Numerics, Robot, Sensors, Soil
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.slope import Slope
from ddagr_gym.physics.soil_draws import SoilDistribution, draw_soil, get_distribution, soil_field
from ddagr_gym.physics.terrain import SoilField
from ddagr_gym.presets import ddagr
from ddagr_gym.validated import Validated, bounded

_LARGEST_SPEED = OBSERVATION_LIMIT * next(scale for name, _, scale in OBSERVATION if name == "target_speed")


@dataclass(frozen=True)
class Randomisation(Validated):
    """What differs from episode to episode besides the soil. Standard deviations unless said otherwise.

    Attributes:
        mass: relative [-]; tank, battery and fruit.
        yaw_inertia: relative [-]; the thesis states 100 kg m^2 without a source.
        motor_rate: relative [-]; the thesis has 4.5 1/s and, retuned, 1.4 1/s.
        command_delay: largest dead time [s], drawn uniformly from 0.
        gyro_bias: [rad/s]; what a still calibration of the MPU 6050 leaves over a morning.
        accelerometer_bias: per axis [m/s^2]; datasheet zero-g tolerance 50 mg, of which calibration leaves a tenth.
        lateral_offset: of the start [m].
        heading_offset: of the start [rad].
        soil_variation: of soil strength along the drive, relative [-]; 0 for one soil everywhere.
        correlation_length: of that variation [m].
        slope: largest inclination of the ground [rad], drawn uniformly from 0, rising towards any direction.
    """

    mass: float = bounded("-", 0.0, 0.3, default=0.03)
    yaw_inertia: float = bounded("-", 0.0, 0.3, default=0.10)
    motor_rate: float = bounded("-", 0.0, 0.3, default=0.05)
    command_delay: float = bounded("s", 0.0, 0.4, default=0.04)
    gyro_bias: float = bounded("rad/s", 0.0, 0.5, default=2e-3)
    accelerometer_bias: float = bounded("m/s^2", 0.0, 5.0, default=0.05)
    lateral_offset: float = bounded("m", 0.0, 0.3, default=0.01)
    heading_offset: float = bounded("rad", 0.0, 0.3, default=0.01)
    soil_variation: float = bounded("-", 0.0, 0.5, default=0.05)
    correlation_length: float = bounded("m", 0.05, 100.0, default=0.5)
    slope: float = bounded("rad", 0.0, 0.3, default=0.0)

    @classmethod
    def none(cls) -> Randomisation:
        """Every episode alike."""
        zeros = {item.name: 0.0 for item in fields(cls) if item.name != "correlation_length"}
        return cls(**zeros)


@dataclass(frozen=True)
class RewardWeights(Validated):
    """Weights of the reward's named terms, each documented in :mod:`ddagr_gym.envs.turn_kernel`."""

    progress: float = bounded("1/m", 0.0, 1e3, default=2.0)
    cross_track: float = bounded("1/(m s)", 0.0, 1e3, default=4.0)
    curvature: float = bounded("1/s", 0.0, 1e3, default=0.5)
    action_rate: float = bounded("-", 0.0, 1e3, default=0.05)
    slip_power: float = bounded("1/J", 0.0, 1e3, default=1e-3)
    exit_error: float = bounded("-", 0.0, 1e3, default=5.0)
    success: float = bounded("-", 0.0, 1e3, default=10.0)
    failure: float = bounded("-", 0.0, 1e3, default=10.0)
    steering: float = bounded("1/s", 0.0, 1e3, default=0.0)


@dataclass(frozen=True)
class Episode:
    """Everything that one episode needs besides noise; pass one as ``options={"episode": ...}`` to repeat it.

    Attributes:
        turn: the commanded manoeuvre.
        robot: as built, with its true mass and inertia.
        soils: one per wheel, or one for all.
        sensors: with their true biases.
        command_delay: [s].
        lateral_offset: of the start, to the left [m].
        heading_offset: [rad].
        field: soil by place instead of ``soils``.
        rejected_soils: immobilising draws before this one.
        slope: inclination of the ground and direction of steepest ascent [rad].
    """

    turn: RowTurn
    robot: Robot
    soils: Soil | tuple[Soil, ...]
    sensors: Sensors
    command_delay: float = 0.0
    lateral_offset: float = 0.0
    heading_offset: float = 0.0
    field: SoilField | None = None
    rejected_soils: int = 0
    slope: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class TurnSettings(Validated):
    """Settings shared by the single and the batched environment.

    Attributes:
        robot: nominal robot.
        soil: a soil, or a distribution from which each episode draws one.
        radius: R* [m], or (low, high) to draw from.
        side: "left", "right" or "random".
        run_in: straight before the turn [m].
        run_out: straight after it [m].
        speed: reference speed [m/s], or (low, high) to draw from.
        sensors: nominal sensors.
        randomisation: what differs from episode to episode.
        reward: weights.
        effects: missing physics.
        numerics: accuracy.
        ekf_features: append the filter's estimates to the observation.
        filter: makes the features: "flat" takes the ground for level, "inertial" knows slopes, "learned" is that with
            its velocities corrected by a trained network.
        calibrated: robots and grounds of a calibration, drawn instead of ``robot`` and ``soil``.
        path_features: append the inertial filter's pose and its errors on the commanded path as well.
    """

    robot: Robot = field(default_factory=ddagr)
    soil: Soil | SoilDistribution = field(default_factory=lambda: get_distribution("thesis_a1_range"))
    radius: float | tuple[float, float] = 0.80
    side: str = "random"
    run_in: float = bounded("m", 0.0, 5.0, default=0.5)
    run_out: float = bounded("m", 0.05, 5.0, default=0.5)
    speed: float | tuple[float, float] = 0.20
    sensors: Sensors = Sensors()
    randomisation: Randomisation = Randomisation()
    reward: RewardWeights = RewardWeights()
    effects: tuple[Effect, ...] = ()
    numerics: Numerics = Numerics()
    ekf_features: bool = False
    calibrated: CalibratedDraws | None = None
    filter: str = "flat"
    path_features: bool = False

    def _check(self) -> None:
        if self.path_features and self.filter != "inertial":
            raise InputError(
                f"path_features needs the inertial filter's pose and the filter is {self.filter!r}: give "
                'ekf_features=True, filter="inertial" too.'
            )
        if check_filter(self.filter) != "flat" and not self.ekf_features:
            raise InputError(f"the filter is {self.filter!r} and nothing shows it: give ekf_features=True too.")
        if not isinstance(self.side, str) or self.side not in (*SIDES, "random"):
            raise unknown_name("side", self.side, [*SIDES, "random"])
        check_rate(self.sensors)
        self._check_turns()

    def _check_turns(self) -> None:
        """Refuse turns that cannot be made; warn of those that take longer than an episode."""
        radii, speeds = _ends("radius", self.radius), _ends("speed", self.speed)
        for radius in radii:
            for speed in speeds:
                self.turn(radius, "left", speed)
        if radii[1] >= HEADLAND_DEPTH:
            raise InputError(
                f"TurnSettings.radius is {self.radius!r} and the headland is {HEADLAND_DEPTH:g} m deep, so that the "
                "commanded path itself leaves it: give less."
            )
        if speeds[1] > _LARGEST_SPEED:
            raise InputError(
                f"TurnSettings.speed is {self.speed!r} and the observation shows at most {_LARGEST_SPEED:g} m/s: give "
                "at most that."
            )
        # of ranges the middle: that a few of their turns take too long is usual
        middle = self.turn(sum(radii) / 2.0, "left", sum(speeds) / 2.0)
        if middle.duration > EPISODE_DURATION:
            warnings.warn(
                f"a turn of {middle.radius:g} m at {middle.speed:g} m/s takes {middle.duration:.1f} s and an "
                f"episode {EPISODE_DURATION:g} s: give a larger speed, or more max_episode_steps.",
                InputWarning,
                stacklevel=2,
            )

    def turn(self, radius: float, side: str, speed: float) -> RowTurn:
        """The commanded manoeuvre of a radius [m], side and reference speed [m/s]."""
        return RowTurn(radius=radius, side=side, run_in=self.run_in, run_out=self.run_out, speed=speed)

    def draw(self, rng: np.random.Generator) -> Episode:
        """One episode; the same generator state gives the same episode."""
        spread = self.randomisation
        side = ("left", "right")[int(rng.integers(2))] if self.side == "random" else self.side
        radius = _drawn(self.radius, rng)
        robot = self._draw_robot(rng)
        ground = None if self.calibrated is None else self.calibrated.draw_ground(rng)
        soil, rejected = self._draw_soil(rng, robot) if ground is None else (ground.draw(rng), 0)
        turn = self.turn(radius, side, _drawn(self.speed, rng))
        return Episode(
            turn=turn,
            robot=robot,
            soils=soil,
            sensors=self._draw_sensors(rng),
            command_delay=float(rng.uniform(0.0, spread.command_delay)),
            lateral_offset=float(spread.lateral_offset * rng.standard_normal()),
            heading_offset=float(spread.heading_offset * rng.standard_normal()),
            field=self._draw_field(soil, turn, rng),
            rejected_soils=rejected,
            slope=self._draw_slope(rng, ground),
        )

    @property
    def sloping(self) -> bool:
        """Whether the ground of episodes may slope."""
        return self.randomisation.slope > 0.0 or (self.calibrated is not None and self.calibrated.slopes)

    def _draw_slope(self, rng: np.random.Generator, ground: GroundDraws | None) -> tuple[float, float]:
        """Inclination and direction of steepest ascent [rad]; nothing is drawn where all ground is level."""
        most = self.randomisation.slope
        drawn = (float(rng.uniform(0.0, most)), float(rng.uniform(-math.pi, math.pi))) if most else (0.0, 0.0)
        if ground is None or not ground.slopes:
            return drawn
        x, y = np.add(ground.draw_gradient(rng), Slope(*drawn).gradient).tolist()
        sum_of_both = Slope.of_gradient(x, y)
        return sum_of_both.angle, sum_of_both.direction

    def _draw_soil(self, rng: np.random.Generator, robot: Robot) -> tuple[Soil, int]:
        """Soil of an episode, and how many draws before it were rejected."""
        return (self.soil, 0) if isinstance(self.soil, Soil) else draw_soil(self.soil, rng, robot)

    def _draw_robot(self, rng: np.random.Generator) -> Robot:
        spread = self.randomisation
        # truncated at three standard deviations so that nothing changes sign
        mass, inertia, rate = 1.0 + np.array([spread.mass, spread.yaw_inertia, spread.motor_rate]) * np.clip(
            rng.standard_normal(3), -3.0, 3.0
        )
        robot = self.robot if self.calibrated is None else self.calibrated.draw_robot(rng)
        return replace(
            robot,
            mass=float(robot.mass * mass),
            yaw_inertia=float(robot.yaw_inertia * inertia),
            motor_rate=float(robot.motor_rate * rate),
        )

    def _draw_sensors(self, rng: np.random.Generator) -> Sensors:
        spread, imu = self.randomisation, self.sensors.imu
        draws = rng.standard_normal(3)
        biased: Imu = replace(
            imu,
            gyro_bias=float(imu.gyro_bias + spread.gyro_bias * draws[0]),
            accelerometer_bias=(
                float(imu.accelerometer_bias[0] + spread.accelerometer_bias * draws[1]),
                float(imu.accelerometer_bias[1] + spread.accelerometer_bias * draws[2]),
            ),
        )
        return replace(self.sensors, imu=biased)

    def _draw_field(self, soil: Soil, turn: RowTurn, rng: np.random.Generator) -> SoilField | None:
        spread = self.randomisation
        if spread.soil_variation == 0.0:
            return None
        # one extent for all episodes, so that a batch can hold their grids in one array
        radius = float(np.max(self.radius))
        extent = (-max(turn.run_in, turn.run_out) - ROW_MARGIN, radius + 1.0, -2.0 * radius - 0.8, 2.0 * radius + 0.8)
        return soil_field(soil, rng, spread.soil_variation, spread.correlation_length, extent)


def check_rate(sensors: Sensors) -> None:
    """Refuse an IMU whose samples do not make one action in a control period.

    Raises:
        InputError: with the rate that does.
    """
    rate, needed = sensors.imu.sample_rate, CONTROL_INTERVAL / CONTROL_PERIOD
    if not math.isclose(rate, needed, rel_tol=1e-9):
        raise InputError(
            f"the IMU's sample_rate is {rate:g} Hz and a row turn takes {CONTROL_INTERVAL} samples for each action of "
            f"{CONTROL_PERIOD:g} s: give {needed:g} Hz."
        )


def _ends(name: str, value: object) -> tuple[float, float]:
    """Both ends of a number or of (low, high)."""
    ends = value if isinstance(value, tuple | list) else (value, value)
    numbers = [float(end) for end in ends if not isinstance(end, bool) and isinstance(end, Real)]
    if len(ends) != 2 or len(numbers) != 2 or not numbers[0] <= numbers[1]:
        raise InputError(f"TurnSettings.{name} is {value!r}: give one number, or (low, high).")
    return numbers[0], numbers[1]


def _drawn(value: float | tuple[float, float], rng: np.random.Generator) -> float:
    """A number as it is, or one drawn evenly from (low, high)."""
    return float(rng.uniform(*value)) if isinstance(value, tuple | list) else float(value)
