from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from ddagr_gym.recordings.checks.blocks import cut_blocks, interval_of, mean_interval, resample
from ddagr_gym.recordings.checks.regression import estimate, normal_equations, solve
from ddagr_gym.recordings.schema import Recording


def test_blocks_cover_every_span_without_overlap_or_crossing():
    t = np.concatenate([np.arange(0, 61, 0.1), 100 + np.arange(0, 4, 0.1)])
    recording = Recording.from_columns({"t": t}, spans=((0, 610), (610, len(t))))
    blocks = cut_blocks(recording)
    assert blocks[0].start == 0
    assert blocks[-1].stop == len(t)
    assert all(a.stop == b.start for a, b in itertools.pairwise(blocks))
    assert any(b.start == 610 for b in blocks)
    assert 2.5 < np.median([t[b.stop - 1] - t[b.start] for b in blocks]) < 4


@pytest.mark.parametrize("blocks", [8, 40])
def test_intervals_cover_the_truth_as_often_as_they_say(blocks):
    """Slope of a line in noise that is correlated inside blocks: 99 % intervals must hold it about 99 times in 100."""
    rng = np.random.default_rng(5)
    held = 0
    trials = 300
    for _ in range(trials):
        sums = []
        for _ in range(blocks):
            x = rng.normal(size=20)
            y = 2.0 * x + rng.normal() * x + 0.1 * rng.normal(size=20)
            sums.append(normal_equations(x[:, None], y))
        found = estimate(sums, solve, rng)
        held += found.intervals[0][0] <= 2.0 <= found.intervals[0][1]
    # 99 % +- three binomial standard deviations, less 2 % for the bootstrap's known shortness with few blocks.
    assert held / trials > 0.955


def test_intervals_shrink_with_the_number_of_blocks():
    rng = np.random.default_rng(6)
    widths = []
    for blocks in (10, 1000):
        sums = rng.normal(1.0, 0.3, size=(blocks, 1))
        values, resampled = resample(
            np.concatenate([sums, np.ones_like(sums)], axis=1), lambda s: s[:, :1] / s[:, 1:], rng
        )
        low, high = interval_of(float(values[0]), resampled[:, 0], blocks)
        widths.append(high - low)
    assert widths[0] / widths[1] == pytest.approx(10, rel=0.6)


def test_too_few_blocks_give_no_estimate_and_one_block_no_interval():
    assert estimate([np.ones((1, 2))] * 4, solve, np.random.default_rng(0)) is None
    assert interval_of(1.0, np.ones(400), 1) == (-math.inf, math.inf)


def test_singular_equations_give_nan_not_an_error():
    totals = np.stack([np.array([[1.0, 1.0, 2.0], [1.0, 1.0, 2.0]]), np.array([[2.0, 0.0, 2.0], [0.0, 4.0, 8.0]])])
    values = solve(totals)
    assert np.isnan(values[0]).all()
    np.testing.assert_allclose(values[1], [1.0, 2.0])


def test_the_student_interval_of_a_mean():
    mean, (low, high) = mean_interval(np.array([1.0, 2.0, 3.0, np.nan]))
    assert mean == 2.0
    # t(0.995, 2) = 9.92484 from tables
    assert high - mean == pytest.approx(9.92484 / math.sqrt(3), rel=1e-5)
    assert low == pytest.approx(2 * mean - high)
