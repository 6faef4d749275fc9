"""The stress laws, each against its definition and its limits."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddagr_gym.physics.contact_stress import (
    PEAK_CEILING,
    normal_stress,
    peak_fraction,
    pressure_modulus,
    shear_over_speed,
    slip_ratio,
)

SPEEDS = st.floats(-10, 10).filter(lambda v: v == 0 or abs(v) > 1e-9)


@pytest.mark.parametrize(
    ("rim_speed", "v_x", "slip"),
    [
        (0.0, 0.0, 0.0),  # rest
        (1.0, 1.0, 0.0),  # rolling
        (1.0, 0.8, 0.2),  # driven: 1 - v/(R omega)
        (0.8, 1.0, -0.2),  # braked: R omega/v - 1
        (0.0, 1.0, -1.0),  # locked
        (1.0, 0.0, 1.0),  # spinning on the spot
        (-1.0, -0.8, 0.2),  # driven in reverse
        (1.0, -0.5, 1.5),  # counter-rotating, wheel the faster
        (0.5, -1.0, -1.5),  # counter-rotating, hub the faster
        (1.0, -1.0, 2.0),  # the end of the range
    ],
)
def test_slip_ratio_in_every_quadrant(rim_speed, v_x, slip):
    result = slip_ratio(rim_speed, v_x)
    assert abs(result) == pytest.approx(abs(slip)) if rim_speed == -v_x else result == pytest.approx(slip)


@given(SPEEDS, SPEEDS, st.floats(1e-3, 1e3))
def test_slip_ratio_is_bounded_scale_free_and_even_in_direction(rim_speed, v_x, factor):
    slip = slip_ratio(rim_speed, v_x)
    assert -2.0 <= slip <= 2.0
    assert slip_ratio(factor * rim_speed, factor * v_x) == pytest.approx(slip, rel=1e-12, abs=1e-12)
    if rim_speed != -v_x:
        assert slip_ratio(-rim_speed, -v_x) == pytest.approx(slip)


def test_peak_fraction_is_clipped_on_both_sides():
    assert peak_fraction(0.5, 0.5, 0.2) == pytest.approx(0.6)
    assert peak_fraction(0.5, 0.5, 1.0) == PEAK_CEILING
    assert peak_fraction(0.5, 0.5, -2.0) == 0.0


def test_pressure_modulus_uses_the_width_of_the_patch():
    assert pressure_modulus(13190.0, 692000.0, 0.1016, 0.6) == pytest.approx(13190.0 / (2 * 0.1016 * 0.6) + 692000.0)


@given(st.floats(1e3, 1e8), st.floats(0.1, 2.0), st.floats(1e-7, 0.2))
def test_normal_stress_is_a_power_of_the_depth(modulus, exponent, depth):
    assert normal_stress(modulus, exponent, depth) == pytest.approx(modulus * depth**exponent, rel=1e-11)


def test_normal_stress_vanishes_above_ground():
    assert normal_stress(1e6, 0.5, -0.01) < 1e-100


@given(st.floats(0.1, 1e5), st.floats(-1, 1), st.floats(-1, 1), st.floats(0.01, 1), st.floats(0.01, 1))
def test_shear_stress_follows_janosi_and_never_exceeds_the_strength(strength, j_t, j_l, v_t, v_l):
    rate, modulus = 0.7, 0.01
    tau = shear_over_speed(strength, j_t, j_l, v_t, v_l, -1.0 / (rate * modulus)) * math.hypot(v_t, v_l)
    expected = -strength * math.expm1(-math.hypot(j_t, j_l) / (rate * modulus))
    assert tau == pytest.approx(expected, rel=1e-9, abs=1e-11 * strength)
    assert tau <= strength * (1 + 1e-12)


def test_shear_stress_is_finite_without_sliding():
    assert math.isfinite(shear_over_speed(1e4, 0.01, 0.0, 0.0, 0.0, -100.0) * 0.0)
