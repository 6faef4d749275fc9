"""Random effects: known answers, and the prior of a drive's estimate taken back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.calibration.drive_scatter import _freed, between_variance, half_width, scatter
from ddagr_gym.identification.parameters import command_shift


def test_equal_variances_have_the_classical_answer():
    """With equal v the equation is sum (x - m)^2/(v + tau^2) = k - 1, so that tau^2 = s^2 - v."""
    values = np.array([1.0, 3.0, 2.0, 6.0])
    assert between_variance(values, np.full(4, 0.5)) == pytest.approx(values.var(ddof=1) - 0.5)
    assert between_variance(values, np.full(4, 100.0)) == 0.0
    assert between_variance(values[:1], np.ones(1)) == 0.0


def test_variance_between_drives_is_found_from_many():
    rng = np.random.default_rng(3)
    variances = rng.uniform(0.01, 0.3, 400)
    values = 2.0 + rng.normal(0.0, np.sqrt(0.25 + variances))
    # standard error of a variance from 400: 7 % of the sum, 0.03
    assert between_variance(values, variances) == pytest.approx(0.25, abs=0.09)


def test_scatter_on_one_ground_leaves_the_grounds_out():
    values = np.array([1.0, 1.2, 5.0, 5.2, np.nan])
    found = scatter(values, np.full(5, 1e-6), ("a", "a", "b", "b", "c"))
    assert found.drives == 4
    assert found.same_ground == pytest.approx(np.sqrt(0.02), rel=1e-3)
    assert found.same_ground_degrees == 2
    assert found.other_grounds == pytest.approx(values[:4].std(ddof=1), rel=1e-3)
    alone = scatter(np.array([1.0]), np.array([0.1]), ("a",))
    assert (alone.same_ground, alone.other_grounds) == (None, None)


def test_intervals_of_few_drives_cover():
    """90 % intervals of a mean over four drives with unequal variances hold the truth in 90 % of the worlds."""
    rng = np.random.default_rng(4)
    held = 0
    for _ in range(600):
        variances = rng.uniform(0.02, 0.1, 4)
        values = rng.normal(0.0, np.sqrt(0.2 + variances))
        weight = 1.0 / (variances + between_variance(values, variances))
        mean = float(weight @ values / weight.sum())
        held += abs(mean) <= half_width(values, variances, 0.0)
    # standard error 1.2 %
    assert held / 600 == pytest.approx(0.90, abs=0.04)


def test_one_drive_has_the_interval_of_the_fit():
    assert half_width(np.array([1.0, np.nan]), np.array([1.0, np.nan]), 0.1) == pytest.approx(0.1645, rel=1e-3)


def test_the_prior_of_an_estimate_is_taken_back():
    """Data with variance v and value d under the prior N(0, s^2): the mean is d s^2/(s^2 + v)."""
    prior = replace(command_shift(0.05), prior=0.3)
    v, d = 0.04, 0.25
    mean, variance = d * 0.09 / (0.09 + v), 0.09 * v / (0.09 + v)
    assert _freed(mean, variance, prior) == pytest.approx((d, v))
    assert np.isnan(_freed(0.0, 0.0899, prior)[0])
