"""Everything the filter is given: robot, noise, prior knowledge of the soil, limits. Frozen, validated, packable."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.estimation import layout
from ddagr_gym.estimation.force_laws import ForceLaw
from ddagr_gym.parameters import STANDARD_GRAVITY, Robot, Sensors
from ddagr_gym.validated import Validated, bounded

Array = NDArray[np.float64]

_EXCITATION_SPEED = 0.05
"""Wheel speed below which slip counts less as excitation [m/s]: at a launch it is noise."""

_LOG_RANGE = math.log(30.0)
"""Parameters stay within this distance of the prior's median (logs)."""


@dataclass(frozen=True)
class FilterNoise(Validated):
    """Noise of process and instruments; standard deviations, densities per square root of a second.

    Process noise and de-weighting were chosen by simulated turns on random soils around Table A.1 and on the soils of
    configs/soils/field.yaml, for the error of speed and turn radius and for its agreement with its own deviation.

    Attributes:
        acceleration: white acceleration of the body that no wheel force explains [m/s^2/sqrt(Hz)].
        yaw_acceleration: the same for the turn [rad/s^2/sqrt(Hz)].
        bank_speed: random walk of the bank speeds [rad/s/sqrt(s)].
        unknown_command: random walk of a bank whose command is not known, instead [rad/s/sqrt(s)].
        soil: random walk of the logs of the force law's parameters, as a share of the prior's deviations [1/sqrt(s)]:
            soil changes along a drive as it does between fields.
        gyro_bias: random walk [rad/s/sqrt(s)].
        accelerometer_bias: random walk [m/s^2/sqrt(s)].
        accelerometer: of one sample [m/s^2].
        gyro: of one sample [rad/s].
        encoder: of one sample [rad/s].
        accelerometer_deweighting: variance that only the gain sees, over that of a sample
            (see :mod:`~ddagr_gym.estimation.ekf`).
        learning_deweighting: the same for the parameters' rows of the gains of gyro and encoders.
    """

    acceleration: float = bounded("m/s^2/sqrt(Hz)", 0.0, 100.0, default=3e-4)
    yaw_acceleration: float = bounded("rad/s^2/sqrt(Hz)", 0.0, 100.0, default=3e-4)
    bank_speed: float = bounded("rad/s/sqrt(s)", 0.0, 100.0, default=5e-4)
    unknown_command: float = bounded("rad/s/sqrt(s)", 0.0, 100.0, default=0.2)
    soil: float = bounded("1/sqrt(s)", 0.0, 10.0, default=0.05)
    gyro_bias: float = bounded("rad/s/sqrt(s)", 0.0, 1.0, default=1e-6)
    accelerometer_bias: float = bounded("m/s^2/sqrt(s)", 0.0, 10.0, default=1e-5)
    accelerometer: float = bounded("m/s^2", 0.0, 100.0, default=0.031, open_low=True)
    gyro: float = bounded("rad/s", 0.0, 10.0, default=7e-4, open_low=True)
    encoder: float = bounded("rad/s", 0.0, 100.0, default=0.016, open_low=True)
    accelerometer_deweighting: float = bounded("-", 0.0, 1e9, default=1000.0)
    learning_deweighting: float = bounded("-", 0.0, 1e9, default=300.0)

    @classmethod
    def from_sensors(cls, sensors: Sensors, **others: float) -> FilterNoise:
        """Noise of the instruments as specified, quantisation included (a difference of two counts: step^2/6)."""
        imu, encoder = sensors.imu, sensors.encoder
        counts = encoder.counts_per_revolution
        step = 2.0 * math.pi / counts / sensors.period if counts > 0 else 0.0
        readings = {
            "accelerometer": math.hypot(imu.accelerometer_noise, imu.accelerometer_resolution / math.sqrt(12.0)),
            "gyro": math.hypot(imu.gyro_noise, imu.gyro_resolution / math.sqrt(12.0)),
            "encoder": max(math.hypot(encoder.speed_noise, step / math.sqrt(6.0)), 1e-6),
        }
        return cls(**(readings | others))


