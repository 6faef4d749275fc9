"""Consistency statistics: bands, NEES, NIS, autocorrelation."""

from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.estimation import (
    CHANNELS,
    autocorrelation,
    channel_statistics,
    chi_square_band,
    normalised_estimation_error,
)
from ddagr_gym.estimation.consistency import white_bound


def test_band_of_a_printed_table():
    # Bar-Shalom, Estimation with Applications, table 1.5.4-1: chi-square, 95 % two-sided
    for degrees, count, low, high in [(1, 1, 0.000982, 5.024), (2, 1, 0.0506, 7.378), (2, 50, 74.22, 129.6)]:
        band = chi_square_band(degrees, count)
        total = degrees * count
        assert band.low * total == pytest.approx(low, rel=2e-3)
        assert band.high * total == pytest.approx(high, rel=2e-3)


def test_band_holds_what_it_promises(rng):
    band = chi_square_band(3, 20, 0.9)
    means = (rng.standard_normal((20000, 20, 3)) ** 2).sum(axis=2).mean(axis=1) / 3
    assert band.contains(means).mean() == pytest.approx(0.9, abs=0.01)


def test_normalised_error_of_drawn_gaussians(rng):
    root = rng.standard_normal((12, 12))
    covariance = root @ root.T
    errors = rng.multivariate_normal(np.zeros(12), covariance, size=4000)
    every = np.broadcast_to(covariance, (4000, 12, 12))
    for block, degrees in (("velocity", 3), ("parameters", 4), (slice(None), 12)):
        values = normalised_estimation_error(errors, every, block)
        assert chi_square_band(degrees, 4000, 0.999).contains(values.mean())
    too_sure = normalised_estimation_error(errors, 0.25 * every, "parameters")
    assert too_sure.mean() == pytest.approx(4.0, rel=0.1)


def test_autocorrelation_of_white_and_of_a_moving_average(rng):
    white = rng.standard_normal(20000)
    bound = white_bound(white.size)
    assert np.mean(np.abs(autocorrelation(white, 200)) < bound) > 0.9
    averaged = white[1:] + white[:-1]
    found = autocorrelation(averaged, 3)
    assert found[0] == pytest.approx(0.5, abs=0.02)
    assert abs(found[1]) < 2 * bound
    np.testing.assert_array_equal(autocorrelation(np.zeros(10), 3), 0.0)


def test_channel_statistics_leave_gaps_out(rng):
    values = rng.standard_normal((5000, 5))
    values[:, 0] = np.nan
    values[::2, 1] = np.nan
    values[:, 2] += 0.5
    found = channel_statistics(values, lags=10)
    assert list(found) == list(CHANNELS[1:])
    assert found[CHANNELS[1]].samples == 2500
    assert found[CHANNELS[2]].mean == pytest.approx(0.5, abs=0.05)
    assert not found[CHANNELS[2]].band.contains(found[CHANNELS[2]].nis)
    assert found[CHANNELS[3]].band.contains(found[CHANNELS[3]].nis)


@pytest.mark.parametrize(
    "call",
    [
        lambda: chi_square_band(0),
        lambda: chi_square_band(1, 1, 1.0),
        lambda: autocorrelation(np.ones(3), 3),
        lambda: channel_statistics(np.ones((4, 2))),
    ],
)
def test_errors_name_the_remedy(call):
    with pytest.raises(InputError, match="give"):
        call()
