"""Statistics over training seeds and scenarios that do not hide failures or luck.

Scores are matrices (runs, tasks): a run is a training seed (one policy), a task is a scenario; a controller
without training has one run. Failures enter as the worst score, ``inf`` where low is good, never dropped; NaN
is refused. Randomness comes from the generator that is passed in.

Source: R. Agarwal, M. Schwarzer, P. S. Castro, A. Courville, M. G. Bellemare, Deep reinforcement learning at
the edge of the statistical precipice, NeurIPS 2021 (interquartile mean, stratified bootstrap, probability of
improvement, performance profile).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtri

from ddagr_gym.errors import InputError, unknown_name

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Statistic = Callable[[Array], float]
Resampling = Literal["stratified", "crossed"]

RESAMPLING = ("stratified", "crossed")


@dataclass(frozen=True)
class Interval:
    """An estimate with its two-sided confidence interval."""

    estimate: float
    low: float
    high: float
    confidence: float


@dataclass(frozen=True)
class Profile:
    """Performance profile: share of the scores at or below each threshold, with pointwise intervals, arrays (K,)."""

    thresholds: Array
    share: Array
    low: Array
    high: Array
    confidence: float


def score_matrix(scores: ArrayLike, name: str = "scores") -> Array:
    """Scores as (runs, tasks) float64; a vector is one run. InputError for other shapes, no scores, or NaN."""
    matrix = np.atleast_2d(np.asarray(scores, dtype=float))
    if matrix.ndim != 2 or not matrix.size:
        raise InputError(f"{name} has shape {np.shape(scores)}: give a matrix (runs, tasks) with at least one score.")
    if np.isnan(matrix).any():
        raise InputError(f"{name} holds NaN: give failures the worst score (inf where low is good).")
    return matrix


def _check_confidence(confidence: float) -> None:
    if not 0.0 < confidence < 1.0:
        raise InputError(f"confidence is {confidence!r}: give a share between 0 and 1, such as 0.95.")


def interquartile_mean(scores: ArrayLike) -> float:
    """Mean of the scores without the lowest and the highest quarter, floor(n/4) of them each, over all axes."""
    ordered = np.sort(score_matrix(np.ravel(scores)).ravel())
    cut = len(ordered) // 4
    return float(np.mean(ordered[cut : len(ordered) - cut]))


def wilson_interval(successes: float, trials: int, confidence: float = 0.95) -> Interval:
    """Share of successes with Wilson's score interval (E. B. Wilson, JASA 22 (1927) 209-212).

    Args:
        successes: number of successes, 0 to ``trials``; ties may count one half.
        trials: number of trials, at least 1.
        confidence: two-sided level.
    """
    _check_confidence(confidence)
    if trials < 1 or not 0.0 <= successes <= trials:
        raise InputError(f"{successes} successes in {trials} trials: give 0 <= successes <= trials and trials >= 1.")
    z = float(ndtri(0.5 + confidence / 2.0))
    share = successes / trials
    shrink = 1.0 + z * z / trials
    middle = (share + z * z / (2.0 * trials)) / shrink
    half = z / shrink * math.sqrt(share * (1.0 - share) / trials + (z / (2.0 * trials)) ** 2)
    low = 0.0 if successes == 0 else middle - half
    high = 1.0 if successes == trials else middle + half
    return Interval(share, low, high, confidence)


def median_interval(values: ArrayLike, confidence: float = 0.95) -> Interval:
    """Median with the distribution-free interval between two order statistics.

    The k-th smallest of n values lies below the median with a probability that the binomial distribution gives (W. J.
    Conover, Practical Nonparametric Statistics, 3rd ed. 1999, section 3.2); with few values the interval is their range
    and covers less than ``confidence``. Median: the lower of the middle two, so that infinite values make no NaN.

    Args:
        values: independent (n,), n at least 1.
        confidence: two-sided level.
    """
    from scipy.stats import binom

    _check_confidence(confidence)
    ordered = np.sort(score_matrix(np.ravel(values), "values").ravel())
    count = len(ordered)
    below = max(int(binom.ppf((1.0 - confidence) / 2.0, count, 0.5)) - 1, 0)
    return Interval(
        float(ordered[(count - 1) // 2]), float(ordered[below]), float(ordered[count - 1 - below]), confidence
    )


def _draw(shape: tuple[int, int], resampling: Resampling, rng: np.random.Generator) -> tuple[Indices, Indices]:
    """Row and column indices (runs, tasks) of one bootstrap resample of a score matrix."""
    runs, tasks = shape
    if resampling == "stratified":
        return rng.integers(runs, size=shape), np.broadcast_to(np.arange(tasks), shape)
    rows, columns = rng.integers(runs, size=runs), rng.integers(tasks, size=tasks)
    return np.broadcast_to(rows[:, None], shape), np.broadcast_to(columns, shape)


def _check_resampling(shape: tuple[int, int], resampling: str, resamples: int) -> None:
    if resampling not in RESAMPLING:
        raise unknown_name("resampling", resampling, RESAMPLING)
    if resamples < 100:
        raise InputError(f"resamples is {resamples}: give at least 100, better 2000.")
    if shape[0] * shape[1] < 2:
        raise InputError("a single score has no interval: give several runs or tasks.")
    if resampling == "stratified" and shape[0] < 2:
        raise InputError(
            "one run per task leaves the stratified bootstrap nothing to resample: "
            "give several runs, or use resampling='crossed' to resample the tasks."
        )


def _percentiles(samples: Array, confidence: float) -> tuple[Array, Array]:
    """Percentile interval along axis 0; order statistics, so that infinite scores make no NaN."""
    tail = (1.0 - confidence) / 2.0
    low, high = np.quantile(samples, [tail, 1.0 - tail], axis=0, method="inverted_cdf")
    return low, high


def _resampled(
    scores: ArrayLike,
    statistic: Callable[[Array], Any],
    rng: np.random.Generator,
    resampling: Resampling,
    resamples: int,
    confidence: float,
) -> tuple[Any, Any, Any]:
    """A statistic of a score matrix with the ends of its percentile interval."""
    matrix = score_matrix(scores)
    shape = (matrix.shape[0], matrix.shape[1])
    _check_confidence(confidence)
    _check_resampling(shape, resampling, resamples)
    samples = np.array([statistic(matrix[_draw(shape, resampling, rng)]) for _ in range(resamples)])
    return (statistic(matrix), *_percentiles(samples, confidence))


def bootstrap(
    scores: ArrayLike,
    statistic: Statistic,
    rng: np.random.Generator,
    *,
    resampling: Resampling = "stratified",
    resamples: int = 2000,
    confidence: float = 0.95,
) -> Interval:
    """Percentile bootstrap interval of a statistic of a score matrix.

    "stratified" (Agarwal et al. 2021) resamples the runs of every task independently: the tasks are fixed and the
    runs of different tasks are unrelated. Where a run is one policy driven through all scenarios, its scores
    hang together and that interval is too narrow: "crossed" resamples whole runs and whole tasks (A. B. Owen,
    The pigeonhole bootstrap, Annals of Applied Statistics 1 (2007) 386-411), which covers new seeds and new
    scenarios and errs on the wide side.

    Args:
        scores: (runs, tasks).
        statistic: function of a score array, such as :func:`interquartile_mean`.
        rng: source of the resamples.
        resampling: "stratified" or "crossed".
        resamples: number of resamples.
        confidence: two-sided level.
    """
    estimate, low, high = _resampled(scores, statistic, rng, resampling, resamples, confidence)
    return Interval(float(estimate), float(low), float(high), confidence)


def improvement_share(candidate: ArrayLike, baseline: ArrayLike) -> float:
    """Probability that a random run of the candidate scores lower than one of the baseline, averaged over tasks.

    Ties count one half (Mann-Whitney statistic over the number of pairs; theory: control, eq. (12)). Lower is better.

    Args:
        candidate, baseline: (runs, tasks) with equal tasks; the runs may differ.
    """
    first, second = score_matrix(candidate, "candidate"), score_matrix(baseline, "baseline")
    if first.shape[1] != second.shape[1]:
        raise InputError(f"candidate has {first.shape[1]} tasks and baseline {second.shape[1]}: give the same tasks.")
    return float(np.mean(_pair_wins(first, second)))


def _pair_wins(candidate: Array, baseline: Array) -> Array:
    """Result of every pair of runs by task (runs, other runs, tasks): 1 a win of the candidate, 0.5 a tie, 0."""
    first, second = candidate[:, None, :], baseline[None, :, :]
    return np.asarray((first < second) + 0.5 * (first == second))


def probability_of_improvement(
    candidate: ArrayLike,
    baseline: ArrayLike,
    rng: np.random.Generator,
    *,
    resampling: Resampling = "stratified",
    resamples: int = 2000,
    confidence: float = 0.95,
) -> Interval:
    """:func:`improvement_share` with a bootstrap interval; runs of the two are not paired, tasks are.

    Where all resamples agree (every run wins every task) the percentile interval has no width. Wilson's interval
    for as many trials as the smaller side has runs is used then (ours).

    Args:
        candidate, baseline: (runs, tasks), lower is better; a baseline without training has one run.
        rng, resampling, resamples, confidence: as in :func:`bootstrap`.
    """
    first, second = score_matrix(candidate, "candidate"), score_matrix(baseline, "baseline")
    estimate = improvement_share(first, second)
    _check_confidence(confidence)
    _check_resampling((max(len(first), len(second)), first.shape[1]), resampling, resamples)
    wins = _pair_wins(first, second)
    samples = np.array([_resampled_share(wins, resampling, rng) for _ in range(resamples)])
    low, high = _percentiles(samples, confidence)
    if low == high:
        runs = min((n for n in wins.shape[:2] if n > 1), default=1)
        return wilson_interval(estimate * runs, runs, confidence)
    return Interval(estimate, float(low), float(high), confidence)


def _resampled_share(wins: Array, resampling: Resampling, rng: np.random.Generator) -> float:
    """Improvement share of one resample; crossed resampling draws the same tasks for both sides."""
    runs, others, tasks = wins.shape
    if resampling == "crossed":
        rows, opposite = rng.integers(runs, size=(runs, 1, 1)), rng.integers(others, size=(1, others, 1))
        return float(wins[rows, opposite, rng.integers(tasks, size=(1, 1, tasks))].mean())
    rows, opposite = rng.integers(runs, size=(runs, 1, tasks)), rng.integers(others, size=(1, others, tasks))
    return float(wins[rows, opposite, np.arange(tasks)].mean())


def paired_probability_of_improvement(candidate: ArrayLike, baseline: ArrayLike, confidence: float = 0.95) -> Interval:
    """Share of pairs in which the candidate scores lower, ties one half, with Wilson's interval.

    For two controllers on the same scenarios with the same noise seeds. Pairs must be independent of each other:
    one run each. With ties the interval is on the wide side.

    Args:
        candidate, baseline: scores (pairs,), lower is better.
    """
    first, second = score_matrix(candidate, "candidate"), score_matrix(baseline, "baseline")
    if first.shape != second.shape or first.shape[0] != 1:
        raise InputError(f"paired scores have shapes {first.shape} and {second.shape}: give one score per pair each.")
    wins = np.count_nonzero(first < second) + np.count_nonzero(first == second) / 2.0
    return wilson_interval(float(wins), first.size, confidence)


def performance_profile(
    scores: ArrayLike,
    thresholds: ArrayLike,
    rng: np.random.Generator,
    *,
    resampling: Resampling = "stratified",
    resamples: int = 2000,
    confidence: float = 0.95,
) -> Profile:
    """Share of scores at or below each threshold, with pointwise bootstrap intervals; lower is better.

    Args:
        scores: (runs, tasks).
        thresholds: (K,) in the scores' unit.
        rng, resampling, resamples, confidence: as in :func:`bootstrap`.
    """
    levels = np.asarray(thresholds, dtype=float)
    if levels.ndim != 1 or not levels.size or not np.isfinite(levels).all():
        raise InputError(f"thresholds has shape {levels.shape} or values that are not finite: give numbers (K,).")

    def share(sample: Array) -> Array:
        return np.searchsorted(np.sort(sample, axis=None), levels, side="right") / sample.size

    return Profile(levels, *_resampled(scores, share, rng, resampling, resamples, confidence), confidence)
