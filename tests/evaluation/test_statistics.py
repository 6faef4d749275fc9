import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from ddagr_gym.errors import InputError
from ddagr_gym.evaluation.statistics import (
    bootstrap,
    improvement_share,
    interquartile_mean,
    median_interval,
    paired_probability_of_improvement,
    performance_profile,
    probability_of_improvement,
    wilson_interval,
)


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=60))
def test_interquartile_mean_is_the_trimmed_mean(scores):
    assert interquartile_mean(scores) == pytest.approx(stats.trim_mean(scores, 0.25), rel=1e-9, abs=1e-6)


def test_interquartile_mean_bears_a_quarter_of_failures():
    assert interquartile_mean([[1.0, 2.0, 3.0, math.inf]]) == 2.5
    assert interquartile_mean([1.0, 2.0, math.inf, math.inf]) == math.inf


@pytest.mark.parametrize(("successes", "trials"), [(0, 10), (3, 10), (10, 10), (180, 200), (1, 1)])
@pytest.mark.parametrize("confidence", [0.9, 0.95])
def test_wilson_interval_against_scipy(successes, trials, confidence):
    interval = wilson_interval(successes, trials, confidence)
    reference = stats.binomtest(successes, trials).proportion_ci(confidence, method="wilson")
    assert (interval.low, interval.high) == pytest.approx((reference.low, reference.high), abs=1e-12)
    assert interval.estimate == successes / trials


@pytest.mark.parametrize("share", [0.5, 0.9, 0.97])
def test_wilson_interval_covers(share):
    """Exact coverage of the 95 % interval at n = 100, summed over the binomial distribution."""
    counts = np.arange(101)
    inside = [wilson_interval(int(k), 100).low <= share <= wilson_interval(int(k), 100).high for k in counts]
    assert 0.93 < float(stats.binom.pmf(counts, 100, share) @ inside) < 0.98


def covered(intervals, truth):
    return np.mean([interval.low <= truth <= interval.high for interval in intervals])


def test_stratified_bootstrap_covers_new_runs_on_fixed_tasks():
    """Independent runs of 12 tasks with their own means: 95 % nominal, Monte Carlo error 1.5 points (2 sigma 3)."""
    rng = np.random.default_rng(0)
    means = rng.normal(0, 2, 12)
    draws = [means + rng.normal(0, 1, (15, 12)) for _ in range(200)]
    intervals = [bootstrap(d, np.mean, rng, resamples=300) for d in draws]
    assert 0.89 <= covered(intervals, means.mean()) <= 0.99


def test_crossed_bootstrap_covers_where_stratified_does_not():
    """A policy's scores share a seed effect; then only resampling whole seeds covers new seeds and scenarios."""
    rng = np.random.default_rng(3)
    draws = [rng.normal(0, 1, (12, 1)) + rng.normal(0, 1, 30) + rng.normal(0, 0.3, (12, 30)) for _ in range(150)]
    crossed = [bootstrap(d, np.mean, rng, resampling="crossed", resamples=300) for d in draws]
    stratified = [bootstrap(d, np.mean, rng, resamples=300) for d in draws]
    assert covered(crossed, 0.0) >= 0.88
    assert covered(stratified, 0.0) < 0.4


def test_bootstrap_width_of_a_mean_is_the_standard_error():
    rng = np.random.default_rng(4)
    scores = rng.normal(0, 1, (400, 1))
    interval = bootstrap(scores, np.mean, rng, resamples=3000)
    expected = 2 * 1.959964 * scores.std() / 20
    assert interval.high - interval.low == pytest.approx(expected, rel=0.06)
    assert interval.estimate == pytest.approx(scores.mean())


def test_bootstrap_with_failures_has_no_nan():
    rng = np.random.default_rng(5)
    scores = np.concatenate([rng.normal(0, 1, 15), np.full(5, math.inf)])[:, None]
    interval = bootstrap(scores, interquartile_mean, rng, resamples=500)
    assert math.isfinite(interval.low)
    assert math.isfinite(interval.estimate)
    assert interval.high == math.inf


def test_same_generator_same_interval():
    scores = np.random.default_rng(6).normal(0, 1, (10, 5))
    first, second = (bootstrap(scores, interquartile_mean, np.random.default_rng(7), resamples=200) for _ in range(2))
    assert first == second


@given(st.lists(st.integers(0, 5), min_size=1, max_size=8), st.lists(st.integers(0, 5), min_size=1, max_size=8))
def test_improvement_share_is_mann_whitney(first, second):
    u = stats.mannwhitneyu(second, first, method="asymptotic").statistic if len({*first, *second}) > 1 else None
    expected = 0.5 if u is None else u / (len(first) * len(second))
    share = improvement_share(np.array(first)[:, None], np.array(second)[:, None])
    assert share == pytest.approx(expected)
    assert improvement_share(np.array(second)[:, None], np.array(first)[:, None]) == pytest.approx(1 - share)


