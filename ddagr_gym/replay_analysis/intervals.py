"""Errors of models over windows, with intervals from resampled clusters of windows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.integer[Any]]

CONFIDENCE = 0.95
"""Of the intervals, as is usual."""
RESAMPLES = 1000
"""Ours: 25 of them lie beyond each end of the interval."""


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


def resampled_counts(clusters: Integers, rng: np.random.Generator) -> Integers | None:
    """How often each window is in each of RESAMPLES bootstrap samples, (RESAMPLES, W).

    Whole clusters are drawn; None for fewer than two of them.

    Args:
        clusters: (W,) windows that are drawn together share a number.
        rng: draws.
    """
    index = np.unique(clusters, return_inverse=True)[1].reshape(-1)
    count = int(index.max()) + 1
    if count < 2:
        return None
    draws = rng.integers(count, size=(RESAMPLES, count))
    drawn = np.bincount((draws + count * np.arange(RESAMPLES)[:, None]).ravel(), minlength=RESAMPLES * count)
    # samples of long drives make tables of a hundred megabytes
    return np.asarray(drawn.reshape(RESAMPLES, count).astype(np.int32)[:, index])


def resampled_rms(errors: Array, counts: Integers) -> Array:
    """Root mean square (RESAMPLES,) of errors (W,) in bootstrap samples (RESAMPLES, W)."""
    return np.asarray(np.sqrt((counts @ errors**2) / counts.sum(axis=1)))


def resampled_median(errors: Array, counts: Integers) -> Array:
    """Median absolute value (RESAMPLES,) of errors (W,) in bootstrap samples (RESAMPLES, W)."""
    order = np.argsort(np.abs(errors))
    sizes, reached = np.abs(errors)[order], np.cumsum(counts[:, order], axis=1, dtype=counts.dtype)
    middle = ((reached[:, -1] - 1) // 2, reached[:, -1] // 2)
    low, high = (
        [np.searchsorted(row, rank, side="right") for row, rank in zip(reached, ranks, strict=True)] for ranks in middle
    )
    return np.asarray(0.5 * (sizes[low] + sizes[high]))


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
    counts = resampled_counts(clusters[known], rng)
    return ErrorStatistics(
        int(values.size),
        rms(values),
        None if counts is None else _interval(resampled_rms(values, counts)),
        median(values),
        None if counts is None else _interval(resampled_median(values, counts)),
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
    counts = resampled_counts(clusters[known], rng)
    return Comparison(
        model,
        baseline,
        rms(ours) / rms(theirs),
        _ratios(resampled_rms, ours, theirs, counts),
        median(ours) / median(theirs),
        _ratios(resampled_median, ours, theirs, counts),
        float(np.mean(np.abs(ours) < np.abs(theirs))),
    )


def _ratios(
    size: Callable[[Array, Integers], Array], ours: Array, theirs: Array, counts: Integers | None
) -> tuple[float, float] | None:
    return None if counts is None else _interval(size(ours, counts) / np.maximum(size(theirs, counts), 1e-300))


def _interval(values: Array) -> tuple[float, float]:
    low, high = np.quantile(values, [(1.0 - CONFIDENCE) / 2.0, (1.0 + CONFIDENCE) / 2.0])
    return float(low), float(high)
