"""Units that headings and gyro tell together: what the gyro integrates to is what the heading changes by."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

APART = 0.5
"""Least time between two headings that are compared [s] (ours): a robot turns far less than a round meanwhile."""
TURNS = (0.05, 1.0)
"""Turn between them by the gyro that is compared [rad] (ours): above the scatter of headings, below half a round."""
FEWEST = 10
"""Pairs of headings below which nothing is said (ours)."""
MOST_OFF = 1.5
"""Ratio of both by which a unit may be missed [-] (ours): a poor gyro's scale, far from any factor between units."""


def times_gyro(t: Array, heading: Array, yaw_rate: Array, spans: Iterable[slice]) -> float:
    """Median change of the heading over that of the integrated gyro, without signs [-].

    Args:
        t: (n,) [s].
        heading: (n,), NaN where there is none, in any unit.
        yaw_rate: (n,), likewise [rad/s].
        spans: rows with one clock and one pose frame.

    Returns:
        NaN where too few turns are known to both.
    """
    ratios = np.concatenate([np.empty(0), *(_ratios(t[span], heading[span], yaw_rate[span]) for span in spans)])
    return float(np.median(ratios)) if ratios.size >= FEWEST else np.nan


def near(ratio: float, expected: float) -> bool:
    """Whether a ratio is the expected one but for the scale of a gyro; False for NaN."""
    return bool(expected / MOST_OFF < ratio < expected * MOST_OFF)


def _ratios(t: Array, heading: Array, yaw_rate: Array) -> Array:
    """Ratios of one span, of headings so far apart that the robot turned in between."""
    rows, gyro = np.flatnonzero(np.isfinite(heading)), np.isfinite(yaw_rate)
    if rows.size < 2 or np.count_nonzero(gyro) < 2:
        return np.empty(0)
    rows = rows[:: max(1, round(APART / float(np.median(np.diff(t[rows])))))]
    rate, steps = yaw_rate[gyro], np.diff(t[gyro])
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * steps)])
    turned = np.abs(np.diff(np.interp(t[rows], t[gyro], angle)))
    compared = (turned > TURNS[0]) & (turned < TURNS[1])
    return np.asarray(np.abs(np.diff(heading[rows]))[compared] / turned[compared])
