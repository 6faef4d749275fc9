"""Physical parameters as frozen, validated dataclasses: SI units, radians, a source for each field.

Nothing here computes physics. Named sets of values live in :mod:`ddagr_gym.presets`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields

from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.validated import Validated, bounded, check_number

STANDARD_GRAVITY = 9.80665
"""Standard acceleration of gravity [m/s^2]."""


_DEVIATION = {"unit": "the unit of the field", "low": 0.0, "high": math.inf, "open_low": False}


@dataclass(frozen=True)
class TorusWheel(Validated):
    """Elliptic torus tyre (theory: wheel model, eq. (2); thesis (3.1): a, b, c).

    Attributes:
        minor_radius: semi-axis of the section in the wheel plane [m] (thesis a).
        half_width: semi-axis of the section across the wheel [m] (thesis b).
        major_radius: hub to the section's centre [m] (thesis c).
    """

    minor_radius: float = bounded("m", 0.0, 2.0, open_low=True)
    half_width: float = bounded("m", 0.0, 2.0, open_low=True)
    major_radius: float = bounded("m", 0.0, 5.0, open_low=True)

    def _check(self) -> None:
        # Ours: keeps entry angles below 60 degrees, where the kernel's polynomials are accurate.
        if self.minor_radius > self.major_radius:
            raise InputError(
                f"TorusWheel.minor_radius is {self.minor_radius:g} m, more than major_radius "
                f"{self.major_radius:g} m: split the outer radius so that minor_radius is the smaller part."
            )

    @property
    def outer_radius(self) -> float:
        """Hub to tread [m], R0 = major_radius + minor_radius."""
        return self.major_radius + self.minor_radius


@dataclass(frozen=True)
class Soil(Validated):
    """Bekker-Wong-Janosi soil (theory: wheel model, section 4; thesis Table A.1).

    Attributes:
        cohesion: c [Pa].
        friction_angle: phi [rad].
        sinkage_exponent: n [-].
        cohesive_modulus: k_c [N/m^(n+1)].
        frictional_modulus: k_phi [N/m^(n+2)].
        shear_modulus: K, shear displacement modulus [m].
        peak_stress_coefficient_0: a0 of theta_m = (a0 + a1 slip) theta_f [-] (thesis A.8).
        peak_stress_coefficient_1: a1 of the same [-].
        exit_angle_ratio: -theta_r / theta_f [-] (thesis lambda_theta, A.2).
    """

    cohesion: float = bounded("Pa", 0.0, 1e6)
    friction_angle: float = bounded("rad", 0.0, 1.2)
    sinkage_exponent: float = bounded("-", 0.0, 3.0, open_low=True)
    cohesive_modulus: float = bounded("N/m^(n+1)", -1e9, 1e12)
    frictional_modulus: float = bounded("N/m^(n+2)", -1e9, 1e14)
    shear_modulus: float = bounded("m", 0.0, 1.0, open_low=True)
    peak_stress_coefficient_0: float = bounded("-", 0.0, 1.0)
    peak_stress_coefficient_1: float = bounded("-", -1.0, 1.0)
    exit_angle_ratio: float = bounded("-", 0.0, 1.0)

    def pressure(self, sinkage: float, width: float) -> float:
        """Bekker's plate pressure (k_c/width + k_phi) z^n [Pa] at ``sinkage`` [m] under ``width`` [m]."""
        modulus = self.cohesive_modulus / width + self.frictional_modulus
        return float(modulus * sinkage**self.sinkage_exponent)