@dataclass(frozen=True)
class SoilPrior(Validated):
    """What is known of the force law before driving: medians, and standard deviations of the logs.

    Independent in these four ratios, hence correlated in the states. The medians are those of the coupled law fitted to
    wheels on the soils of configs/soils/thesis_a1_range.yaml and field.yaml (``benchmarks/force_laws.py``); the
    deviations are about twice those of the fits, so that soils outside these ranges are not surprising either. The
    coupling is the exception: fits give 1.0 to 1.09 on every soil.

    Attributes:
        traction_limit_over_load: a1 over the wheel load.
        traction_rate: a2.
        coupling: b/(a1 a2), the square of lateral over longitudinal slip that mobilise the same.
        resistance_over_limit: Rc/a1.
        traction_limit_deviation: of ln(a1/load).
        traction_rate_deviation: of ln a2.
        coupling_deviation: of ln(b/(a1 a2)).
        resistance_deviation: of ln(Rc/a1).
    """

    traction_limit_over_load: float = bounded("-", 0.0, 10.0, default=0.42, open_low=True)
    traction_rate: float = bounded("-", 0.0, 1e3, default=5.2, open_low=True)
    coupling: float = bounded("-", 0.0, 1e3, default=1.02, open_low=True)
    resistance_over_limit: float = bounded("-", 0.0, 10.0, default=0.16, open_low=True)
    traction_limit_deviation: float = bounded("-", 0.0, 10.0, default=0.70, open_low=True)
    traction_rate_deviation: float = bounded("-", 0.0, 10.0, default=0.60, open_low=True)
    coupling_deviation: float = bounded("-", 0.0, 10.0, default=0.03, open_low=True)
    resistance_deviation: float = bounded("-", 0.0, 10.0, default=0.70, open_low=True)

    @classmethod
    def of_law(cls, law: ForceLaw) -> SoilPrior:
        """The default prior of a force law; the thesis's law fits the same soils with other parameters."""
        if law is ForceLaw.coupled:
            return cls()
        return cls(
            traction_limit_over_load=0.27,
            traction_rate=5.7,
            coupling=0.29,
            resistance_over_limit=0.05,
            traction_limit_deviation=0.60,
            traction_rate_deviation=0.50,
            coupling_deviation=0.30,
            resistance_deviation=1.00,
        )

    def logs(self, wheel_load: float) -> tuple[Array, Array]:
        """Mean (4,) and covariance (4, 4) of ln a1, ln a2, ln b, ln Rc for a wheel load [N]."""
        limit = math.log(self.traction_limit_over_load * wheel_load)
        rate = math.log(self.traction_rate)
        mean = np.array(
            [limit, rate, limit + rate + math.log(self.coupling), limit + math.log(self.resistance_over_limit)]
        )
        mixing = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [1, 1, 1, 0], [1, 0, 0, 1]])
        deviations = np.array(
            [
                self.traction_limit_deviation,
                self.traction_rate_deviation,
                self.coupling_deviation,
                self.resistance_deviation,
            ]
        )
        return mean, mixing @ np.diag(deviations**2) @ mixing.T


