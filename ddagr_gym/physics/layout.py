"""The simulator's row: one float64 vector per environment that holds all of its state and parameters.

A row is plain data: copying it saves the whole simulator state, and a batch is a matrix. Kernels and effects
name its entries by the constants below; blocks of four are per wheel (1 front right, 2 front left, 3 rear right,
4 rear left), pairs are (right, left). SI units, radians.
"""

from __future__ import annotations

_next = 0


def _block(size: int = 1) -> int:
    """Reserve ``size`` consecutive entries and return the first one's index."""
    global _next
    first = _next
    _next += size
    return first


# What a step of the integrator changes: time and motion
TIME = _block()  # [s]
X = _block()  # body origin, world [m]
Y = _block()
YAW = _block()  # [rad], not wrapped
V_X = _block()  # velocity of the body origin, body axes [m/s]
V_Y = _block()
YAW_RATE = _block()  # [rad/s]
OMEGA = _block(2)  # bank speeds [rad/s]
WHEEL_ANGLE = _block(2)  # bank angles rolled [rad]
INTEGRAL = _block(2)  # integral part of the speed loop [rad/s^2]
INTEGRAL_KNOWN = _block()  # 0 after a reset, until the first sample has settled it
GRAVITY = _block(3)  # gravity in body axes [m/s^2]

# Wheel kinematics and forces of the last evaluation, body axes
LOAD = _block(4)  # normal load [N]
WHEEL_V_X = _block(4)  # hub velocity [m/s]
WHEEL_V_Y = _block(4)
WHEEL_OMEGA = _block(4)  # [rad/s]
SLIP_RATIO = _block(4)
SINKAGE = _block(4)  # [m]
FORCE_X = _block(4)  # soil on wheel [N]
FORCE_Y = _block(4)
FORCE_Z = _block(4)
YAW_MOMENT = _block(4)  # [N m]
AXLE_TORQUE = _block(4)  # soil's moment about the hub's y axis [N m]
BOGGED = _block(4)  # 1 where no sinkage carries the load
EXTRA_FORCE_X = _block(4)  # added by wheel force effects
EXTRA_FORCE_Y = _block(4)
EXTRA_YAW_MOMENT = _block(4)
EXTRA_AXLE_TORQUE = _block(4)
BODY_FORCE = _block(3)  # added by body force effects: F_x, F_y at the body origin, M_z

# Results
ACCELERATION = _block(3)  # d/dt of V_X, V_Y, YAW_RATE
SPECIFIC_FORCE = _block(2)  # non-gravitational force per mass at the body origin [m/s^2]

# The integrator's memory: derivatives of the wheels' wrenches and the motion at which they were taken
DERIVATIVE_SIZE = 20  # per wheel: F_x, F_y, F_z, M_z, torque, each by four things
BY_V_X, BY_V_Y, BY_RIM, BY_SINKAGE = 0, 5, 10, 15  # velocities over the wheel's speed, sinkage [m]
DERIVATIVE = _block(4 * DERIVATIVE_SIZE)
DERIVATIVE_AT = _block(16)  # per wheel: v_x, v_y, rim speed over the wheel's speed, sinkage
DERIVATIVE_VALID = _block()

STEPPED = _next
"""Entries that a step of the integrator may change; those behind are changed once a sample."""

SAMPLE_PERIOD = _block()  # between sensor samples [s]

# Commands and motors
COMMAND = _block(2)  # bank speed commands after the command effects [rad/s]
MOTOR_TARGET = _block(2)  # speed that the motor loop aims at [rad/s]
MOTOR_RATE = _block(2)  # its rate k_omega [1/s]
SET_POINT = _block(2)  # command after the ramp [rad/s]
FILTERED = _block(2)  # set point after the filter, at the end of a sample [rad/s]
DRIVETRAIN = _block(9)  # as the motor effects leave it, in the order of DRIVETRAIN_PARAMETERS
LOAD_CARRIED = _block()  # 1 where the loop carries the ground's load up to the limits of the motor, as a tight one
DYNAMIC_BANKS = _block()  # 1 where any of these differs from that of the ideal loop

# Body, as the load effects leave it
MASS = _block()  # [kg]
YAW_INERTIA = _block()  # about the centre of mass [kg m^2]
CENTRE_OF_MASS = _block(3)  # x, y from the body origin, height above ground [m]
SLOPE = _block(2)  # gradient of the ground, world dz/dx and dz/dy [-]
WHEEL = _block(12)  # minor radius x 4, half width x 4, major radius x 4 [m]

# Body, as built: copied to the entries above at each sample, before the load effects
BASE_BODY = _block(7)  # mass, yaw inertia, centre of mass, slope
BASE_WHEEL = _block(12)
HALF_WHEELBASE = _block()  # [m]
HALF_TRACK = _block()
SIDE_SLIP_LEAD = _block()  # [m]
SINKAGE_TILT = _block()  # share of the tilt by unequal sinkage that the accelerometer feels [-]
BASE_MOTOR_RATE = _block()
BASE_DRIVETRAIN = _block(9)
COMMAND_GAIN = _block(2)  # factors on the commands, right and left [-]
COMMAND_DELAY = _block()  # [s]
COMMAND_DEADBAND = _block()  # [rad/s]
TURNING_LIMIT = _block()  # [rad/s]
MEAN_RAMP = _block()  # [rad/s^2]
TURNING_RAMP = _block()  # [rad/s^2]
COMMAND_RAMP = _block()  # [rad/s^2]
COMMAND_FILTER = _block()  # [s]
MAXIMUM_WHEEL_SPEED = _block()  # [rad/s]

