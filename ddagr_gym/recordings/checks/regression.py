"""Least squares whose intervals come from resampled blocks: each block adds its share of the normal equations."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ddagr_gym.recordings.checks.blocks import FEWEST_BLOCKS, cut_blocks, interval_of, resample
from ddagr_gym.recordings.checks.findings import Interval
from ddagr_gym.recordings.checks.signals import near_known
from ddagr_gym.recordings.checks.silences import heard_spans
from ddagr_gym.recordings.schema import BoolArray, FloatArray, Recording


@dataclass(frozen=True)
class Estimate:
    """Estimates from a drive.

    Attributes:
        values: (k,).
        intervals: 99 % interval of each value.
        blocks: number of blocks with information.
    """

    values: FloatArray
    intervals: tuple[Interval, ...]
    blocks: int


def estimate(
    sums: Sequence[FloatArray], estimator: Callable[[FloatArray], FloatArray], rng: np.random.Generator
) -> Estimate | None:
    """Estimates and intervals from additive statistics of blocks.

    Args:
        sums: one array for each block.
        estimator: takes stacked totals (m, ...) and gives (m, k).
        rng: of the resampling.

    Returns:
        None for fewer than five blocks or where the values are not finite.
    """
    if len(sums) < FEWEST_BLOCKS:
        return None
    values, resampled = resample(np.array(sums), estimator, rng)
    if not np.all(np.isfinite(values)):
        return None
    intervals = tuple(interval_of(float(v), resampled[:, i], len(sums)) for i, v in enumerate(values))
    return Estimate(values, intervals, len(sums))


def normal_equations(design: FloatArray, target: FloatArray) -> FloatArray:
    """Share of one block: (k, k + 1), the matrix and in the last column the right-hand side."""
    return np.concatenate([design.T @ design, (design.T @ target)[:, None]], axis=1)


MOST_INFLATION = 30.0
"""Variance inflation beyond which coefficients say nothing: Belsley, Kuh & Welsch, Regression Diagnostics (1980). Real
drives have 1 to 13; with turns to one side of one radius it is 60 and more."""


def inflation(sums: Sequence[FloatArray], constant: int) -> FloatArray:
    """Variance inflation of each coefficient but the constant's (k - 1,): 1 where no regressor repeats another [-].

    Noise in a regressor that others repeat makes its coefficient too small and theirs too large.

    Args:
        sums: of blocks, normal equations (k, k + 1) or wider.
        constant: number of the regressor that is 1 throughout.
    """
    total = np.sum(sums, axis=0)
    matrix = total[:, : len(total)]
    others = [k for k in range(len(matrix)) if k != constant]
    mean = matrix[others, constant] / matrix[constant, constant]
    centred = matrix[np.ix_(others, others)] - matrix[constant, constant] * np.outer(mean, mean)
    power = np.diag(centred)
    if np.any(power <= 0):
        return np.full(len(others), np.inf)
    correlation = centred / np.sqrt(np.outer(power, power))
    if np.linalg.cond(correlation) > 1e12:
        return np.full(len(others), np.inf)
    return np.asarray(np.diag(np.linalg.inv(correlation)))


def solve(totals: FloatArray) -> FloatArray:
    """Coefficients (m, k) of stacked normal equations (m, k, k + 1); NaN where they are singular."""
    matrix, right = totals[:, :, :-1], totals[:, :, -1]
    out = np.full(right.shape, np.nan)
    finite = np.all(np.isfinite(totals), axis=(1, 2))
    scale = np.sqrt(np.abs(np.einsum("mii->mi", matrix)))
    finite &= np.all(scale > 0, axis=1)
    scaled = matrix[finite] / scale[finite][:, :, None] / scale[finite][:, None, :]
    sound = np.zeros(len(totals), dtype=bool)
    sound[finite] = np.linalg.cond(scaled) < 1e10
    out[sound] = np.linalg.solve(matrix[sound], right[sound][:, :, None])[:, :, 0]
    return out


def blocks_in_spans(recording: Recording) -> Iterator[tuple[slice, slice]]:
    """Every block with the heard span that it belongs to."""
    spans = list(heard_spans(recording))
    for block in cut_blocks(recording):
        yield next(s for s in spans if s.start <= block.start < s.stop), block


def inside(recording: Recording, span: slice, at: FloatArray) -> BoolArray:
    """Which of the times lie in a span."""
    return np.asarray((at >= recording.t[span.start]) & (at <= recording.t[span.stop - 1]))


def sampled(recording: Recording, span: slice, values: FloatArray, at: FloatArray) -> FloatArray:
    """A channel of one span, interpolated at times inside it; NaN with fewer than two samples, and without a sensor."""
    t, known = recording.t[span], np.isfinite(values[span])
    if np.count_nonzero(known) < 2:
        return np.full(at.shape, np.nan)
    return np.where(near_known(t, known, at), np.interp(at, t[known], values[span][known]), np.nan)
