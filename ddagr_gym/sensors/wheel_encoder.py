"""Quadrature encoders on the banks: counts differenced at the sample rate."""

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
    OMEGA,
    READING,
    WHEEL_ANGLE,
)


@kernel()
def read_encoders(row: NDArray[np.float64], noise: NDArray[np.float64], period: float) -> None:
    """Write READING[3:5] (right, left) [rad/s]. ``noise``: two standard normal draws; ``period`` [s]."""
    for bank in range(2):
        speed = row[ENCODER_SCALE + bank] * row[OMEGA + bank]
        if row[ENCODER_COUNTS] > 0.0:
            per_radian = row[ENCODER_COUNTS] / (2.0 * math.pi)
            count = math.floor(row[ENCODER_SCALE + bank] * row[WHEEL_ANGLE + bank] * per_radian)
            speed = (count - row[LAST_COUNT + bank]) / (per_radian * period)
            row[LAST_COUNT + bank] = count
        row[READING + 3 + bank] = speed + row[ENCODER_NOISE] * noise[bank]
