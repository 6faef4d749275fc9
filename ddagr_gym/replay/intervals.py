"""Errors of models over windows, with intervals from resampled clusters of windows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

CONFIDENCE = 0.95
RESAMPLES = 1000


@dataclass(frozen=True)
class ErrorStatistics:
    """Size of an error over windows.

    Attributes:
        count: windows in which it could be measured.
        rms: root mean square; None without windows, as the others.
        rms_interval: 95 % by resampling clusters of windows; None for fewer than two clusters.
        median: of the absolute value.
        median_interval: the same.
        bias: mean.
    """

    count: int
    rms: float | None
    rms_interval: tuple[float, float] | None
    median: float | None
    median_interval: tuple[float, float] | None
    bias: float | None


@dataclass(frozen=True)
class Comparison:
    """Errors of one model against those of another on the same windows.

    Attributes:
        model: the candidate.
        baseline: the other.
        rms_ratio: candidate's root mean square over the baseline's.
        rms_ratio_interval: 95 %, the same clusters drawn for both.
        median_ratio: the same of the median absolute errors.
        median_ratio_interval: the same.
        share_smaller: share of windows in which the candidate's absolute error is smaller.
    """

    model: str
    baseline: str
    rms_ratio: float
    rms_ratio_interval: tuple[float, float] | None
    median_ratio: float
    median_ratio_interval: tuple[float, float] | None
    share_smaller: float


def resampled_rows(clusters: Integers, rng: np.random.Generator) -> list[Integers]:
    """Rows of RESAMPLES bootstrap samples in which whole clusters are drawn; none for fewer than two clusters."""
    members = [np.flatnonzero(clusters == c) for c in np.unique(clusters)]
    if len(members) < 2:
        return []
    draws = rng.integers(len(members), size=(RESAMPLES, len(members)))
    return [np.concatenate([members[c] for c in draw]) for draw in draws]


def rms(errors: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(errors**2)))


def median(errors: Array) -> float:
    """Median absolute value."""
    return float(np.median(np.abs(errors)))


def error_statistics(errors: Array, clusters: Integers, rng: np.random.Generator) -> ErrorStatistics:
    """Size of the errors (W,), NaN left out; ``clusters`` (W,) are resampled whole."""
    known = np.isfinite(errors)
    values = errors[known]
    if not values.size:
        return ErrorStatistics(0, None, None, None, None, None)
    rows = resampled_rows(clusters[known], rng)
    return ErrorStatistics(
        int(values.size),
        rms(values),
        _interval([rms(values[r]) for r in rows]),
        median(values),
        _interval([median(values[r]) for r in rows]),
        float(values.mean()),
    )


def compare(
    model: str, errors: Array, baseline: str, others: Array, clusters: Integers, rng: np.random.Generator
) -> Comparison | None:
    """Comparison over the windows (W,) in which both errors are known; None where none is or the other is perfect."""
    known = np.isfinite(errors) & np.isfinite(others)
    ours, theirs = errors[known], others[known]
    if not ours.size or rms(theirs) == 0.0 or median(theirs) == 0.0:
        return None
    rows = resampled_rows(clusters[known], rng)
    return Comparison(
        model,
        baseline,
        rms(ours) / rms(theirs),
        _interval([rms(ours[r]) / max(rms(theirs[r]), 1e-300) for r in rows]),
        median(ours) / median(theirs),
        _interval([median(ours[r]) / max(median(theirs[r]), 1e-300) for r in rows]),
        float(np.mean(np.abs(ours) < np.abs(theirs))),
    )


def _interval(values: list[float]) -> tuple[float, float] | None:
    if not values:
        return None
    low, high = np.quantile(values, [(1.0 - CONFIDENCE) / 2.0, (1.0 + CONFIDENCE) / 2.0])
    return float(low), float(high)
