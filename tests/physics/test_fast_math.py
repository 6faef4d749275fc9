"""Errors of the branch-free functions against the C library, over the domains that they state."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddagr_gym.physics.fast_math import (
    asin_half,
    cos_small,
    exp2_bounded,
    inverse_sqrt,
    log2_positive,
    sin_small,
)

POINTS = 20_000


def _relative_error(function, exact, places):
    values = np.array([function(float(x)) for x in places])
    truth = exact(places)
    return np.max(np.abs(values - truth) / np.maximum(np.abs(truth), 1e-300))


@pytest.mark.parametrize(
    ("function", "exact", "low", "high", "bound"),
    [
        (exp2_bounded, np.exp2, -1000.0, 0.0, 5e-14),
        (exp2_bounded, np.exp2, 0.0, 1000.0, 5e-14),
        (sin_small, np.sin, -1.06, 1.06, 3e-13),
        (cos_small, np.cos, -1.06, 1.06, 2e-14),
        (asin_half, np.arcsin, 0.0, 0.5, 2e-14),
        (log2_positive, np.log2, 2.0, 1e6, 5e-14),
    ],
)
def test_relative_error_over_the_domain(function, exact, low, high, bound):
    assert _relative_error(function, exact, np.linspace(low, high, POINTS)) < bound


def test_logarithm_over_all_magnitudes_of_a_pressure_depth():
    places = np.logspace(-300, 300, POINTS)
    values = np.array([log2_positive(float(x)) for x in places])
    assert np.max(np.abs(values - np.log2(places)) / np.maximum(np.abs(np.log2(places)), 1.0)) < 5e-14


def test_inverse_square_root_over_all_magnitudes_of_a_squared_speed():
    assert _relative_error(inverse_sqrt, lambda x: x**-0.5, np.logspace(-300, 300, POINTS)) < 5e-13


def test_exponential_is_clamped_instead_of_underflowing():
    assert exp2_bounded(-1e9) == exp2_bounded(-1000.0)
    assert exp2_bounded(-1e9) == pytest.approx(2.0**-1000, rel=1e-12)
    assert exp2_bounded(0.0) == 1.0


@given(st.floats(1e-6, 0.4), st.floats(0.1, 1.6))
def test_power_of_a_depth_as_the_kernel_takes_it(depth, exponent):
    assert exp2_bounded(exponent * log2_positive(depth)) == pytest.approx(depth**exponent, rel=1e-12)
