"""Errors of the branch-free functions against the C library, over the domains that they state."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddagr_gym.physics.fast_math import asin_half, cos_small, exp_negative, log_positive, sin_small

POINTS = 20_000


def _relative_error(function, exact, places):
    values = np.array([function(float(x)) for x in places])
    truth = exact(places)
    return np.max(np.abs(values - truth) / np.maximum(np.abs(truth), 1e-300))


@pytest.mark.parametrize(
    ("function", "exact", "low", "high", "bound"),
    [
        (exp_negative, np.exp, -700.0, 0.0, 1e-12),
        (exp_negative, np.exp, 0.0, 700.0, 1e-12),
        (sin_small, np.sin, -1.6, 1.6, 1e-11),
        (cos_small, np.cos, -1.5, 1.5, 1e-11),
        (asin_half, np.arcsin, 0.0, 0.5, 1e-12),
        (log_positive, np.log, 1.5, 1e6, 1e-12),
    ],
)
def test_relative_error_over_the_domain(function, exact, low, high, bound):
    assert _relative_error(function, exact, np.linspace(low, high, POINTS)) < bound


def test_cosine_close_to_its_zero_has_an_absolute_bound():
    places = np.linspace(1.5, 1.6, POINTS)
    assert max(abs(cos_small(float(x)) - math.cos(x)) for x in places) < 1e-12


def test_logarithm_over_all_magnitudes_of_a_pressure_depth():
    places = np.logspace(-300, 300, POINTS)
    values = np.array([log_positive(float(x)) for x in places])
    assert np.max(np.abs(values - np.log(places))) < 1e-12 * 700


def test_exponential_is_clamped_instead_of_underflowing():
    assert exp_negative(-1e9) == exp_negative(-700.0)
    assert exp_negative(-1e9) == pytest.approx(math.exp(-700.0), rel=1e-12)


@given(st.floats(1e-6, 0.4), st.floats(0.1, 1.6))
def test_power_of_a_depth_as_the_kernel_takes_it(depth, exponent):
    assert exp_negative(exponent * log_positive(depth)) == pytest.approx(depth**exponent, rel=1e-11)
