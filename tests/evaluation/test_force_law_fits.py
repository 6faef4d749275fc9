"""Fits of force laws to wheel forces."""

from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.estimation import ForceLaw
from ddagr_gym.evaluation.force_law_fits import drive_law_fit, fit_law, law_forces, turn_states, wheel_states
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.simulator import simulate

PERIOD = 0.008


@pytest.fixture(scope="module")
def robot():
    return get_robot("ddagr")


@pytest.fixture(scope="module")
def drive(robot):
    """A left turn of 180 degrees on the nominal soil."""
    t = np.arange(0.0, 22.0, PERIOD)
    commands = np.full((t.size, 2), 0.7)
    commands[(t >= 3) & (t < 19)] = [1.15, 0.2]
    return simulate(robot, get_soil("thesis_a1"), commands, seed=2)


@pytest.mark.parametrize("law", ForceLaw)
def test_parameters_of_the_law_itself_are_found(robot, law):
    true = np.array([150.0, 5.0, 700.0, 25.0])
    states, radius = turn_states(robot, np.random.default_rng(1)), robot.wheels[0].outer_radius
    forces = np.empty((len(states), 2))
    law_forces(float(law), true, states, radius, forces)
    fit = fit_law(law, states, forces, radius)
    np.testing.assert_allclose(np.exp(fit.logs), true, rtol=1e-4)
    assert np.abs(fit.errors).max() < 1e-3 * fit.peak.max()


def test_without_resistance_it_is_negligible(robot):
    states, radius = turn_states(robot, np.random.default_rng(2)), robot.wheels[0].outer_radius
    forces = np.empty((len(states), 2))
    law_forces(0.0, np.array([150.0, 5.0, 700.0, 25.0]), states, radius, forces)
    fit = fit_law(ForceLaw.thesis, states, forces, radius, resistance=False)
    assert np.exp(fit.logs[3]) < 1e-6
    assert np.abs(fit.errors[:, 0]).max() > 10.0


def test_wheel_states_are_those_of_the_slip_ratios(robot, drive):
    rows = np.array([1000, 1500])
    states, forces = wheel_states(robot, drive, rows)
    assert states.shape == (8, 4)
    assert forces.shape == (8, 2)
    radius = robot.wheels[0].outer_radius
    for wheel in range(4):
        for k, row in enumerate(rows):
            v_x, _, omega, _ = states[2 * wheel + k]
            rim = radius * omega
            slip = (rim - v_x) / max(abs(rim), abs(v_x))
            assert slip == pytest.approx(drive[f"true_slip_ratio_{wheel + 1}"][row], abs=2e-3)
    assert forces[0, 0] == drive["true_force_x_1"][1000]


def test_the_law_fit_reproduces_the_drive(robot, drive):
    coupled = drive_law_fit(robot, drive, ForceLaw.coupled)
    thesis = drive_law_fit(robot, drive, ForceLaw.thesis)
    assert np.sqrt(np.mean(coupled.errors**2)) < 0.3 * np.sqrt(np.mean(thesis.errors**2))
