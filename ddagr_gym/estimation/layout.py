"""Names of the entries of the filter's state, of its measurements and of the packed model vector."""

from __future__ import annotations

STATE = (
    "v_x",
    "v_y",
    "yaw_rate",
    "omega_right",
    "omega_left",
    "log_traction_limit",
    "log_traction_rate",
    "log_lateral_stiffness",
    "log_motion_resistance",
    "gyro_bias",
    "accelerometer_bias_x",
    "accelerometer_bias_y",
)
"""Entries of the state, see :mod:`ddagr_gym.estimation` for units."""

STATE_SIZE = 12  # entries of STATE
OMEGA = 3  # right, left
PARAMETER = 5  # ln a1, ln a2, ln b, ln Rc
GYRO_BIAS = 9  # as in STATE
ACCELEROMETER_BIAS = 10  # x, y

PARAMETER_SIZE = 4  # of the force law

MOTION_SIZE = 9
"""Entries 0-8 are those on which forces depend: velocities, bank speeds, parameters."""

CHANNELS = ("specific_force_x", "specific_force_y", "yaw_rate", "encoder_right", "encoder_left")
"""Measured channels, in the order of a measurement vector; names of the columns of a recording."""

COMMANDS = ("command_right", "command_left")
"""Names of the columns of bank speed commands."""

CHANNEL_SIZE = 5  # entries of CHANNELS
FORCE_CHANNEL = 0  # x, y
GYRO_CHANNEL = 2  # of CHANNELS
ENCODER_CHANNEL = 3  # right, left

_next = 0


def _block(size: int = 1) -> int:
    global _next
    first = _next
    _next += size
    return first


# Packed model: one float64 vector that the kernels read
LAW = _block()  # 0 thesis, 1 coupled
MASS = _block()  # [kg]
YAW_INERTIA = _block()  # [kg m^2]
HALF_WHEELBASE = _block()  # [m]
HALF_TRACK = _block()  # [m]
OUTER_RADIUS = _block()  # [m]
MOTOR_RATE = _block()  # [1/s]
MOTOR_RATE_VARIANCE = _block()  # [1/s^2]
UNKNOWN_COMMAND = _block()  # random walk of a bank without known command [rad^2/s^3]
REST_SPEED = _block()  # [m/s]
REVERSAL_SPEED = _block()  # [m/s]
IMU_POSITION = _block(2)  # [m]
MAXIMUM_STEP = _block()  # [s]
GATE = _block()  # standard deviations
EXCITATION = _block()  # slip ratio
EXCITATION_SPEED = _block()  # [m/s]
STANDSTILL_WHEEL_SPEED = _block()  # [rad/s]
STANDSTILL_SPEED = _block()  # [m/s]
STANDSTILL_VARIANCE = _block(3)  # of v_x, v_y [m^2/s^2], yaw rate [rad^2/s^2]
ACCELEROMETER_INTERVAL = _block()  # samples
PROCESS = _block(STATE_SIZE)  # noise densities, unit of the state squared per second
SOIL_COVARIANCE = _block(16)  # of the logs before driving
SOIL_RATE = _block()  # share of it that is added per time [1/s]
MEASUREMENT = _block(CHANNEL_SIZE)  # noise variances
DEWEIGHTING = _block(CHANNEL_SIZE)  # further variance that only the gain sees
LEARNING = _block(CHANNEL_SIZE)  # the same for the gain rows of the parameters
FLOOR = _block(STATE_SIZE)  # least variances
CEILING = _block(STATE_SIZE)  # largest variances
LOW = _block(STATE_SIZE)  # least values of the state
HIGH = _block(STATE_SIZE)  # largest values
MODEL_SIZE = _next

# The kernels' workspace of one robot: one float64 vector, so that the compiler knows what does not overlap. Rows of
# matrices lie STRIDE apart, a multiple of the vector width.
STRIDE = 16
_next = 0
X = _block(STRIDE)  # state
P = _block(STATE_SIZE * STRIDE)  # covariance
FORCE = _block(STRIDE)  # specific force x, y [m/s^2], yaw acceleration [rad/s^2]
GRADIENT = _block(3 * STRIDE)  # their derivatives by the motion entries
RESPONSE = _block(3 * STRIDE)  # velocities gained per constant acceleration over a step [s], 3 x 3
TRANSITION = _block(3 * STRIDE)  # rows of the transition matrix of the velocities
PRODUCT = _block(3 * STRIDE)  # those rows times the covariance
ROW = _block(STRIDE)  # row h of the measurement matrix
COLUMN = _block(STRIDE)  # P h^T
GAIN = _block(STRIDE)  # K
REST = _block(STRIDE)  # what the Joseph form takes off besides K c^T
READING = _block(STRIDE)  # the sample, CHANNEL_SIZE entries
STANDARDISED = _block(STRIDE)  # its standardised innovations, CHANNEL_SIZE entries
WORK_SIZE = _next