@dataclass(frozen=True)
class Drivetrain(Validated):
    """What stands between a bank's speed command and its wheels (theory: drivetrain, section 1).

    With the defaults the bank follows its command by the first-order loop of ``Robot.motor_rate`` alone, whatever the
    ground does: the thesis's motors. A number of 1e6 (1e3 for a speed) stands for no limit.

    Attributes:
        command_delay: dead time between a command and the set point of the loop [s].
        command_deadband: smallest command that moves the bank; smaller ones count as zero [rad/s].
        command_ramp: largest change of each bank's set point per time [rad/s^2].
        command_filter: time constant of a first-order filter that smooths the set point behind the ramp [s].
        integral_rate: k_i, growth of the loop's integral part per speed error [1/s^2].
        integral_limit: largest integral part [rad/s^2].
        load_compliance: 1/J, one over the rotating inertia of a bank seen at its wheels [1/(kg m^2)]: how much a torque
            of the ground speeds it up or slows it down; 0 where the ground has no influence.
        acceleration_limit: largest acceleration that the motor's torque gives the unloaded bank [rad/s^2].
        no_load_speed: at which the torque limit has fallen to zero, in a straight line [rad/s].
        power_limit: largest product of that acceleration and the speed [rad^2/s^3]: power over the bank's inertia.
        limit_imbalance: share by which the right bank's limits are above the mean of both, the left one's below [-].
        viscous_rate: friction of motor and gear per speed [1/s].
        coulomb_friction: friction of motor and gear, as the acceleration that it takes [rad/s^2].
        turning_limit: most by which the commands let a bank differ from the mean of both [rad/s]: the highest yaw rate
            of a drive controller, times half track over wheel radius; the mean stays.
        mean_ramp: largest change per time of the mean of both banks' set points [rad/s^2]: the acceleration that a
            drive controller allows, over the wheel radius.
        turning_ramp: largest change per time of a set point's distance from that mean [rad/s^2]: the yaw acceleration
            that it allows, times half track over wheel radius.
    """

    command_delay: float = bounded("s", 0.0, 1.0, default=0.0)
    command_deadband: float = bounded("rad/s", 0.0, 100.0, default=0.0)
    command_ramp: float = bounded("rad/s^2", 0.0, 1e6, default=1e6, open_low=True)
    command_filter: float = bounded("s", 0.0, 5.0, default=0.0)
    integral_rate: float = bounded("1/s^2", 0.0, 1e4, default=0.0)
    integral_limit: float = bounded("rad/s^2", 0.0, 1e6, default=1e6, open_low=True)
    load_compliance: float = bounded("1/(kg m^2)", 0.0, 1e3, default=0.0)
    acceleration_limit: float = bounded("rad/s^2", 0.0, 1e6, default=1e6, open_low=True)
    no_load_speed: float = bounded("rad/s", 0.0, 1e3, default=1e3, open_low=True)
    power_limit: float = bounded("rad^2/s^3", 0.0, 1e6, default=1e6, open_low=True)
    limit_imbalance: float = bounded("-", -0.9, 0.9, default=0.0)
    viscous_rate: float = bounded("1/s", 0.0, 1e3, default=0.0)
    coulomb_friction: float = bounded("rad/s^2", 0.0, 1e3, default=0.0)
    turning_limit: float = bounded("rad/s", 0.0, 1e3, default=1e3, open_low=True)
    mean_ramp: float = bounded("rad/s^2", 0.0, 1e6, default=1e6, open_low=True)
    turning_ramp: float = bounded("rad/s^2", 0.0, 1e6, default=1e6, open_low=True)


UNCERTAIN = (
    "mass", "yaw_inertia", "half_wheelbase", "half_track", "motor_rate", "maximum_wheel_speed", "half_width",
    "outer_radius",
)  # fmt: skip
"""Fields of a robot and its wheels that may be uncertain; those of its drivetrain may, too."""

_DEVIATIONS = (*UNCERTAIN, *(item.name for item in fields(Drivetrain)))