# Ground under each wheel
WHEEL_X = _block(4)  # hub, world [m]
WHEEL_Y = _block(4)
SOIL = _block(36)  # nine parameters x 4, in the order of SOIL_PARAMETERS
BASE_SOIL = _block(36)
FELT_DEPTH = _block(4)  # factor on a wheel's sinkage as the robot's tilt shows it; restored to 1 at each sample
HEAPED = _block(4)  # way to the side per way ahead that has heaped soil up: left by a soil effect to that on wheels
TOWED = _block(2)  # where a load on a rope lies, world [m]: left by a load effect to the body force effect

# Means over a sample, and readings
MEAN_SPECIFIC_FORCE = _block(2)  # over the last sample period, body axes [m/s^2]
MEAN_YAW_ACCELERATION = _block()
READING = _block(8)  # specific force x, y; yaw rate; encoder right, left; pose x, y, yaw

# Sensors
ACCELEROMETER_NOISE = _block()
ACCELEROMETER_VIBRATION = _block()  # noise per speed [1/s]
ACCELEROMETER_BIAS = _block(2)
ACCELEROMETER_SCALE = _block(2)
ACCELEROMETER_RANGE = _block()
ACCELEROMETER_RESOLUTION = _block()
GYRO_NOISE = _block()
GYRO_BIAS = _block()
GYRO_SCALE = _block()
GYRO_RANGE = _block()
GYRO_RESOLUTION = _block()
IMU_POSITION = _block(2)
IMU_MOUNTING_YAW = _block()
ENCODER_COUNTS = _block()  # per revolution
ENCODER_NOISE = _block()
ENCODER_SCALE = _block(2)
LAST_COUNT = _block(2)  # encoder counts at the last sample
POSE_PERIOD = _block()  # [s]; 0 for no receiver
POSE_POSITION_NOISE = _block()
POSE_YAW_NOISE = _block()
NEXT_POSE_TIME = _block()

TARGET_NODES = 128  # every sample of the longest delay at 125 Hz and below
TARGET_RING = _block(2 * TARGET_NODES + 3)  # past set points, see :mod:`ddagr_gym.physics.history`

SIZE = _next
"""Entries of a row."""

DRIVETRAIN_PARAMETERS = (
    "integral_rate",
    "integral_limit",
    "load_compliance",
    "acceleration_limit",
    "no_load_speed",
    "power_limit",
    "limit_imbalance",
    "viscous_rate",
    "coulomb_friction",
)
"""Order of the drivetrain's entries; see :class:`ddagr_gym.parameters.Drivetrain`."""
(
    INTEGRAL_RATE,
    INTEGRAL_LIMIT,
    LOAD_COMPLIANCE,
    ACCELERATION_LIMIT,
    NO_LOAD_SPEED,
    POWER_LIMIT,
    LIMIT_IMBALANCE,
    VISCOUS_RATE,
    COULOMB_FRICTION,
) = range(9)

SOIL_PARAMETERS = (
    "cohesion",
    "friction_tangent",
    "sinkage_exponent",
    "cohesive_modulus",
    "frictional_modulus",
    "shear_modulus",
    "peak_stress_coefficient_0",
    "peak_stress_coefficient_1",
    "exit_angle_ratio",
)
"""Order of the nine soil entries of a wheel; SOIL + 9 * wheel + index. tan(phi), not phi."""
(
    SOIL_COHESION,
    SOIL_FRICTION_TANGENT,
    SOIL_EXPONENT,
    SOIL_COHESIVE_MODULUS,
    SOIL_FRICTIONAL_MODULUS,
    SOIL_SHEAR_MODULUS,
    SOIL_PEAK_0,
    SOIL_PEAK_1,
    SOIL_EXIT_RATIO,
) = range(9)

# Points at which effects act, in the order of a sample
(
    POINT_COMMANDS,
    POINT_SET_POINTS,
    POINT_MOTORS,
    POINT_LOADS,
    POINT_SOIL,
    POINT_WHEEL_FORCES,
    POINT_BODY_FORCES,
    POINT_READINGS,
) = range(8)
POINTS = ("commands", "set_points", "motors", "loads", "soil", "wheel_forces", "body_forces", "readings")

EFFECT_PARAMETERS = 8  # floats per effect and environment
EFFECT_MEMORY = 132  # floats that an effect may keep between samples, zero after a reset

READINGS = (
    "specific_force_x",
    "specific_force_y",
    "yaw_rate",
    "encoder_right",
    "encoder_left",
    "pose_x",
    "pose_y",
    "pose_yaw",
)
NOISE_CHANNELS = len(READINGS)
