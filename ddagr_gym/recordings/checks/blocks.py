"""Intervals for everything that is estimated from a drive: resampling of blocks.

Samples of a drive are correlated, so the interval of an estimate comes from whole blocks drawn with replacement,
never from single samples. With few blocks percentile intervals are too short; they are widened by the ratio of
Student's t to the normal quantile (ours, the usual small-sample correction).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy.special import bdtr, ndtri, stdtrit

from ddagr_gym.recordings.checks.findings import Interval
from ddagr_gym.recordings.checks.silences import heard_spans
from ddagr_gym.recordings.schema import FloatArray, Recording

CONFIDENCE = 0.99
"""Of all intervals of the checks (ours): many are asked of a recording, and at 95 % one in twenty alarms by chance."""
RESAMPLES = 400
"""Ours: two of them lie beyond each end of a 99 % interval."""
FEWEST_BLOCKS = 5
"""Below it resampling says nothing about scatter (ours)."""

Estimator = Callable[[FloatArray], FloatArray]


def cut_blocks(recording: Recording, shortest: float = 3.0, longest: float = 10.0) -> list[slice]:
    """Pieces of the heard spans, long enough to be nearly independent and short enough to be many.

    Args:
        recording: any.
        shortest: [s] no piece is meant to be shorter, except a short span itself.
        longest: [s].
    """
    total = sum(float(recording.t[s.stop - 1] - recording.t[s.start]) for s in heard_spans(recording))
    length = min(max(total / 40.0, shortest), longest)
    pieces: list[slice] = []
    for span in heard_spans(recording):
        duration = float(recording.t[span.stop - 1] - recording.t[span.start])
        count = max(1, round(duration / length))
        edges = np.searchsorted(recording.t[span], recording.t[span.start] + np.linspace(0, duration, count + 1)[1:-1])
        bounds = [span.start, *(span.start + edges).tolist(), span.stop]
        pieces.extend(slice(a, b) for a, b in itertools.pairwise(bounds) if b - a > 2)
    return pieces


def resample(sums: FloatArray, estimator: Estimator, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Estimate from the sum over blocks, and the same from resampled blocks.

    Args:
        sums: additive statistics of each block, (blocks, ...).
        estimator: takes (m, ...) totals and gives (m, k) values.
        rng: of the resampling.

    Returns:
        (k,) estimate and (RESAMPLES, k) resampled estimates.
    """
    blocks = len(sums)
    counts = rng.multinomial(blocks, np.full(blocks, 1.0 / blocks), size=RESAMPLES).astype(np.float64)
    totals = np.tensordot(counts, sums, axes=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return estimator(sums.sum(axis=0, keepdims=True))[0], estimator(totals)


def interval_of(estimate: float, resampled: npt.ArrayLike, blocks: int) -> Interval:
    """99 % percentile interval, widened for few blocks.

    Args:
        estimate: from all blocks.
        resampled: (m,) from resampled blocks; values that are not finite make the interval infinite.
        blocks: number of blocks with information.
    """
    values = np.asarray(resampled, dtype=np.float64)
    values = values[np.isfinite(values)]
    if blocks < 2 or values.size < 0.9 * RESAMPLES or not math.isfinite(estimate):
        return (-math.inf, math.inf)
    tail = (1.0 - CONFIDENCE) / 2
    low, high = np.quantile(values, [tail, 1.0 - tail])
    widen = float(stdtrit(blocks - 1, 1.0 - tail) / ndtri(1.0 - tail)) * math.sqrt(blocks / (blocks - 1))
    return (estimate + widen * min(float(low) - estimate, 0.0), estimate + widen * max(float(high) - estimate, 0.0))


def quantile_interval(values: FloatArray, share: float) -> Interval:
    """99 % interval of a quantile of independent values by their order; infinite where they are too few.

    Args:
        values: (n,), in ascending order.
        share: of the distribution that lies below the quantile.
    """
    # the k-th of them lies above the quantile where fewer than k lie below it
    tail, fewer = (1.0 - CONFIDENCE) / 2, bdtr(np.arange(len(values)), len(values), share)
    ends = np.concatenate([[-math.inf], values, [math.inf]])
    return float(ends[np.searchsorted(fewer, tail, "right")]), float(ends[np.searchsorted(fewer, 1.0 - tail) + 1])


def mean_interval(values: FloatArray) -> tuple[float, Interval]:
    """Mean of independent values with its 99 % Student interval; infinite for fewer than two."""
    values = values[np.isfinite(values)]
    if values.size < 2:
        return (float(values[0]) if values.size else math.nan), (-math.inf, math.inf)
    mean = float(np.mean(values))
    half = (
        float(stdtrit(values.size - 1, (1 + CONFIDENCE) / 2)) * float(np.std(values, ddof=1)) / math.sqrt(values.size)
    )
    return mean, (mean - half, mean + half)
