"""Pose of the inertial filter, in place on its workspace (theory: filter, section 9, eq. (13a)).

Nothing measures the pose, so that all other states are what they are without it. It is corrected through its
covariances with them: a reading that tells how wrong a velocity, a bias or the soil has been moves where that led to.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.estimation.inertial_layout import (
    INERTIAL_STATE_SIZE,
    POSE,
    POSE_COLUMN,
    POSE_CROSS,
    POSE_OWN,
    POSE_SIZE,
    Q,
)
from ddagr_gym.estimation.layout import COLUMN, ROW, STRIDE, X
from ddagr_gym.jit import kernel

Array = NDArray[np.float64]


@kernel(inline=True)
def _leads_to(work: Array, row: int, cosine: float, sine: float) -> tuple[float, float, float]:
    """Velocities at the start of a row, along x and y of the world and about z."""
    return cosine * work[row] - sine * work[row + 1], sine * work[row] + cosine * work[row + 1], work[row + 2]


@kernel(inline=True)
def _swing(work: Array, first: int, length: int, x: float, y: float) -> None:
    """Rows of place and heading, from ``first`` on: a place that was reached by (x, y) [m] turns by the heading."""
    for j in range(length):
        turned = work[first + 2 * length + j]
        work[first + j] -= y * turned
        work[first + length + j] += x * turned


@kernel(inline=True)
def _swing_columns(work: Array, x: float, y: float) -> None:
    for i in range(POSE_SIZE):
        row = POSE_OWN + POSE_SIZE * i
        work[row] -= y * work[row + 2]
        work[row + 1] += x * work[row + 2]


@kernel(inline=True)
def _lead_covariance(work: Array, cosine: float, sine: float, step: float) -> None:
    """The pose's covariances gain those of the velocities over a step."""
    for i in range(POSE_SIZE):
        gained = _leads_to(work, POSE_CROSS + STRIDE * i, cosine, sine)
        for j in range(POSE_SIZE):
            work[POSE_OWN + POSE_SIZE * i + j] += step * gained[j]
    for j in range(STRIDE):
        v_x, v_y, turn = work[Q + j], work[Q + STRIDE + j], work[Q + 2 * STRIDE + j]
        work[POSE_CROSS + j] += step * (cosine * v_x - sine * v_y)
        work[POSE_CROSS + STRIDE + j] += step * (sine * v_x + cosine * v_y)
        work[POSE_CROSS + 2 * STRIDE + j] += step * turn
    for i in range(POSE_SIZE):
        gained = _leads_to(work, POSE_CROSS + STRIDE * i, cosine, sine)
        for j in range(POSE_SIZE):
            work[POSE_OWN + POSE_SIZE * j + i] += step * gained[j]


@kernel()
def advance_pose(work: Array, before: tuple[float, float, float], step: float) -> None:
    """Pose by the trapezoidal rule, and its covariances, after those of the state have been propagated.

    Args:
        work: workspace with the state after the step.
        before: v_x, v_y [m/s] and yaw rate [rad/s] before the step.
        step: h [s].
    """
    turned = 0.5 * step * (before[2] + work[X + 2])
    v_x, v_y = 0.5 * (before[0] + work[X]), 0.5 * (before[1] + work[X + 1])
    middle = work[POSE + 2] + 0.5 * turned
    cosine, sine = math.cos(middle), math.sin(middle)
    x, y = step * (cosine * v_x - sine * v_y), step * (sine * v_x + cosine * v_y)
    work[POSE] += x
    work[POSE + 1] += y
    work[POSE + 2] += turned
    _swing(work, POSE_CROSS, STRIDE, x, y)
    _swing(work, POSE_OWN, POSE_SIZE, x, y)
    _swing_columns(work, x, y)
    _lead_covariance(work, cosine, sine, step)


@kernel()
def add_pose_noise(work: Array, acceleration: float, turn: float, step: float) -> None:
    """Noise that velocities gain over a step moves the pose by half of the step.

    Without it the heading would follow the gyro half a sample late, by 1 mrad at the entry of a turn.

    Args:
        work: workspace.
        acceleration: variance that v_x and v_y gain [m^2/s^2].
        turn: that the yaw rate gains [rad^2/s^2].
        step: h [s].
    """
    half = 0.5 * step
    cosine, sine = math.cos(work[POSE + 2]), math.sin(work[POSE + 2])
    work[POSE_CROSS] += half * acceleration * cosine
    work[POSE_CROSS + 1] -= half * acceleration * sine
    work[POSE_CROSS + STRIDE] += half * acceleration * sine
    work[POSE_CROSS + STRIDE + 1] += half * acceleration * cosine
    work[POSE_CROSS + 2 * STRIDE + 2] += half * turn
    work[POSE_OWN] += half * half * acceleration
    work[POSE_OWN + POSE_SIZE + 1] += half * half * acceleration
    work[POSE_OWN + 2 * POSE_SIZE + 2] += half * half * turn


@kernel(inline=True)
def entry_pose_column(work: Array, entry: int) -> None:
    """Write the pose's covariances with one entry of the state to POSE_COLUMN."""
    for i in range(POSE_SIZE):
        work[POSE_COLUMN + i] = work[POSE_CROSS + STRIDE * i + entry]


@kernel(inline=True)
def row_pose_column(work: Array) -> None:
    """The same of the row in ROW."""
    for i in range(POSE_SIZE):
        total = 0.0
        for k in range(INERTIAL_STATE_SIZE):
            total += work[ROW + k] * work[POSE_CROSS + STRIDE * i + k]
        work[POSE_COLUMN + i] = total


@kernel(inline=True)
def correct_pose(work: Array, innovation: float, total: float) -> None:
    """Use one innovation on the pose, with ``P h^T`` in COLUMN and the pose's part of it in POSE_COLUMN.

    The gain is Kalman's also where that of the state is smaller: Joseph's form then comes to C - k (h P).

    Args:
        work: workspace, before the covariance of the state is corrected.
        innovation: reading less what the state says.
        total: its variance.
    """
    for i in range(POSE_SIZE):
        gain = work[POSE_COLUMN + i] / total
        work[POSE + i] += gain * innovation
        for j in range(STRIDE):
            work[POSE_CROSS + STRIDE * i + j] -= gain * work[COLUMN + j]
        for j in range(POSE_SIZE):
            work[POSE_OWN + POSE_SIZE * i + j] -= gain * work[POSE_COLUMN + j]
