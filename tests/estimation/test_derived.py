"""Derived estimates and their standard deviations."""

from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.estimation import estimates, slip_ratio


@pytest.mark.parametrize(
    ("rim", "speed", "expected"),
    [
        (0.2, 0.1, 0.5),
        (0.1, 0.2, -0.5),
        (0.0, 0.1, -1.0),
        (0.1, 0.0, 1.0),
        (-0.2, -0.1, 0.5),
        (0.1, -0.1, 2.0),
        (0, 0, 0),
    ],
)
def test_slip_ratio_of_the_physics_page(rim, speed, expected):
    assert slip_ratio(rim, speed) == pytest.approx(expected)


def test_values(model, turning_state):
    state, covariance = turning_state
    found = estimates(model, state, covariance)
    assert found.radius == pytest.approx(0.155 / 0.21)
    assert found.curvature == pytest.approx(0.21 / 0.155)
    right = slip_ratio(model.outer_radius * 1.19, 0.155 + 0.58 * 0.21)
    assert found.slip_ratios[0] == pytest.approx(right)
    np.testing.assert_allclose(found.parameters, np.exp(state[5:9]))
    np.testing.assert_allclose(found.learned, 0.0, atol=1e-12)


def test_leading_shape_is_kept(model, turning_state):
    state, covariance = turning_state
    found = estimates(model, np.tile(state, (3, 4, 1)), np.tile(covariance, (3, 4, 1, 1)))
    assert found.velocity.shape == (3, 4, 3)
    assert found.slip_ratio_deviations.shape == (3, 4, 2)
    assert found.radius.shape == (3, 4)


@pytest.mark.parametrize("motion", [[0.155, 0.004, 0.21, 1.19, 0.3], [-0.15, 0.0, 0.1, -0.7, -0.5]])
def test_deviations_against_drawn_states(model, rng, motion):
    state, covariance = model.initial()
    state[:5] = motion
    covariance[:5, :5] = 1e-6 * (np.eye(5) + 0.5)
    drawn = state + rng.multivariate_normal(np.zeros(12), covariance, size=20000)
    clouds = estimates(model, drawn, np.broadcast_to(covariance, (20000, 12, 12)))
    found = estimates(model, state, covariance)
    assert found.radius_deviation == pytest.approx(clouds.radius.std(), rel=0.05)
    np.testing.assert_allclose(found.slip_ratio_deviations, clouds.slip_ratios.std(axis=0), rtol=0.05)


def test_no_turn_has_no_radius(model):
    state, covariance = model.initial()
    found = estimates(model, state, covariance)
    assert np.isinf(found.radius)
    assert np.isinf(found.radius_deviation)
    assert np.isfinite(found.slip_ratios).all()


def test_learned_tells_what_was_observed(model):
    state, covariance = model.initial()
    covariance[6, 6] *= 0.25
    assert estimates(model, state, covariance).learned[1] == pytest.approx(0.75)


def test_wrong_shapes(model):
    with pytest.raises(InputError, match="give"):
        estimates(model, np.zeros(12), np.zeros((5, 5)))
