"""Fits without one drive, from where the joint fit stands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.simulated_robots import drive, true_robot
from ddagr_gym.calibration.calibration_data import CalibrationData
from ddagr_gym.calibration.joint_fit import FittedModel, complete_model, fit_model, weigh_and_fit
from ddagr_gym.calibration.left_out import folds, forecast_losses, forecasts, refitted_without, values_without
from ddagr_gym.calibration.part_comparison import Comparison
from ddagr_gym.calibration.parts import PARTS
from ddagr_gym.calibration.run import ready_drives
from ddagr_gym.calibration.settings import CalibrationSettings
from ddagr_gym.identification.gauss_newton import fit, fit_states
from ddagr_gym.identification.problem import Point, Problem
from ddagr_gym.identification.residual_weights import Weights
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.presets import get_robot, get_soil

SETTINGS = CalibrationSettings(fitted=4, compared=4, judged=4)

KEPT = frozenset({"speed_loop", "command_delay"})

OUT = 1
"""Drive that is left out, on the same ground as the first."""

QUICK = 2.9
"""Rate of its motors [1/s]; that of the others is 2.5."""


@pytest.fixture(scope="module")
def data() -> CalibrationData:
    """Of three drives of which one is by quicker motors: the others' fit is elsewhere without it."""
    quick = replace(true_robot(), motor_rate=QUICK)
    drives = [drive("field", 1), drive("field", 2, robot=quick), drive("track", 3)]
    grounds = ("field", "field", "track")
    soils = {ground: get_soil("thesis_a1") for ground in grounds}
    return ready_drives(drives, grounds, get_robot("ddagr"), soils, SETTINGS)


@pytest.fixture(scope="module")
def fitted(data) -> tuple[FittedModel, Weights]:
    complete, held = complete_model(data)
    model = complete.without(frozenset(part.name for part in PARTS) - KEPT, data.robot)
    return weigh_and_fit(data, data.spread(SETTINGS.fitted), model, {**held, "command_delay": 0.1}, 1)


@pytest.fixture(scope="module")
def joint(fitted) -> FittedModel:
    return fitted[0]


@pytest.fixture(scope="module")
def out(joint) -> np.ndarray:
    return joint.problem.blocked.windows.recording == OUT


def others(model: FittedModel, out: np.ndarray) -> Problem:
    """The fit of the windows that stay, with the bias of the drive that does not held."""
    names = np.array([p.name for p in model.parameters])
    return model.problem.subset(~out).holding(names == f"gyro_bias_{OUT + 1}")


def cost(model: FittedModel, values: np.ndarray, out: np.ndarray) -> float:
    """Loss of the windows that stay with values, their states at their best, and the priors' share."""
    problem = others(model, out)
    states, prediction = fit_states(problem, values, 4)
    free = problem.free
    loss = problem.losses(problem.residual(Point(values, states), prediction)).sum()
    return float(loss + 0.5 * ((values[free] / problem.prior[free]) ** 2).sum())


def test_it_comes_to_what_a_fit_of_the_other_drives_comes_to(joint, out):
    problem, begin = others(joint, out), joint.fitted.point
    full = fit(problem, Point(begin.values, begin.states[~out]), iterations=20, renewals=20)
    k = [p.name for p in joint.parameters].index("motor_rate")
    moved = full.point.values[k] - begin.values[k]
    assert moved < -0.05
    assert values_without(joint, out)[k] - begin.values[k] == pytest.approx(moved, rel=0.2)
    assert refitted_without(joint, out)[k] - begin.values[k] == pytest.approx(moved, rel=0.02)


