"""What the instruments should read in a given state.

- Accelerometer: specific force. With the centre of mass at the body origin that is F/m, the sum of the wheel forces and
  nothing else: no derivative of the body velocity (5.5), no gravity term, which the wheels carry (6.3); plus the lever
  arm r, ``(-yawacc r_y - yawrate^2 r_x, yawacc r_x - yawrate^2 r_y)``, and a bias.
- Gyro: yaw rate plus bias.
- Encoders: bank speeds.

``h`` is the derivative of a reading by the state; for gyro and encoders it consists of zeros and ones.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.estimation.layout import (
    ACCELEROMETER_BIAS,
    COLUMN,
    FORCE,
    GRADIENT,
    GYRO_BIAS,
    IMU_POSITION,
    MOTION_SIZE,
    ROW,
    STATE_SIZE,
    STRIDE,
    P,
    X,
)
from ddagr_gym.jit import kernel

Array = NDArray[np.float64]


@kernel()
def specific_force(model: Array, work: Array, axis: int) -> float:
    """Accelerometer reading along one axis [m/s^2]; leaves its derivative h in ROW.

    Args:
        model: packed model.
        work: workspace after :func:`process_model.body_forces` at its state.
        axis: 0 for x, 1 for y.
    """
    along, across = model[IMU_POSITION + axis], model[IMU_POSITION + 1 - axis]
    lever = -across if axis == 0 else across
    turn = work[X + 2]
    for j in range(MOTION_SIZE):
        work[ROW + j] = work[GRADIENT + STRIDE * axis + j] + lever * work[GRADIENT + 2 * STRIDE + j]
    for j in range(MOTION_SIZE, STATE_SIZE):
        work[ROW + j] = 0.0
    work[ROW + 2] -= 2.0 * turn * along
    work[ROW + ACCELEROMETER_BIAS + axis] = 1.0
    turning = lever * work[FORCE + 2] - turn * turn * along
    return work[FORCE + axis] + turning + work[X + ACCELEROMETER_BIAS + axis]


@kernel(inline=True)
def gyro_column(work: Array) -> float:
    """Write ``P h^T`` of the gyro to COLUMN; returns ``h P h^T``. Its prediction is yaw rate plus bias."""
    for i in range(STATE_SIZE):
        work[COLUMN + i] = work[P + 2 * STRIDE + i] + work[P + GYRO_BIAS * STRIDE + i]
    return work[COLUMN + 2] + work[COLUMN + GYRO_BIAS]


@kernel(inline=True)
def entry_column(work: Array, entry: int) -> float:
    """Write ``P h^T`` of a direct reading of one state entry to COLUMN; returns ``h P h^T``."""
    for i in range(STATE_SIZE):
        work[COLUMN + i] = work[P + entry * STRIDE + i]
    return work[COLUMN + entry]


@kernel(inline=True)
def row_column(work: Array) -> float:
    """Write ``P h^T`` of the row in ROW to COLUMN; returns ``h P h^T``."""
    for i in range(STATE_SIZE):
        work[COLUMN + i] = 0.0
    for k in range(STATE_SIZE):
        weight = work[ROW + k]
        for i in range(STATE_SIZE):
            work[COLUMN + i] += weight * work[P + STRIDE * k + i]
    expected = 0.0
    for i in range(STATE_SIZE):
        expected += work[ROW + i] * work[COLUMN + i]
    return expected
