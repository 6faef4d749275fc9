"""Fits of force laws to wheel forces, and what they cost."""

from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.estimation import ForceLaw
from ddagr_gym.evaluation.force_law_fits import (
    LAWS,
    draw_soils,
    fit_law,
    grid_states,
    law_forces,
    soil_set_costs,
    summarise,
    turn_states,
)
from ddagr_gym.presets import get_robot, get_soil


@pytest.fixture(scope="module")
def robot():
    return get_robot("ddagr")


@pytest.mark.parametrize("law", ForceLaw)
def test_parameters_of_the_law_itself_are_found(robot, law):
    true = np.array([150.0, 5.0, 700.0, 25.0])
    states, radius = turn_states(robot, np.random.default_rng(1)), robot.wheels[0].outer_radius
    forces = np.empty((len(states), 2))
    law_forces(float(law), true, states, radius, forces)
    fit = fit_law(law, states, forces, radius)
    np.testing.assert_allclose(np.exp(fit.logs), true, rtol=1e-4)
    assert np.abs(fit.errors).max() < 1e-3 * fit.peak.max()
    summary = summarise([fit], 400.0)
    assert summary["prior"]["traction_limit_over_load"]["median"] == pytest.approx(150.0 / 400.0, rel=1e-4)
    assert summary["prior"]["coupling"]["median"] == pytest.approx(700.0 / (150.0 * 5.0), rel=1e-4)


def test_without_resistance_it_is_negligible(robot):
    states, radius = grid_states(robot)[::7], robot.wheels[0].outer_radius
    forces = np.empty((len(states), 2))
    law_forces(0.0, np.array([150.0, 5.0, 700.0, 25.0]), states, radius, forces)
    fit = fit_law(ForceLaw.thesis, states, forces, radius, resistance=False)
    assert np.exp(fit.logs[3]) < 1e-6
    assert np.abs(fit.errors[:, 0]).max() > 10.0


def test_the_grid_is_the_thesis_s(robot):
    states = grid_states(robot)
    assert states.shape == (2500, 4)
    assert np.degrees(np.arctan2(states[:, 1], states[:, 0])).max() == pytest.approx(60.0)


def test_the_coupled_law_is_several_times_closer(robot):
    costs = soil_set_costs(robot, [get_soil("thesis_a1")], seed=0)
    for kind in ("grid", "turn"):
        assert set(costs[kind]) == set(LAWS)
        for key in ("peak_error_x", "peak_error_y", "rms_error_x", "rms_error_y"):
            assert costs[kind]["coupled"][key] < 0.25 * costs[kind]["thesis"][key]
    # physics.md section 7: the approximate law errs by a third to a half of the largest force
    assert 0.3 < costs["turn"]["thesis"]["peak_error_x"] < 0.6


def test_soils_repeat_with_their_seed(robot):
    assert draw_soils("field", robot, 2, 5) == draw_soils("field", robot, 2, 5)
    assert draw_soils("field", robot, 1, 5) != draw_soils("field", robot, 1, 6)
    assert draw_soils("thesis_a1", robot, 3, 5) == [get_soil("thesis_a1")]
