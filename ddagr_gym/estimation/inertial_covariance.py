"""Covariance of the inertial filter, as :mod:`~ddagr_gym.estimation.covariance` has that of the flat one."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.estimation.inertial_layout import (
    ADDED_CEILING,
    ADDED_FLOOR,
    COVARIANCE_ROWS,
    GRAVITY,
    INERTIAL_STATE_SIZE,
    PATCH_AHEAD,
    POSE_CROSS,
    POSE_SIZE,
    Q,
)
from ddagr_gym.estimation.layout import (
    ACCELEROMETER_BIAS,
    CEILING,
    COLUMN,
    FLOOR,
    GAIN,
    OMEGA,
    REST,
    STATE_SIZE,
    STRIDE,
)
from ddagr_gym.jit import kernel

Array = NDArray[np.float64]


@kernel(inline=True)
def _turn_rows(work: Array, first: int, cosine: float, sine: float) -> None:
    """Turn two rows, a vector in body axes, by minus the robot's turn."""
    x, y = Q + STRIDE * first, Q + STRIDE * (first + 1)
    for j in range(STRIDE):
        along, across = work[x + j], work[y + j]
        work[x + j] = cosine * along + sine * across
        work[y + j] = cosine * across - sine * along


@kernel(inline=True)
def _turn_columns(work: Array, first: int, cosine: float, sine: float) -> None:
    for i in range(COVARIANCE_ROWS):
        base = Q + STRIDE * i + first
        along, across = work[base], work[base + 1]
        work[base] = cosine * along + sine * across
        work[base + 1] = cosine * across - sine * along


@kernel(inline=True)
def _accelerate_rows(work: Array, step: float) -> None:
    """Velocities gain what bias and gravity say: v += h (gravity - bias), on rows, then on columns."""
    for axis in range(2):
        row = Q + STRIDE * axis
        pull, bias = Q + STRIDE * (GRAVITY + axis), Q + STRIDE * (ACCELEROMETER_BIAS + axis)
        for j in range(STRIDE):
            work[row + j] += step * (work[pull + j] - work[bias + j])
    for axis in range(2):
        for i in range(COVARIANCE_ROWS):
            base = Q + STRIDE * i
            work[base + axis] += step * (work[base + GRAVITY + axis] - work[base + ACCELEROMETER_BIAS + axis])


@kernel(inline=True)
def _couple_rate(work: Array, first: int, along: float, across: float, step: float) -> None:
    """A vector in body axes also turns by what the yaw rate is wrong: x += h y r, y -= h x r."""
    x, y = Q + STRIDE * first, Q + STRIDE * (first + 1)
    rate = Q + STRIDE * 2
    for j in range(STRIDE):
        work[x + j] += step * across * work[rate + j]
        work[y + j] -= step * along * work[rate + j]
    for i in range(COVARIANCE_ROWS):
        base = Q + STRIDE * i
        work[base + first] += step * across * work[base + 2]
        work[base + first + 1] -= step * along * work[base + 2]


@kernel()
def propagate_inertial(
    work: Array, velocity: tuple[float, float], gravity: tuple[float, float], turn: tuple[float, float],
    decays: tuple[float, float, float], step: float,
) -> None:  # fmt: skip
    """``P <- Phi P Phi^T``, Phi the product of elementary maps, each applied to rows and columns.

    The rows of the pose lie behind those of the state: ``C <- C Phi^T``.

    Args:
        work: workspace; P symmetric before and after.
        velocity: after the step, x and y [m/s].
        gravity: after the step, x and y [m/s^2].
        turn: cosine and sine of the robot's turn over the step.
        decays: diagonal of Phi at the bank speeds, right and left, and at the patch.
        step: h [s].
    """
    _accelerate_rows(work, step)
    cosine, sine = turn
    for first in (0, GRAVITY):
        _turn_rows(work, first, cosine, sine)
        _turn_columns(work, first, cosine, sine)
    _couple_rate(work, 0, velocity[0], velocity[1], step)
    _couple_rate(work, GRAVITY, gravity[0], gravity[1], step)
    for entry, kept in ((OMEGA, decays[0]), (OMEGA + 1, decays[1]), (PATCH_AHEAD, decays[2])):
        for j in range(STRIDE):
            work[Q + STRIDE * entry + j] *= kept
        for i in range(COVARIANCE_ROWS):
            work[Q + STRIDE * i + entry] *= kept


@kernel()
def joseph_update_inertial(work: Array, expected: float, variance: float) -> None:
    """As :func:`~ddagr_gym.estimation.covariance.joseph_update`, on 16 rows."""
    total = expected + variance
    for i in range(STRIDE):
        work[REST + i] = work[COLUMN + i] - work[GAIN + i] * total
    for i in range(0, STRIDE, 4):
        g0, g1, g2, g3 = work[GAIN + i], work[GAIN + i + 1], work[GAIN + i + 2], work[GAIN + i + 3]
        r0, r1, r2, r3 = work[REST + i], work[REST + i + 1], work[REST + i + 2], work[REST + i + 3]
        base = Q + STRIDE * i
        for j in range(STRIDE):
            column, gain = work[COLUMN + j], work[GAIN + j]
            work[base + j] = work[base + j] - g0 * column - r0 * gain
            work[base + STRIDE + j] = work[base + STRIDE + j] - g1 * column - r1 * gain
            work[base + 2 * STRIDE + j] = work[base + 2 * STRIDE + j] - g2 * column - r2 * gain
            work[base + 3 * STRIDE + j] = work[base + 3 * STRIDE + j] - g3 * column - r3 * gain


@kernel(inline=True)
def _bounds(model: Array, i: int) -> tuple[float, float]:
    if i < STATE_SIZE:
        return model[FLOOR + i], model[CEILING + i]
    return model[ADDED_FLOOR + i - STATE_SIZE], model[ADDED_CEILING + i - STATE_SIZE]


@kernel()
def limit_inertial_covariance(model: Array, work: Array) -> None:
    """As :func:`~ddagr_gym.estimation.covariance.limit_covariance`, on the inertial filter's covariance."""
    for i in range(1, INERTIAL_STATE_SIZE):
        for j in range(i):
            work[Q + STRIDE * i + j] = work[Q + STRIDE * j + i]
    for i in range(INERTIAL_STATE_SIZE):
        low, high = _bounds(model, i)
        variance = work[Q + (STRIDE + 1) * i]
        if variance > high:
            factor = math.sqrt(high / variance)
            for j in range(INERTIAL_STATE_SIZE):
                work[Q + STRIDE * i + j] *= factor
                work[Q + STRIDE * j + i] *= factor
            for j in range(POSE_SIZE):
                work[POSE_CROSS + STRIDE * j + i] *= factor
        if variance < low:
            work[Q + (STRIDE + 1) * i] = low