@dataclass(frozen=True)
class Robot(Validated):
    """Four-wheel skid-steer robot. Wheels 1 front right, 2 front left, 3 rear right, 4 rear left.

    The body origin is the geometric centre of the four wheels (theory: wheel model, section 1).

    Attributes:
        name: identifier.
        mass: total mass [kg].
        yaw_inertia: about the vertical through the centre of mass [kg m^2].
        half_wheelbase: L, centre to axle [m].
        half_track: W, centre to wheel plane [m].
        wheels: one wheel for all four, or four of them in the order above.
        centre_of_mass: (x, y) from the body origin and height above ground [m].
        motor_rate: k_omega of the first-order bank speed loop [1/s] (thesis 4.11).
        maximum_wheel_speed: largest bank speed command that the motors follow [rad/s].
        drivetrain: what else stands between commands and wheels; nothing by default.
        side_slip_lead: how far ahead of its hub, in its direction of travel, a wheel's sideways velocity counts [m]
            (theory: wheel model, eq. (1a)).
        sinkage_tilt: share of the tilt by unequal sinkage of the wheels that the accelerometer feels as gravity: 1 for
            a stiff frame, 0 to leave it out (theory: wheel model, eq. (35a)).
        standard_deviations: uncertainty of fields by name, in their units, of those in :data:`UNCERTAIN` and of the
            drivetrain; absent means taken as exact.
        source: where the values come from.
    """

    name: str
    mass: float = bounded("kg", 0.0, 1e5, open_low=True)
    yaw_inertia: float = bounded("kg m^2", 0.0, 1e6, open_low=True)
    half_wheelbase: float = bounded("m", 0.0, 10.0, open_low=True)
    half_track: float = bounded("m", 0.0, 10.0, open_low=True)
    wheels: tuple[TorusWheel, ...] = ()
    centre_of_mass: tuple[float, float, float] = bounded("m", -100.0, 100.0, default=(0.0, 0.0, 0.5), length=3)
    motor_rate: float = bounded("1/s", 0.0, 1e4, default=4.5, open_low=True)
    maximum_wheel_speed: float = bounded("rad/s", 0.0, 1e3, default=2.0, open_low=True)
    drivetrain: Drivetrain = Drivetrain()
    side_slip_lead: float = bounded("m", -0.5, 0.5, default=0.0)
    sinkage_tilt: float = bounded("-", 0.0, 1.0, default=0.0)
    standard_deviations: Mapping[str, float] = field(default_factory=dict)
    source: str = ""

    def _check(self) -> None:
        if not isinstance(self.wheels, tuple | list) or not all(isinstance(w, TorusWheel) for w in self.wheels):
            raise InputError(f"Robot.wheels is {self.wheels!r}: give a tuple of TorusWheel.")
        if len(self.wheels) == 1:
            object.__setattr__(self, "wheels", tuple(self.wheels) * 4)
        if len(self.wheels) != 4:
            raise InputError(f"Robot.wheels has {len(self.wheels)} wheels: give one wheel for all, or four.")
        for name, deviation in self.standard_deviations.items():
            if name not in _DEVIATIONS:
                raise unknown_name("entry of standard_deviations", name, _DEVIATIONS)
            check_number(f"Robot.standard_deviations[{name!r}]", deviation, _DEVIATION)
        x, y, height = self.centre_of_mass
        if abs(x) >= self.half_wheelbase or abs(y) >= self.half_track or height < 0:
            raise InputError(
                f"Robot.centre_of_mass is {self.centre_of_mass!r}: with it outside the wheels' rectangle "
                f"(+-{self.half_wheelbase:g}, +-{self.half_track:g}) m some wheels leave the ground; move it inside."
            )

    @property
    def outer_radius(self) -> float:
        """Mean outer radius of the wheels, hub to tread [m]."""
        return math.fsum(wheel.outer_radius for wheel in self.wheels) / len(self.wheels)

    @property
    def wheel_x(self) -> tuple[float, float, float, float]:
        """Hub positions forward of the body origin [m]."""
        half = self.half_wheelbase
        return (half, half, -half, -half)

    @property
    def wheel_y(self) -> tuple[float, float, float, float]:
        """Hub positions to the left of the body origin [m]."""
        half = self.half_track
        return (-half, half, -half, half)


