"""Corrections of the inertial filter by one reading, in place on its workspace (theory: filter, section 9)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.estimation.inertial_covariance import joseph_update_inertial
from ddagr_gym.estimation.inertial_layout import INERTIAL_STATE_SIZE, POSE_COLUMN, POSE_CROSS, POSE_SIZE, Q
from ddagr_gym.estimation.inertial_pose import correct_pose, entry_pose_column, row_pose_column
from ddagr_gym.estimation.layout import (
    COLUMN,
    GAIN,
    GATE,
    GYRO_BIAS,
    PARAMETER,
    PARAMETER_SIZE,
    ROW,
    STRIDE,
    X,
)
from ddagr_gym.jit import kernel

Array = NDArray[np.float64]

_ABSURD = 1e12  # standardised innovations from here on are no readings: their squares would overflow


@kernel()
def use_innovation(
    model: Array, work: Array, innovation: float, expected: float, variance: float, learning: float = 0.0
) -> float:
    """Use one innovation with ``P h^T`` in COLUMN and POSE_COLUMN; gate: :func:`~ddagr_gym.estimation.ekf.update`.

    Args:
        model: packed model.
        work: workspace, updated.
        innovation: reading less what the state says.
        expected: ``h P h^T``.
        variance: of the reading.
        learning: share of that variance that the gain of the soil's parameters sees besides.

    Returns:
        The standardised innovation; NaN for one that is no reading.
    """
    total = max(expected, 0.0) + variance
    standardised = innovation / math.sqrt(total)
    if not abs(standardised) < _ABSURD:
        return math.nan
    excess = abs(standardised) / model[GATE]
    if excess > 1.0:
        variance += total * (excess - 1.0)
        total *= excess
    for i in range(STRIDE):
        work[GAIN + i] = work[COLUMN + i] / total
    slower = total / (total + learning * variance)
    for i in range(PARAMETER, PARAMETER + PARAMETER_SIZE):
        work[GAIN + i] *= slower
    for i in range(INERTIAL_STATE_SIZE):
        work[X + i] += work[GAIN + i] * innovation
    correct_pose(work, innovation, total)
    joseph_update_inertial(work, expected, variance)
    return standardised


@kernel(inline=True)
def entry_column(work: Array, entry: int) -> float:
    """Write ``P h^T`` of one entry of the state to COLUMN and POSE_COLUMN; returns ``h P h^T``."""
    entry_pose_column(work, entry)
    for i in range(STRIDE):
        work[COLUMN + i] = work[Q + entry * STRIDE + i]
    return work[COLUMN + entry]


@kernel(inline=True)
def gyro_column(work: Array) -> float:
    """The same of the gyro, which reads yaw rate and bias."""
    for i in range(STRIDE):
        work[COLUMN + i] = work[Q + 2 * STRIDE + i] + work[Q + GYRO_BIAS * STRIDE + i]
    for i in range(POSE_SIZE):
        row = POSE_CROSS + STRIDE * i
        work[POSE_COLUMN + i] = work[row + 2] + work[row + GYRO_BIAS]
    return work[COLUMN + 2] + work[COLUMN + GYRO_BIAS]


@kernel(inline=True)
def row_column(work: Array) -> float:
    """The same of the row in ROW."""
    row_pose_column(work)
    for i in range(STRIDE):
        work[COLUMN + i] = 0.0
    for k in range(INERTIAL_STATE_SIZE):
        weight = work[ROW + k]
        for i in range(STRIDE):
            work[COLUMN + i] += weight * work[Q + STRIDE * k + i]
    expected = 0.0
    for k in range(INERTIAL_STATE_SIZE):
        expected += work[ROW + k] * work[COLUMN + k]
    return expected
