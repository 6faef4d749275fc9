"""Entries of the inertial filter: state, packed model, workspace (theory: filter, section 9)."""

from __future__ import annotations

from ddagr_gym.estimation import layout

INERTIAL_STATE = (*layout.STATE, "gravity_x", "gravity_y", "patch_ahead")
"""Entries of the state: those of :data:`~ddagr_gym.estimation.layout.STATE`, then the pull of gravity along body x
and y [m/s^2] and how far ahead of the hubs the wheels' lateral forces act [m]."""

INERTIAL_STATE_SIZE = len(INERTIAL_STATE)  # 15
GRAVITY = layout.STATE_SIZE  # x, y
PATCH_AHEAD = GRAVITY + 2  # as in INERTIAL_STATE

POSE_SIZE = 3  # x, y [m], yaw [rad]: where the robot is since it was placed; no part of the state, nothing measures it

STRIDE = layout.STRIDE  # of matrices: the sixteenth row and column stay zero
COVARIANCE_ROWS = STRIDE + POSE_SIZE  # of Q and POSE_CROSS together, whose columns are the state's

_next = layout.MODEL_SIZE


def _block(size: int = 1) -> int:
    global _next
    first = _next
    _next += size
    return first


# The packed model goes on after that of the flat filter
BALANCE = _block(3)  # variances of what the force law misses: F_x/m, F_y/m [m^2/s^4], M/I [rad^2/s^4]
BALANCE_LEARNING = _block()  # share of those variances that the gain of the soil's parameters sees besides
BALANCE_INTERVAL = _block()  # samples
LAUNCH_SPEED = _block()  # [m/s]
LAUNCH_SLIP = _block()  # share of the speed
LAUNCH_FLOOR = _block()  # [m/s]
KNOWN_PULL = _block()  # variance of gravity less bias from which on it is known [m^2/s^4]
VIBRATION = _block()  # further noise of the accelerometer per speed of the rims [1/s]
VIBRATION_WEIGHT = _block()  # blocks of readings that it counts for where it is learnt on
LARGEST_ACCELERATION = _block()  # beyond which a reading of the accelerometer is none [m/s^2]
UNKNOWN_ACCELERATION = _block()  # random walk of the velocities without accelerometer [m^2/s^3]
GRAVITY_WALK = _block()  # variance that a second adds to either component [m^2/s^5]
PATCH_MEAN = _block()  # [m]
PATCH_VARIANCE = _block()  # [m^2]
PATCH_RATE = _block()  # 1/time in which it is forgotten [1/s]
ADDED_FLOOR = _block(3)  # least variances of the added entries
ADDED_CEILING = _block(3)  # largest ones
ADDED_LIMIT = _block(3)  # largest sizes of the added entries
MODEL_SIZE = _next

# The workspace too; its own covariance lies behind, that of the flat filter is not used
_next = layout.WORK_SIZE
Q = _block(16 * STRIDE)  # covariance
POSE_CROSS = _block(POSE_SIZE * STRIDE)  # covariances of the pose with the state, right behind it
MEAN_FORCE = _block(2)  # sums of the specific force since the last balance [m/s^2]
SUMMED = _block()  # samples in them
LAST_RATE = _block()  # yaw rate at the last balance [rad/s]
FIRST_DURATION = _block()  # of the samples since the last balance [s]
UNEVEN_DURATION = _block()  # what the later ones of them lasted longer, summed [s]
LEARNS_VIBRATION = _block()  # 1 where it is learnt
VIBRATION_LEARNT = _block()  # [1/s]
BLOCK_SUM = _block()  # of lateral specific force beyond the turning [m/s^2]
BLOCK_COUNT = _block()  # samples in it
BLOCK_MEANS = _block(2)  # of the last block and the one before [m/s^2]
BLOCKS_IN_ROW = _block()  # without a gap
SCATTER = _block()  # sum of variances of a reading [m^2/s^4]
SCATTER_SPEED = _block()  # sum of speeds of the rims [m/s]
SCATTER_WEIGHT = _block()  # variances in them
PULL_KNOWN = _block()  # 1 from when gravity along the robot less the bias is known
KNOWN_PUSH = _block(3)  # what pushes besides the wheels, as far as it is known: F_x/m, F_y/m [m/s^2], M/I [rad/s^2]
POSE = _block(POSE_SIZE)  # x, y, yaw
POSE_OWN = _block(POSE_SIZE * POSE_SIZE)  # their covariance, right behind them
POSE_COLUMN = _block(POSE_SIZE)  # covariances of the pose with a reading
WORK_SIZE = _next
