"""Estimators on one drive: what is judged, and how."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.filter_study.estimators import ESTIMATORS, Motion, innovations, judge
from ddagr_gym.errors import InputError
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
    for name, estimator in ESTIMATORS.items():
        motion = estimator.estimate(robot, Sensors(), drive)
        errors[name] = judge(motion, robot, drive, "left")
        assert bool(innovations(motion)) == (name not in ("encoders", "closed_form"))
    for other in ("encoders", "closed_form", "thesis_filter", "filter_thesis_law"):
        assert errors["filter"]["speed_square"] < 0.5 * errors[other]["speed_square"]
        assert abs(errors["filter"]["radius_error"]) < abs(errors[other]["radius_error"])
    assert abs(errors["filter_known_soil"]["radius_error"]) < 0.02