@dataclass(frozen=True)
class Imu(Validated):
    """Inertial measurement unit sampled once per sensor period.

    Noise figures are standard deviations of one sample at the sample rate.

    Attributes:
        sample_rate: [Hz] (thesis section 6.2: 125 Hz).
        accelerometer_noise: [m/s^2].
        accelerometer_vibration: further noise per travel speed [(m/s^2)/(m/s)].
        gyro_noise: [rad/s].
        accelerometer_bias: (x, y) [m/s^2].
        gyro_bias: [rad/s].
        accelerometer_scale: (x, y) [-].
        gyro_scale: [-].
        position: lever arm (x, y) from the body origin [m].
        mounting_yaw: rotation of the sensor about z against the body [rad].
        accelerometer_range: saturation [m/s^2].
        gyro_range: saturation [rad/s].
        accelerometer_resolution: quantisation step [m/s^2]; 0 for none.
        gyro_resolution: quantisation step [rad/s]; 0 for none.
    """

    sample_rate: float = bounded("Hz", 0.0, 1e4, default=125.0, open_low=True)
    accelerometer_noise: float = bounded("m/s^2", 0.0, 100.0, default=0.031)
    accelerometer_vibration: float = bounded("1/s", 0.0, 100.0, default=0.0)
    gyro_noise: float = bounded("rad/s", 0.0, 10.0, default=6.9e-4)
    accelerometer_bias: tuple[float, float] = bounded("m/s^2", -100.0, 100.0, default=(0.0, 0.0), length=2)
    gyro_bias: float = bounded("rad/s", -10.0, 10.0, default=0.0)
    accelerometer_scale: tuple[float, float] = bounded("-", -10.0, 10.0, default=(1.0, 1.0), length=2)
    gyro_scale: float = bounded("-", -10.0, 10.0, default=1.0)
    position: tuple[float, float] = bounded("m", -10.0, 10.0, default=(0.0, 0.0), length=2)
    mounting_yaw: float = bounded("rad", -math.pi, math.pi, default=0.0)
    accelerometer_range: float = bounded("m/s^2", 0.0, 1e4, default=2 * STANDARD_GRAVITY, open_low=True)
    gyro_range: float = bounded("rad/s", 0.0, 1e3, default=math.radians(250.0), open_low=True)
    accelerometer_resolution: float = bounded("m/s^2", 0.0, 10.0, default=STANDARD_GRAVITY / 16384)
    gyro_resolution: float = bounded("rad/s", 0.0, 1.0, default=math.radians(1 / 131))


@dataclass(frozen=True)
class WheelEncoder(Validated):
    """Quadrature encoder of a wheel bank: counts differenced at the sensor rate.

    Attributes:
        counts_per_revolution: quadrature counts per turn of the wheel [-]; 0 for an ideal encoder.
        speed_noise: standard deviation of one sample besides quantisation [rad/s].
        scale: (right, left) reading over truth [-].
    """

    counts_per_revolution: float = bounded("-", 0.0, 1e8, default=20000.0)
    speed_noise: float = bounded("rad/s", 0.0, 100.0, default=0.0)
    scale: tuple[float, float] = bounded("-", -10.0, 10.0, default=(1.0, 1.0), length=2)


@dataclass(frozen=True)
class PoseReceiver(Validated):
    """Position and heading receiver; the default noise is that of an RTK GNSS compass.

    Attributes:
        rate: [Hz]; 0 for none fitted.
        position_noise: standard deviation per axis [m].
        yaw_noise: [rad].
    """

    rate: float = bounded("Hz", 0.0, 1e3, default=0.0)
    position_noise: float = bounded("m", 0.0, 100.0, default=0.012)
    yaw_noise: float = bounded("rad", 0.0, 3.2, default=0.008)


@dataclass(frozen=True)
class Sensors:
    """The sensor suite of a robot."""

    imu: Imu = Imu()
    encoder: WheelEncoder = WheelEncoder()
    pose: PoseReceiver = PoseReceiver()

    @property
    def period(self) -> float:
        """Time between samples [s]."""
        return 1.0 / self.imu.sample_rate


