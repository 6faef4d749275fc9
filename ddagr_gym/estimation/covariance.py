"""Covariance of the filter: propagation, Joseph update, limits. In the workspace, symmetric throughout.

Loops are written so that LLVM vectorises them: several rows per pass, else it unrolls them into scalars.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.estimation.layout import (
    CEILING,
    COLUMN,
    FLOOR,
    GAIN,
    MOTION_SIZE,
    OMEGA,
    PRODUCT,
    REST,
    STATE_SIZE,
    STRIDE,
    TRANSITION,
    P,
)
from ddagr_gym.jit import kernel

Array = NDArray[np.float64]


@kernel(inline=True)
def _transition_times_covariance(work: Array) -> None:
    """Write the three rows of ``Phi P`` of the velocities to PRODUCT; other columns of Phi's rows are zero."""
    for i in range(3):
        row = TRANSITION + STRIDE * i
        t0, t1, t2, t3, t4 = work[row], work[row + 1], work[row + 2], work[row + 3], work[row + 4]
        t5, t6, t7, t8 = work[row + 5], work[row + 6], work[row + 7], work[row + 8]
        base = PRODUCT + STRIDE * i
        for j in range(STATE_SIZE):
            work[base + j] = (
                t0 * work[P + j]
                + t1 * work[P + STRIDE + j]
                + t2 * work[P + 2 * STRIDE + j]
                + t3 * work[P + 3 * STRIDE + j]
                + t4 * work[P + 4 * STRIDE + j]
                + t5 * work[P + 5 * STRIDE + j]
                + t6 * work[P + 6 * STRIDE + j]
                + t7 * work[P + 7 * STRIDE + j]
                + t8 * work[P + 8 * STRIDE + j]
            )


@kernel()
def propagate(work: Array, decay_right: float, decay_left: float) -> None:
    """``P <- Phi P Phi^T`` with the rows of Phi that :func:`~process_model.advance_state` left behind.

    Args:
        work: workspace; P symmetric before and after, PRODUCT overwritten.
        decay_right: diagonal of Phi at the right bank's speed; at parameters and biases it is 1.
        decay_left: at the left bank's.
    """
    _transition_times_covariance(work)
    for j in range(STATE_SIZE):
        work[P + STRIDE * OMEGA + j] *= decay_right
        work[P + STRIDE * (OMEGA + 1) + j] *= decay_left
    for j in range(STATE_SIZE):
        work[P + STRIDE * j + OMEGA] *= decay_right
        work[P + STRIDE * j + OMEGA + 1] *= decay_left
    for i in range(3):
        base = PRODUCT + STRIDE * i
        for j in range(i, 3):
            total = 0.0
            for k in range(MOTION_SIZE):
                total += work[base + k] * work[TRANSITION + STRIDE * j + k]
            work[P + STRIDE * i + j] = total
            work[P + STRIDE * j + i] = total
        work[base + OMEGA] *= decay_right
        work[base + OMEGA + 1] *= decay_left
        for j in range(3, STATE_SIZE):
            work[P + STRIDE * i + j] = work[base + j]
            work[P + STRIDE * j + i] = work[base + j]


@kernel()
def joseph_update(work: Array, expected: float, variance: float) -> None:
    """``P <- (I - K h) P (I - K h)^T + K R K^T`` for one scalar measurement and any gain (theory: filter, eq. (8)).

    Evaluated as the product it is: ``B = P - K c^T`` with ``c = P h^T``, then ``B - (B h^T) K^T + R K K^T``, where
    ``B h^T = c - K (h c)``.

    Args:
        work: workspace with K in GAIN and c in COLUMN; P is updated, symmetric up to rounding.
        expected: h c, the variance that the state's uncertainty gives the measurement.
        variance: R.
    """
    total = expected + variance
    for i in range(STATE_SIZE):
        work[REST + i] = work[COLUMN + i] - work[GAIN + i] * total
    for i in range(0, STATE_SIZE, 4):
        g0, g1, g2, g3 = work[GAIN + i], work[GAIN + i + 1], work[GAIN + i + 2], work[GAIN + i + 3]
        r0, r1, r2, r3 = work[REST + i], work[REST + i + 1], work[REST + i + 2], work[REST + i + 3]
        base = P + STRIDE * i
        for j in range(STATE_SIZE):
            column, gain = work[COLUMN + j], work[GAIN + j]
            work[base + j] = work[base + j] - g0 * column - r0 * gain
            work[base + STRIDE + j] = work[base + STRIDE + j] - g1 * column - r1 * gain
            work[base + 2 * STRIDE + j] = work[base + 2 * STRIDE + j] - g2 * column - r2 * gain
            work[base + 3 * STRIDE + j] = work[base + 3 * STRIDE + j] - g3 * column - r3 * gain


@kernel()
def limit_covariance(model: Array, work: Array) -> None:
    """Make P symmetric to the bit, and hold every variance between its floor and its ceiling.

    A variance above its ceiling shrinks with its row and column, which keeps all correlations; one below its floor is
    raised alone. Both keep a positive definite matrix positive definite.
    """
    for i in range(1, STATE_SIZE):
        for j in range(i):
            work[P + STRIDE * i + j] = work[P + STRIDE * j + i]
    outside = False
    for i in range(STATE_SIZE):
        variance = work[P + (STRIDE + 1) * i]
        outside |= (variance < model[FLOOR + i]) | (variance > model[CEILING + i])
    if outside:
        for i in range(STATE_SIZE):
            _limit_variance(i, model[FLOOR + i], model[CEILING + i], work)


@kernel()
def _limit_variance(i: int, floor: float, ceiling: float, work: Array) -> None:
    variance = work[P + (STRIDE + 1) * i]
    if variance > ceiling:
        factor = math.sqrt(ceiling / variance)
        for j in range(STATE_SIZE):
            work[P + STRIDE * i + j] *= factor
            work[P + STRIDE * j + i] *= factor
    if variance < floor:
        work[P + (STRIDE + 1) * i] = floor
