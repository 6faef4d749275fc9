"""What the instruments should read in a given state.

- Accelerometer: specific force. With the centre of mass at the body origin that is F/m, the sum of the wheel forces and
  nothing else: no derivative of the body velocity (5.5), no gravity term, which the wheels carry (6.3); plus the lever
  arm r, ``(-yawacc r_y - yawrate^2 r_x, yawacc r_x - yawrate^2 r_y)``, and a bias.
- Gyro: yaw rate plus bias.
- Encoders: bank speeds.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.estimation.layout import (
    ACCELEROMETER_BIAS,
    FORCE_ROW,
    GRADIENT_ROW,
    IMU_POSITION,
    MOTION_SIZE,
    ROW_ROW,
    STATE_SIZE,
)
from ddagr_gym.jit import kernel

Array = NDArray[np.float64]


@kernel()
def specific_force(model: Array, state: Array, axis: int, scratch: Array) -> float:
    """Predicted accelerometer reading along one axis.

    Args:
        model: packed model.
        state: (STATE_SIZE,).
        axis: 0 for x, 1 for y.
        scratch: holds the result of :func:`process_model.body_forces` at ``state``; afterwards ROW_ROW holds the
            derivative of the reading by the state, (STATE_SIZE,).

    Returns:
        Specific force [m/s^2].
    """
    along, across = model[IMU_POSITION + axis], model[IMU_POSITION + 1 - axis]
    lever = -across if axis == 0 else across
    row = scratch[ROW_ROW]
    for j in range(MOTION_SIZE):
        row[j] = scratch[GRADIENT_ROW + axis, j] + lever * scratch[GRADIENT_ROW + 2, j]
    for j in range(MOTION_SIZE, STATE_SIZE):
        row[j] = 0.0
    row[2] -= 2.0 * state[2] * along
    row[ACCELEROMETER_BIAS + axis] = 1.0
    turning = lever * scratch[FORCE_ROW, 2] - state[2] * state[2] * along
    return scratch[FORCE_ROW, axis] + turning + state[ACCELEROMETER_BIAS + axis]