@dataclass(frozen=True)
class Numerics(Validated):
    """Accuracy against cost of the simulator. The default keeps nine in ten force errors below 1e-3 of the force.

    That holds over the reference rows (largest 4e-3) and over states of turns on 24 soils (median 1.4e-4). A wheel
    whose sliding velocity changes sign inside the patch at almost no lateral motion reaches 1 to 5 percent (section 5).

    Attributes:
        section_nodes: Gauss nodes across the tyre (psi), a multiple of 8 (the kernel's vector width).
        contact_nodes: Gauss nodes along the contact on each side of the stress peak (theta).
        jacobian_contact_nodes: the same for the derivative that the integrator uses; a W-method
            keeps its order with any derivative, so this one may be coarse.
        substeps: least number of integrator steps per sensor sample.
        maximum_step: longest integrator step [s].
        launch_substeps: steps into which a step is divided at a launch, and where its error estimate is too large.
        launch_change: change of a rim speed within a step, relative to the wheel's speed (at least ``rest_speed``),
            above which it is divided beforehand, as at a start from rest (the damping varies as 1/speed).
        accepted_error: embedded error estimate of a step above which it is redone, divided [m/s]; more at speed,
            twice that at 0.33 m/s.
        force_extrapolation: relative change of a wheel's motion up to which the forces that begin a step are
            extrapolated from the middle of the last one; 0 evaluates them always.
        jacobian_refresh: relative change of a wheel's motion after which its derivative is renewed.
        sinkage_tolerance: |F_z - load| / load above which the sinkage is iterated, not extrapolated.
        minimum_shear_rate: nu_min of theory: wheel model, eq. (14) [rad/s].
        rest_speed: |R0 omega + v_x| below which forward and backward travel are blended [m/s]
            (ours: the stress peak jumps from front to rear there; theory: wheel model, eq. (10)).
    """

    section_nodes: int = 8
    contact_nodes: int = 4
    jacobian_contact_nodes: int = 2
    substeps: int = 1
    maximum_step: float = bounded("s", 0.0, 1.0, default=0.010, open_low=True)
    launch_substeps: int = 4
    launch_change: float = bounded("-", 0.0, 1e9, default=0.5)
    accepted_error: float = bounded("m/s", 0.0, 1e9, default=1e-3)
    force_extrapolation: float = bounded("-", 0.0, 1.0, default=0.03)
    jacobian_refresh: float = bounded("-", 0.0, 1.0, default=0.1)
    sinkage_tolerance: float = bounded("-", 0.0, 0.1, default=8e-3, open_low=True)
    minimum_shear_rate: float = bounded("rad/s", 0.0, 1.0, default=1e-3, open_low=True)
    rest_speed: float = bounded("m/s", 0.0, 0.1, default=1e-3, open_low=True)

    def _check(self) -> None:
        if not isinstance(self.section_nodes, int) or self.section_nodes not in range(8, 65, 8):
            raise InputError(f"Numerics.section_nodes is {self.section_nodes!r}: give 8, 16, 24 ... 64.")
        for name, high in (
            ("contact_nodes", 64),
            ("jacobian_contact_nodes", 64),
            ("substeps", 1000),
            ("launch_substeps", 1000),
        ):
            value = getattr(self, name)
            if not isinstance(value, int) or isinstance(value, bool) or not 1 <= value <= high:
                raise InputError(f"Numerics.{name} is {value!r}: give a whole number from 1 to {high}.")

    @classmethod
    def smooth(cls) -> Numerics:
        """For fits: predictions that vary smoothly with the parameters, also where the robot stops.

        Derivatives are renewed at every step, slowing down is resolved, and friction is a little softer at rest.
        """
        return cls(
            jacobian_refresh=0.0,
            force_extrapolation=0.0,
            launch_change=0.03,
            accepted_error=4e-3,
            minimum_shear_rate=0.02,
            rest_speed=0.01,
        )

    @classmethod
    def finest(cls) -> Numerics:
        """Converged reference: force error below 1e-6, sinkage to 1e-10 of the load."""
        return cls(
            section_nodes=32,
            contact_nodes=32,
            jacobian_contact_nodes=8,
            substeps=8,
            jacobian_refresh=0.0,
            force_extrapolation=0.0,
            sinkage_tolerance=1e-10,
        )
