"""Times between rows: how often they come, and from when on rows are missing, also where they come in bursts.

A logger that takes messages as they arrive stamps what a driver hands over in batches within a moment. The steps inside
a burst then say nothing of the sensor's period, and those between bursts are no gaps.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

GAP_IN_PERIODS = 1.8
"""Time between rows, in median periods, above which a segment ends (ours: one lost sample makes it 2)."""
UPPER = 0.95
"""Quantile of the steps that is one between bursts (ours): of up to 19 rows."""
LONGEST_BETWEEN_BURSTS = 0.25
"""Time between bursts beyond which it is a silence [s] (ours): drivers hand over several times a second."""
INSIDE_BURSTS = 0.1
"""Share of the time inside bursts from which these are stretches of a drive with gaps in between [-] (ours)."""
FEWEST_STEPS = 20
"""Steps below which no bursts are told (ours)."""


def uneven(steps: Array) -> bool:
    """Whether more than one in twenty of the times between rows (n,) would be a gap by their median."""
    return steps.size >= FEWEST_STEPS and bool(np.quantile(steps, UPPER) > GAP_IN_PERIODS * np.median(steps))


def in_bursts(steps: Array) -> bool:
    """Whether rows come in bursts: hardly any time passes inside them, and little between them.

    Args:
        steps: times between rows (n,) [s].
    """
    if not uneven(steps):
        return False
    inside, upper = steps <= GAP_IN_PERIODS * np.median(steps), float(np.quantile(steps, UPPER))
    between = steps[~inside & (steps <= GAP_IN_PERIODS * upper)]
    within = float(np.sum(steps[inside]))
    return upper <= LONGEST_BETWEEN_BURSTS and within < INSIDE_BURSTS * (within + float(np.sum(between)))


def row_period(steps: Array) -> float:
    """Time from row to row [s]: the median of the steps (n,), in bursts the mean; NaN without steps."""
    if not steps.size:
        return math.nan
    return float(np.mean(steps) if in_bursts(steps) else np.median(steps))


def longest_period(steps: Array) -> float:
    """Longest usual time without rows [s], by which gaps are told: the steps' median (n,), or that between bursts.

    NaN without steps.
    """
    if not steps.size:
        return math.nan
    return float(np.quantile(steps, UPPER) if in_bursts(steps) else np.median(steps))
