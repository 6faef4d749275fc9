"""How much the accelerometer shakes with the robot, learnt on the way (theory: filter, eq. (13d)).

A robot that drives shakes, and no data sheet says how much. What the lateral accelerometer reads beyond the turning
scatters from block to block of 80 ms about a straight line through three of them: motion is slower, vibration is not.
Along the robot it is not looked at, since motors jolt it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.estimation.inertial_layout import (
    BLOCK_COUNT,
    BLOCK_MEANS,
    BLOCK_SUM,
    BLOCKS_IN_ROW,
    LAUNCH_SPEED,
    LEARNS_VIBRATION,
    SCATTER,
    SCATTER_SPEED,
    SCATTER_WEIGHT,
    VIBRATION,
    VIBRATION_LEARNT,
    VIBRATION_WEIGHT,
)
from ddagr_gym.estimation.layout import FORCE_CHANNEL, MEASUREMENT, OMEGA, OUTER_RADIUS, READING, X
from ddagr_gym.jit import kernel

Array = NDArray[np.float64]

_BLOCK = 0.08  # time over which readings are averaged [s]: vibration hangs together over some samples
_MEMORY = 10.0  # time in which what was seen is forgotten [s]
_OUTLIER = 2.5  # deviations from which on a block counts as one of so many: jolts are no vibration
_BEYOND = 1.5  # of the deviation that is known, from which on more is believed: motion scatters a little, too
_OF_THREE = 1.5  # variance of the middle one of three blocks about the mean of its neighbours, over that of a block


@kernel(inline=True)
def rim_speed(model: Array, work: Array) -> float:
    """Mean of the sizes of both banks' rim speeds [m/s]."""
    return 0.5 * model[OUTER_RADIUS] * (abs(work[X + OMEGA]) + abs(work[X + OMEGA + 1]))


@kernel(inline=True)
def rim_advance(model: Array, work: Array) -> float:
    """Mean rim speed of both banks, negative backwards [m/s]."""
    return 0.5 * model[OUTER_RADIUS] * (work[X + OMEGA] + work[X + OMEGA + 1])


@kernel(inline=True)
def reading_deviation(model: Array, work: Array, speed: float) -> float:
    """Of either axis of the accelerometer at a speed of the rims [m/s^2] (theory: wheel model, eq. (35))."""
    vibration = max(model[VIBRATION], work[VIBRATION_LEARNT])
    return math.sqrt(model[MEASUREMENT + FORCE_CHANNEL]) + vibration * speed


@kernel()
def watch_vibration(model: Array, work: Array, believed: bool, duration: float) -> None:
    """Learn from the sample in READING.

    Args:
        model: packed model.
        work: workspace, updated.
        believed: whether the accelerometer has a reading.
        duration: since the sample before [s].
    """
    if work[LEARNS_VIBRATION] == 0.0:
        return
    if not believed:
        work[BLOCK_SUM] = work[BLOCK_COUNT] = work[BLOCKS_IN_ROW] = 0.0
        return
    work[BLOCK_SUM] += work[READING + FORCE_CHANNEL + 1] - work[X + 2] * rim_advance(model, work)
    work[BLOCK_COUNT] += 1.0
    if work[BLOCK_COUNT] * duration > _BLOCK - 0.5 * duration:
        _end_block(model, work)


@kernel()
def _end_block(model: Array, work: Array) -> None:
    count = work[BLOCK_COUNT]
    last, before, mean = work[BLOCK_MEANS], work[BLOCK_MEANS + 1], work[BLOCK_SUM] / count
    speed = rim_speed(model, work)
    driving = speed > model[LAUNCH_SPEED]
    if driving and work[BLOCKS_IN_ROW] >= 2.0:
        off = last - 0.5 * (before + mean)
        _count_scatter(model, work, off * off * count / _OF_THREE, speed)
    work[BLOCK_MEANS], work[BLOCK_MEANS + 1] = mean, last
    work[BLOCKS_IN_ROW] = work[BLOCKS_IN_ROW] + 1.0 if driving else 0.0
    work[BLOCK_SUM] = work[BLOCK_COUNT] = 0.0


@kernel()
def _count_scatter(model: Array, work: Array, variance: float, speed: float) -> None:
    """Use one estimate of a reading's variance [m^2/s^4] at a speed of the rims [m/s]."""
    kept = math.exp(-_BLOCK / _MEMORY)
    most = _OUTLIER * reading_deviation(model, work, speed)
    work[SCATTER] = kept * work[SCATTER] + min(variance, most * most)
    work[SCATTER_SPEED] = kept * work[SCATTER_SPEED] + speed
    work[SCATTER_WEIGHT] = kept * work[SCATTER_WEIGHT] + 1.0
    resting = math.sqrt(model[MEASUREMENT + FORCE_CHANNEL])
    usual = work[SCATTER_SPEED] / work[SCATTER_WEIGHT]
    known = resting + model[VIBRATION] * usual
    weight = model[VIBRATION_WEIGHT]
    mean = (weight * known * known + work[SCATTER]) / (weight + work[SCATTER_WEIGHT])
    deviation = math.sqrt(mean)
    work[VIBRATION_LEARNT] = (deviation - resting) / usual if deviation > _BEYOND * known else 0.0
