from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.replay_analysis.intervals import (
    compare,
    error_statistics,
    resampled_counts,
    resampled_median,
    resampled_rms,
)


def generator():
    return np.random.default_rng(0)


def test_sizes_of_known_errors():
    found = error_statistics(np.array([3.0, -4.0, np.nan, 0.0]), np.arange(4), generator())
    assert found.count == 3
    assert found.rms == pytest.approx(np.sqrt(25.0 / 3.0))
    assert found.median == 3.0
    assert found.bias == pytest.approx(-1.0 / 3.0)


def test_nothing_measured_gives_nulls():
    found = error_statistics(np.full(3, np.nan), np.arange(3), generator())
    assert (found.count, found.rms, found.rms_interval, found.bias) == (0, None, None, None)


def test_whole_clusters_are_drawn():
    counts = resampled_counts(np.array([7, 7, 2, 2, 2]), generator())
    assert counts.shape == (1000, 5)
    assert (counts[:, 0] == counts[:, 1]).all()
    assert (counts[:, 2:] == counts[:, 2:3]).all()
    assert (counts[:, 0] + counts[:, 2] == 2).all()
    assert set(counts[:, 0]) == {0, 1, 2}


def test_sizes_in_a_resample_are_those_of_its_windows():
    rng = generator()
    errors, counts = rng.normal(0.0, 1.0, 31), resampled_counts(rng.integers(9, size=31), rng)
    for k in range(0, 1000, 97):
        drawn = np.repeat(errors, counts[k])
        assert resampled_rms(errors, counts)[k] == pytest.approx(np.sqrt(np.mean(drawn**2)))
        assert resampled_median(errors, counts)[k] == pytest.approx(np.median(np.abs(drawn)))


def test_one_cluster_has_no_interval():
    assert error_statistics(np.ones(5), np.zeros(5), generator()).rms_interval is None


def test_copies_of_a_window_do_not_narrow_the_interval():
    errors = np.random.default_rng(1).normal(0.0, 1.0, 40)
    alone = error_statistics(errors, np.arange(40), generator())
    copied = error_statistics(np.repeat(errors, 10), np.repeat(np.arange(40), 10), generator())
    assert copied.rms_interval == pytest.approx(alone.rms_interval)
    naive = error_statistics(np.repeat(errors, 10), np.arange(400), generator())
    assert np.ptp(naive.rms_interval) < 0.5 * np.ptp(copied.rms_interval)


def test_the_interval_covers_about_as_often_as_it_says():
    rng = np.random.default_rng(2)
    hits = 0
    for _ in range(200):
        interval = error_statistics(rng.normal(0.0, 1.0, 60), np.arange(60), rng).rms_interval
        hits += interval[0] <= 1.0 <= interval[1]
    # 0.95 of 200 has the deviation 3; the percentile interval of 60 values covers a little less
    assert 176 <= hits <= 198


def test_a_model_with_half_the_error_has_the_ratio_one_half():
    theirs = np.random.default_rng(3).normal(0.0, 1.0, 50)
    pair = compare("ours", 0.5 * theirs, "theirs", theirs, np.arange(50), generator())
    assert pair.rms_ratio == pytest.approx(0.5)
    assert pair.rms_ratio_interval == pytest.approx((0.5, 0.5))
    assert pair.share_smaller == 1.0


def test_a_perfect_baseline_cannot_be_compared_with():
    assert compare("ours", np.ones(3), "theirs", np.zeros(3), np.arange(3), generator()) is None
