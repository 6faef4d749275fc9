"""Position and heading receiver, slower than the other sensors."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import kernel
from ddagr_gym.physics.layout import (
    NEXT_POSE_TIME,
    POSE_PERIOD,
    POSE_POSITION_NOISE,
    POSE_YAW_NOISE,
    READING,
    TIME,
    YAW,
    X,
    Y,
)

_CLOCK_SLACK = 1e-9  # [s], ours: rounding of summed sample periods must not put a fix off by a sample


@kernel()
def read_pose(row: NDArray[np.float64], noise: NDArray[np.float64]) -> None:
    """Write READING[5:8] (x, y [m], yaw [rad]), NaN where there is no new fix. ``noise``: three normal draws."""
    if row[POSE_PERIOD] <= 0.0 or row[TIME] < row[NEXT_POSE_TIME] - _CLOCK_SLACK:
        row[READING + 5] = math.nan
        row[READING + 6] = math.nan
        row[READING + 7] = math.nan
        return
    row[NEXT_POSE_TIME] += row[POSE_PERIOD]
    row[READING + 5] = row[X] + row[POSE_POSITION_NOISE] * noise[0]
    row[READING + 6] = row[Y] + row[POSE_POSITION_NOISE] * noise[1]
    row[READING + 7] = row[YAW] + row[POSE_YAW_NOISE] * noise[2]
