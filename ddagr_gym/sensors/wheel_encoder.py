"""Quadrature encoders on the banks: counts differenced at the sample rate, so the mean speed over a sample.

Theory: wheel model, eq. (36).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import kernel
from ddagr_gym.physics.layout import (
    ENCODER_COUNTS,
    ENCODER_NOISE,
    ENCODER_SCALE,
    LAST_COUNT,
    READING,
    WHEEL_ANGLE,
)


@kernel()
def read_encoders(row: NDArray[np.float64], noise: NDArray[np.float64], period: float) -> None:
    """Write READING[3:5] (right, left) [rad/s]. ``noise``: two standard normal draws; ``period`` [s]."""
    ideal = row[ENCODER_COUNTS] <= 0.0
    per_radian = 1.0 if ideal else row[ENCODER_COUNTS] / (2.0 * math.pi)
    for bank in range(2):
        count = row[ENCODER_SCALE + bank] * row[WHEEL_ANGLE + bank] * per_radian
        if not ideal:
            count = math.floor(count)
        speed = (count - row[LAST_COUNT + bank]) / (per_radian * period)
        row[LAST_COUNT + bank] = count
        row[READING + 3 + bank] = speed + row[ENCODER_NOISE] * noise[bank]