@dataclass(frozen=True)
class FilterModel(Validated):
    """The filter's knowledge and options.

    Attributes:
        robot: mass, inertia, geometry and motor rate; the centre of mass is taken at the body origin.
        law: force law.
        noise: of process and instruments.
        prior: of the soil; :meth:`SoilPrior.of_law` by default.
        sample_period: between samples [s].
        imu_position: lever arm (x, y) from the body origin [m].
        motor_uncertainty: relative, of the motor rate, beyond the robot's own: dead time, droop, load [-].
        rest_speed: smoothing of slip near standstill [m/s].
        reversal_speed: smoothing of the resistance where a wheel's rolling reverses [m/s].
        maximum_step: longest integration step [s].
        gate: standardised innovation beyond which a reading is taken as noisier.
        excitation: difference of the banks' slip ratios above which parameters learn.
        accelerometer_interval: the accelerometer is used at every how-manieth sample.
        gyro_bias_deviation: initial [rad/s].
        accelerometer_bias_deviation: initial [m/s^2].
        velocity_deviation: initial, of v_x and v_y [m/s].
        yaw_rate_deviation: initial [rad/s].
        bank_speed_deviation: initial [rad/s].
        standstill_wheel_speed: commands and bank speeds below it count as rest [rad/s].
        standstill_speed: v_x, v_y below it count as rest [m/s].
    """

    robot: Robot
    law: ForceLaw = ForceLaw.coupled
    noise: FilterNoise = FilterNoise()
    prior: SoilPrior | None = None
    sample_period: float = bounded("s", 0.0, 1.0, default=0.008, open_low=True)
    imu_position: tuple[float, float] = (0.0, 0.0)
    motor_uncertainty: float = bounded("-", 0.0, 10.0, default=0.25)
    rest_speed: float = bounded("m/s", 0.0, 1.0, default=0.005, open_low=True)
    reversal_speed: float = bounded("m/s", 0.0, 1.0, default=0.01, open_low=True)
    maximum_step: float = bounded("s", 0.0, 1.0, default=0.010, open_low=True)
    gate: float = bounded("-", 1.0, 1e6, default=5.0)
    excitation: float = bounded("-", 0.0, 2.0, default=0.05)
    accelerometer_interval: int = 10
    gyro_bias_deviation: float = bounded("rad/s", 0.0, 10.0, default=5e-3)
    accelerometer_bias_deviation: float = bounded("m/s^2", 0.0, 100.0, default=0.05)
    velocity_deviation: float = bounded("m/s", 0.0, 10.0, default=1e-3)
    yaw_rate_deviation: float = bounded("rad/s", 0.0, 10.0, default=1e-3)
    bank_speed_deviation: float = bounded("rad/s", 0.0, 10.0, default=1e-3)
    standstill_wheel_speed: float = bounded("rad/s", 0.0, 10.0, default=5e-3)
    standstill_speed: float = bounded("m/s", 0.0, 1.0, default=5e-3)

    def _check(self) -> None:
        if self.accelerometer_interval < 1:
            raise InputError(f"FilterModel.accelerometer_interval is {self.accelerometer_interval}: give 1 or more.")
        if len(self.imu_position) != 2 or not all(math.isfinite(v) for v in self.imu_position):
            raise InputError(f"FilterModel.imu_position is {self.imu_position!r}: give (x, y) in m.")

    @classmethod
    def of(cls, robot: Robot, sensors: Sensors, **others: Any) -> FilterModel:
        """Model of a robot with the noise, rate and place of its instruments; ``others`` are further fields."""
        readings: dict[str, Any] = {
            "noise": FilterNoise.from_sensors(sensors),
            "sample_period": sensors.period,
            "imu_position": sensors.imu.position,
        }
        return cls(robot, **(readings | others))

    @property
    def outer_radius(self) -> float:
        """Mean outer radius of the wheels [m]."""
        return self.robot.outer_radius

    @property
    def wheel_load(self) -> float:
        """Load of a wheel on the flat [N]."""
        return self.robot.mass * STANDARD_GRAVITY / 4.0

    @property
    def soil_prior(self) -> SoilPrior:
        """The prior, or the default one of the law."""
        return SoilPrior.of_law(self.law) if self.prior is None else self.prior

    def initial(self) -> tuple[Array, Array]:
        """State (12,) at rest and covariance (12, 12) before any sample."""
        state = np.zeros(layout.STATE_SIZE)
        deviations = np.zeros(layout.STATE_SIZE)
        deviations[:5] = [self.velocity_deviation] * 2 + [self.yaw_rate_deviation] + [self.bank_speed_deviation] * 2
        deviations[9:] = [self.gyro_bias_deviation] + [self.accelerometer_bias_deviation] * 2
        covariance = np.diag(np.maximum(deviations**2, self._floors()))
        parameters = slice(layout.PARAMETER, layout.PARAMETER + 4)
        state[parameters], covariance[parameters, parameters] = self.soil_prior.logs(self.wheel_load)
        return state, covariance

    def pack(self) -> Array:
        """The model as the kernels read it, (layout.MODEL_SIZE,)."""
        robot, noise = self.robot, self.noise
        readings = self._reading_variances()
        deviation = robot.standard_deviations.get("motor_rate", 0.0)
        entries: dict[int, Any] = {
            layout.LAW: float(self.law),
            layout.MASS: robot.mass,
            layout.YAW_INERTIA: robot.yaw_inertia,
            layout.HALF_WHEELBASE: robot.half_wheelbase,
            layout.HALF_TRACK: robot.half_track,
            layout.OUTER_RADIUS: self.outer_radius,
            layout.MOTOR_RATE: robot.motor_rate,
            layout.MOTOR_RATE_VARIANCE: deviation**2 + (self.motor_uncertainty * robot.motor_rate) ** 2,
            layout.UNKNOWN_COMMAND: noise.unknown_command**2,
            layout.REST_SPEED: self.rest_speed,
            layout.REVERSAL_SPEED: self.reversal_speed,
            layout.IMU_POSITION: self.imu_position,
            layout.MAXIMUM_STEP: self.maximum_step,
            layout.GATE: self.gate,
            layout.EXCITATION: self.excitation,
            layout.EXCITATION_SPEED: _EXCITATION_SPEED,
            layout.STANDSTILL_WHEEL_SPEED: self.standstill_wheel_speed,
            layout.STANDSTILL_SPEED: self.standstill_speed,
            layout.STANDSTILL_VARIANCE: (1e-6, 1e-6, 1e-8),
            layout.ACCELEROMETER_INTERVAL: float(self.accelerometer_interval),
            layout.PROCESS: self._process_variances(),
            layout.SOIL_COVARIANCE: self.soil_prior.logs(self.wheel_load)[1].ravel(),
            layout.SOIL_RATE: noise.soil**2,
            layout.MEASUREMENT: readings,
            layout.DEWEIGHTING: readings * ([noise.accelerometer_deweighting] * 2 + [0.0] * 3),
            layout.LEARNING: readings * ([noise.accelerometer_deweighting] * 2 + [noise.learning_deweighting] * 3),
            layout.FLOOR: self._floors(),
            layout.CEILING: self._ceilings(),
            layout.LOW: -self._largest_state(),
            layout.HIGH: self._largest_state(),
        }
        packed = np.zeros(layout.MODEL_SIZE)
        for index, value in entries.items():
            values = np.atleast_1d(np.asarray(value, dtype=np.float64))
            packed[index : index + values.size] = values
        mean, _ = self.soil_prior.logs(self.wheel_load)
        packed[layout.LOW + layout.PARAMETER : layout.LOW + layout.PARAMETER + 4] = mean - _LOG_RANGE
        packed[layout.HIGH + layout.PARAMETER : layout.HIGH + layout.PARAMETER + 4] = mean + _LOG_RANGE
        return packed

    def _process_variances(self) -> Array:
        n = self.noise
        densities = [n.acceleration] * 2 + [n.yaw_acceleration] + [n.bank_speed] * 2 + [0.0] * 4
        return np.square([*densities, n.gyro_bias, n.accelerometer_bias, n.accelerometer_bias])

    def _reading_variances(self) -> Array:
        return np.square([self.noise.accelerometer] * 2 + [self.noise.gyro] + [self.noise.encoder] * 2)

    @staticmethod
    def _floors() -> Array:
        return np.square([1e-5] * 3 + [1e-6] * 2 + [1e-4] * 4 + [1e-7] + [1e-6] * 2)

    @staticmethod
    def _ceilings() -> Array:
        return np.square([1.0] * 2 + [1.0] + [10.0] * 2 + [2.0] * 4 + [0.1] + [1.0] * 2)

    def _largest_state(self) -> Array:
        wheel = 4.0 * self.robot.maximum_wheel_speed
        speed = wheel * self.outer_radius
        return np.array([speed, speed, speed / self.robot.half_track, wheel, wheel] + [0.0] * 4 + [0.2, 2.0, 2.0])
