"""Estimators on one drive: what is judged, and how."""

from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.estimation import ForceLaw
from ddagr_gym.evaluation.filter_arms import ARMS, Motion, drive_law_fit, innovations, judge, wheel_states
from ddagr_gym.parameters import Sensors
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


def truth(drive):
    return Motion(*(drive[f"true_{name}"] for name in ("v_x", "yaw_rate", "omega_right", "omega_left")))


def test_the_truth_has_no_error(robot, drive):
    found = judge(truth(drive), robot, drive, "left")
    assert found["speed_coverage"] is None
    for name in ("radius_error", "radius_error_momentary", "speed_square", "slip_square"):
        assert found[name] == pytest.approx(0.0, abs=1e-12)


def test_errors_have_the_size_that_they_were_given(robot, drive):
    true = truth(drive)
    wrong = true._replace(v_x=1.1 * true.v_x, v_x_deviation=np.full_like(true.v_x, 1.0))
    found = judge(wrong, robot, drive, "left")
    assert found["radius_error"] == pytest.approx(0.1)
    assert found["radius_error_momentary"] == pytest.approx(0.1)
    assert found["speed_square"] == pytest.approx(np.mean((0.1 * true.v_x[200:]) ** 2))
    assert found["slip_square"] > 1e-4
    assert found["speed_coverage"] == 1.0
    none = judge(wrong._replace(v_x_deviation=np.zeros_like(true.v_x)), robot, drive, "left")
    assert none["speed_coverage"] < 0.01


def test_a_filter_that_broke_down_has_no_figures(robot, drive):
    true = truth(drive)
    found = judge(true._replace(v_x=np.full_like(true.v_x, np.nan)), robot, drive, "left")
    assert set(found.values()) == {None}


def test_a_drive_to_the_other_side_is_refused(robot, drive):
    with pytest.raises(InputError, match="did not turn right"):
        judge(truth(drive), robot, drive, "right")


def test_ours_beats_every_yardstick(robot, drive):
    errors = {}
    for name, arm in ARMS.items():
        motion = arm.estimate(robot, Sensors(), drive)
        errors[name] = judge(motion, robot, drive, "left")
        assert bool(innovations(motion)) == (name not in ("encoders", "closed_form"))
    for other in ("encoders", "closed_form", "thesis_filter", "filter_thesis_law"):
        assert errors["filter"]["speed_square"] < 0.5 * errors[other]["speed_square"]
        assert abs(errors["filter"]["radius_error"]) < abs(errors[other]["radius_error"])
    assert abs(errors["filter_known_soil"]["radius_error"]) < 0.02


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
