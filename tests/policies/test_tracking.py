"""Policies that correct the path tracker: what they see, that nothing is added without a network, and memory."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ddagr_gym.control.observation import EKF_FEATURES, OBSERVATION, PATH_FEATURES
from ddagr_gym.control.path_tracker import path_errors
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.control.tracker_settings import STANDING
from ddagr_gym.envs.options import make_settings
from ddagr_gym.errors import InputError
from ddagr_gym.estimation import InertialModel, Reckoned
from ddagr_gym.estimation.force_balance import arc_bank_speeds
from ddagr_gym.evaluation.ladder_gains import tracker_settings
from ddagr_gym.evaluation.runs import drive_turn, drive_turns
from ddagr_gym.parameters import Sensors
from ddagr_gym.policies.archive import load_policy, save_policy
from ddagr_gym.policies.controller import PolicyBatch, PolicyController
from ddagr_gym.policies.design import PolicyDesign
from ddagr_gym.policies.view import PolicyView
from ddagr_gym.presets import ddagr
from tests.policies.test_archive import make_policy

DESIGN = PolicyDesign(features="path", tracker=tracker_settings())
ENTRIES = (*OBSERVATION, *EKF_FEATURES, *PATH_FEATURES)
SCALE = {name: scale for name, _, scale in ENTRIES}
START = {"side": 1.0, "target_radius": 0.8, "target_speed": 0.2, "heading_to_go": math.pi, "run_in_to_go": 0.5,
         "estimated_x": -0.5, "path_to_go": 0.5 + 0.8 * math.pi}  # fmt: skip
TURNING = {"estimated_x": 0.6, "estimated_y": 0.35, "estimated_yaw": 1.0, "estimated_v_x": 0.2, "estimated_v_y": -0.01,
           "estimated_yaw_rate": 0.25, "run_in_to_go": 0.0, "heading_to_go": 2.0, "cross_track_error": -0.02,
           "course_error": 0.05, "path_curvature": 1.25, "gravity_x": 0.1, "gravity_y": 0.2}  # fmt: skip
MIRRORED = ("side", "yaw_rate", "specific_force_y", "estimated_y", "estimated_yaw", "estimated_v_y",
            "estimated_yaw_rate", "cross_track_error", "course_error", "path_curvature", "gravity_y")  # fmt: skip


def observation(**values):
    """One observation (1, entries) of SI values."""
    given = START | values
    return np.array([[given.get(name, 0.0) / SCALE[name] for name, _, _ in ENTRIES]], dtype=np.float32)


def view_of(design=DESIGN):
    return PolicyView(design, ddagr(), Sensors(), 1)


def stood(view):
    """A view whose robot has stood for as long as the tracker wants."""
    for _ in range(STANDING):
        view.observe(observation())
        np.testing.assert_array_equal(view.act(np.zeros((1, 2)), observation()), 0.0)
    return view


def mirrored(values):
    return {name: -value if name in MIRRORED else value for name, value in values.items()}


@pytest.mark.parametrize("action", ["correction", "absolute"])
def test_left_and_right_turns_look_and_act_alike(action):
    design = PolicyDesign(features="path", tracker=tracker_settings(), action=action)
    left, right = view_of(design), view_of(design)
    outputs = np.array([[0.2, -0.1]])
    for k in range(STANDING + 2):
        values = START | (TURNING if k >= STANDING else {})
        seen, twin = observation(**values), observation(**mirrored(values))
        np.testing.assert_allclose(left.observe(seen), right.observe(twin), atol=1e-5)
        actions = left.act(outputs, seen)
        np.testing.assert_allclose(actions, right.act(outputs, twin)[:, ::-1], atol=1e-5)
        assert bool(actions.any()) == (k >= STANDING)


def test_inputs_are_the_path_errors_without_units():
    view = stood(view_of())
    inputs = dict(zip(DESIGN.inputs, view.observe(observation(**TURNING))[0], strict=True))
    assert inputs["path_cross_track_error"] == pytest.approx(10.0 * -0.02 / 0.8, rel=1e-5)
    assert inputs["path_course_error"] == pytest.approx(0.5, rel=1e-5)
    assert inputs["path_curvature"] == pytest.approx(1.0)
    assert inputs["estimated_side_speed"] == pytest.approx(-0.05, rel=1e-5)
    assert (inputs["gravity_x"], inputs["gravity_y"]) == pytest.approx((0.1, 0.2))


def test_the_tracker_steers_by_the_observed_pose():
    settings = tracker_settings()
    view = stood(view_of())
    inputs = dict(zip(DESIGN.inputs, view.observe(observation(**TURNING))[0], strict=True))
    flat = InertialModel.of(ddagr(), Sensors()).flat
    soil = np.exp(flat.soil_prior.logs(flat.wheel_load)[0])
    at = Reckoned(0.6, 0.35, 1.0, 0.2, -0.01, 0.25, soil, (0.1, 0.2))
    errors = path_errors(RowTurn(run_in=0.5), at, settings.ahead)
    gains = settings.loop.gains
    back = -(gains.proportional + gains.integral * 0.08) * errors.lateral
    back -= settings.course * errors.course_error(settings.side_slip * errors.side_slip)
    expected = 1.25 + np.clip(back, -2.0 / 0.8, 2.0 / 0.8)
    assert inputs["tracker_curvature"] == pytest.approx(0.8 * expected, rel=1e-4)
    banks = np.array(arc_bank_speeds(flat, soil, 0.2, expected, (0.1, 0.2))) / ddagr().maximum_wheel_speed
    np.testing.assert_allclose(view.act(np.zeros((1, 2)), observation(**TURNING))[0], banks, rtol=1e-4)


def test_outputs_bend_and_hasten():
    plain, changed = stood(view_of()), stood(view_of())
    for view in (plain, changed):
        view.observe(observation(**TURNING))
    outer, inner = plain.act(np.zeros((1, 2)), observation(**TURNING))[0]
    more, less = changed.act(np.array([[0.2, 0.0]]), observation(**TURNING))[0]
    assert more > outer
    assert less < inner


def test_memory_goes_back():
    view = stood(view_of())
    seen = observation(**TURNING)
    view.observe(seen)
    saved = view.memory()
    first = [view.act(np.ones((1, 2)), seen), view.observe(seen)]
    for _ in range(5):
        view.observe(seen)
    view.restore(saved)
    np.testing.assert_array_equal(view.act(np.ones((1, 2)), seen), first[0])
    np.testing.assert_array_equal(view.observe(seen), first[1])


def test_it_turns_alone_and_side_by_side_to_the_bit(tmp_path):
    policy = load_policy(save_policy(make_policy(DESIGN), tmp_path / "policy.npz"))
    assert policy.design == DESIGN
    settings = make_settings(soil="thesis_a1", **DESIGN.environment)
    episodes = [settings.draw(np.random.default_rng(seed)) for seed in (0, 1)]
    together = drive_turns(PolicyBatch(policy, 2, silent=True), settings, [3, 4], episodes)
    alone = PolicyController(policy, estimate="feed_forward")
    for seed, episode, run in zip((3, 4), episodes, together, strict=True):
        assert run.success
        for name, values in drive_turn(alone, settings, seed, episode).columns.items():
            np.testing.assert_array_equal(run.columns[name], values)


def test_designs_and_observations_that_do_not_fit_are_one_sentence():
    with pytest.raises(InputError, match="tracker"):
        PolicyDesign(features="path")
    with pytest.raises(InputError, match="tracker"):
        PolicyDesign(tracker=tracker_settings())
    with pytest.raises(InputError, match="path_features"):
        PolicyController(make_policy(DESIGN))(np.zeros(12))
    with pytest.raises(InputError, match="level ground"):
        PolicyController(make_policy(DESIGN), estimate="frozen")