@pytest.mark.parametrize("resampling", ["stratified", "crossed"])
def test_probability_of_improvement_covers_the_normal_shift(resampling):
    """X ~ N(0, 1), Y ~ N(0.5, 1): P(X < Y) = Phi(0.5 / sqrt 2) = 0.638."""
    rng = np.random.default_rng(8)
    draws = [(rng.normal(0, 1, (20, 6)), rng.normal(0.5, 1, (20, 6))) for _ in range(150)]
    intervals = [probability_of_improvement(x, y, rng, resamples=300, resampling=resampling) for x, y in draws]
    assert covered(intervals, stats.norm.cdf(0.5 / math.sqrt(2))) >= 0.89
    width = np.mean([i.high - i.low for i in intervals])
    assert 0.05 < width < 0.25


def test_certain_improvement_still_has_a_width():
    rng = np.random.default_rng(9)
    interval = probability_of_improvement(np.zeros((10, 4)), np.ones((1, 4)), rng, resamples=200)
    assert interval.estimate == interval.high == 1.0
    assert interval.low == pytest.approx(wilson_interval(10, 10).low)


def test_paired_probability_uses_the_pairs():
    """Each pair improves by a hair: paired certain, unpaired a coin toss."""
    rng = np.random.default_rng(10)
    baseline = rng.normal(0, 10, 100)
    paired = paired_probability_of_improvement(baseline - 1e-3, baseline)
    assert paired.estimate == 1.0
    assert 0.95 < paired.low < 1.0
    assert improvement_share((baseline - 1e-3)[:, None], baseline[:, None]) == pytest.approx(0.5, abs=0.02)
    tied = paired_probability_of_improvement([1.0, 2.0, math.inf, math.inf], [2.0, 2.0, math.inf, 1.0])
    assert tied.estimate == 0.5


def test_performance_profile_is_the_empirical_distribution():
    rng = np.random.default_rng(11)
    scores = rng.exponential(1.0, (200, 3))
    levels = np.array([0.0, 0.5, 1.0, 2.0, 50.0])
    profile = performance_profile(scores, levels, rng, resamples=300)
    np.testing.assert_allclose(profile.share, [np.mean(scores <= level) for level in levels])
    truth = 1 - np.exp(-levels)
    assert np.all((profile.low <= truth + 0.02) & (truth - 0.02 <= profile.high))
    np.testing.assert_array_equal(profile.low[[0, -1]], [0.0, 1.0])
    assert np.all(np.diff(profile.share) >= 0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda rng: interquartile_mean([1.0, math.nan]), "scores holds NaN: give failures the worst score"),
        (lambda rng: interquartile_mean([]), "at least one score"),
        (lambda rng: wilson_interval(3, 2), "3 successes in 2 trials"),
        (lambda rng: wilson_interval(1, 2, 1.5), "confidence is 1.5"),
        (lambda rng: bootstrap([1.0, 2.0], np.mean, rng), "nothing to resample"),
        (lambda rng: bootstrap([1.0], np.mean, rng, resampling="crossed"), "a single score has no interval"),
        (lambda rng: bootstrap([[1.0], [2.0]], np.mean, rng, resampling="block"), "unknown resampling 'block'"),
        (lambda rng: bootstrap([[1.0], [2.0]], np.mean, rng, resamples=10), "resamples is 10"),
        (lambda rng: improvement_share(np.ones((2, 3)), np.ones((2, 4))), "candidate has 3 tasks and baseline 4"),
        (lambda rng: paired_probability_of_improvement([1.0], [1.0, 2.0]), "one score per pair"),
        (lambda rng: performance_profile(np.ones((2, 2)), [math.nan], rng), "thresholds has shape"),
    ],
)
def test_bad_input_is_one_sentence(call, message):
    with pytest.raises(InputError, match=message):
        call(np.random.default_rng(0))


def test_median_interval_covers_the_median_as_often_as_it_says():
    rng = np.random.default_rng(5)
    for count in (15, 40, 101):
        found = [median_interval(rng.exponential(size=count)) for _ in range(600)]
        covered = np.mean([item.low <= math.log(2.0) <= item.high for item in found])
        assert 0.93 <= covered <= 1.0
    assert np.mean([item.high - item.low for item in found]) < 0.6  # 4/sqrt(n) of a density of 1/2


def test_median_interval_of_few_and_of_failures():
    found = median_interval([3.0, 1.0, math.inf, 2.0])
    assert (found.low, found.estimate, found.high) == (1.0, 2.0, math.inf)
    assert median_interval([4.0]).estimate == 4.0
    with pytest.raises(InputError, match="NaN"):
        median_interval([1.0, math.nan])