def test_forecasts_may_come_from_fits_of_their_own(data, fitted):
    """Two drives have another one on their ground: they are forecast with what their fits without them found."""
    joint, weights = fitted
    judged = data.spread(SETTINGS.judged)
    stepped, refitted = (
        list(forecasts(data, joint, judged, weights, 1, way)) for way in (values_without, refitted_without)
    )
    by_window = joint.problem.blocked.windows.recording
    for one, other in zip(stepped[:2], refitted[:2], strict=True):
        np.testing.assert_array_equal(one.values, values_without(joint, by_window == one.fold))
        np.testing.assert_array_equal(other.values, refitted_without(joint, by_window == one.fold))
        assert not np.array_equal(one.prediction, other.prediction)


def test_forecasts_have_the_same_bits_on_one_thread_and_on_two(data, fitted):
    joint, weights = fitted
    judged = data.spread(SETTINGS.judged)
    alone, both = (list(forecasts(data, joint, judged, weights, threads)) for threads in (1, 2))
    assert [item.fold for item in both] == [0, 1, 2]
    for one, other in zip(alone, both, strict=True):
        np.testing.assert_array_equal(other.values, one.values)
        np.testing.assert_array_equal(other.prediction, one.prediction)


def test_what_acts_in_the_left_out_drive_alone_is_left_as_it_is(joint, out):
    names = [p.name for p in joint.parameters]
    moved = values_without(joint, out) != joint.fitted.point.values
    assert not moved[names.index(f"gyro_bias_{OUT + 1}")]
    assert moved[names.index("motor_rate")]
    assert moved[names.index("soil_strength_field")]


def test_no_step_is_taken_by_which_the_other_drives_are_read_worse(data, fitted, out):
    """Where the sensitivities are of another point, the linear problem says nothing of the way."""
    joint, weights = fitted
    far = {**joint.values, "motor_rate": 1.0, "command_delay": 0.9}
    begun = fit_model(data, data.spread(SETTINGS.fitted), joint.model, weights, far, 1, iterations=0)
    found = values_without(begun, out)
    assert cost(begun, found, out) <= cost(begun, begun.fitted.point.values, out)


@pytest.mark.parametrize(("channel", "of_wheels"), [("encoder_left", True), ("pose_x", False), ("yaw_rate", False)])
def test_a_loss_of_wheels_is_of_their_speeds_alone(data, fitted, channel, of_wheels):
    joint, weights = fitted
    made = next(iter(forecasts(data, joint, data.spread(SETTINGS.judged), weights, 1)))
    off = made.prediction.copy()
    off[..., CHANNELS.index(channel)] += 1.0
    sigma = weights.sigma[0, 0]
    whole, wheels = forecast_losses(made, sigma, weights.robust)
    whole_off, wheels_off = forecast_losses(replace(made, prediction=off), sigma, weights.robust)
    assert whole_off > whole
    assert (wheels_off > wheels) is of_wheels
    assert wheels_off == wheels or of_wheels


def test_a_quarter_with_no_fitted_window_is_not_forecast():
    """Of a drive with pauses in its commands few windows are spread over all, and a lone one of a quarter is missed."""
    data = ready_drives([drive("field", 1)], ["field"], get_robot("ddagr"), {"field": get_soil("thesis_a1")}, SETTINGS)
    quarter = folds(data, data.windows)
    third = np.flatnonzero(quarter == 2)
    data = replace(data, windows=data.windows.subset(np.sort(np.append(np.flatnonzero(quarter != 2), third[0]))))
    settings = CalibrationSettings(compared=3)
    windows = data.spread(settings.compared)
    assert set(folds(data, windows)) == {0, 1, 3}
    assert set(folds(data, data.spread(settings.judged))) == {0, 1, 2, 3}
    complete, held = complete_model(data)
    model = complete.without(frozenset(part.name for part in PARTS) - KEPT, data.robot)
    fitted, weights = weigh_and_fit(data, windows, model, {**held, "command_delay": 0.1}, 1, 1)
    comparison = Comparison.of(data, windows, weights, settings)
    judged = comparison.judge(fitted, comparison.forecasts(fitted))
    assert list(judged.losses) == list(judged.counts) == [0, 1, 3]
    assert np.isfinite(list(judged.losses.values())).all()
