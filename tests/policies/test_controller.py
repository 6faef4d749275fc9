"""Policies as controllers: names, the estimates that ablations tell them, and what they refuse."""

from __future__ import annotations

import math
from dataclasses import replace

import gymnasium
import numpy as np
import pytest

import ddagr_gym  # noqa: F401  registers the ids
from ddagr_gym.control.observation import EKF_FEATURES, OBSERVATION
from ddagr_gym.envs.registration import TURN_EKF_ID, TURN_ID
from ddagr_gym.errors import InputError
from ddagr_gym.parameters import Sensors
from ddagr_gym.policies import shipped
from ddagr_gym.policies.archive import Policy, save_policy
from ddagr_gym.policies.controller import (
    PolicyController,
    is_deployable_policy,
    is_policy_name,
    policy_controller,
    policy_needs_filter,
    policy_title,
)
from ddagr_gym.policies.design import PolicyDesign
from ddagr_gym.policies.estimates import WRONG_LIMIT, WRONG_RATE, FixedSoil, TrueMotion, wrong_prior
from ddagr_gym.policies.view import PolicyView
from ddagr_gym.presets import ddagr

NAMES = [name for name, _, _ in (*OBSERVATION, *EKF_FEATURES)]
SCALES = np.array([scale for _, _, scale in (*OBSERVATION, *EKF_FEATURES)])


def make_policy(design):
    """Outputs tanh of a few inputs: not zero, and not of training."""
    rng = np.random.default_rng(0)
    size = len(design.inputs)
    return Policy(
        design=design,
        weights=(rng.normal(0, 0.1, (2, size)).astype(np.float32),),
        biases=(np.zeros(2, dtype=np.float32),),
        mean=np.zeros(size),
        deviation=np.ones(size),
        squashed=True,
        training={"algorithm": "ppo", "seed": 0, "steps": 1, "digest": "", "version": "0"},
    )


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Stands for the folder of the trained policies."""
    for name, design in {
        "ppo_ekf": PolicyDesign(),
        "ppo_raw": PolicyDesign(features="raw"),
        "ppo_history": PolicyDesign(features="raw", frames=3),
        "ppo_bold": PolicyDesign(action="absolute"),
    }.items():
        save_policy(make_policy(design), tmp_path / name / "policy.npz")
    monkeypatch.setattr(shipped, "policies_dir", lambda: tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def drive():
    """Observations and infos of a turn to the left by fixed bank speeds."""
    env = gymnasium.make(TURN_EKF_ID, soil="thesis_a1", side="left", randomisation=False, info_level="full")
    seen = [env.reset(seed=1)]
    for step in range(120):
        action = np.array([0.36, 0.36] if step < 30 else [0.72, 0.06], np.float32)
        observation, _, _, _, info = env.step(action)
        seen.append((observation, info))
    return seen


def told(estimate, drive):
    """What an estimate makes of a drive, in SI units by name, each (T,)."""
    estimate.reset()
    values = np.array([estimate(observation, info) for observation, info in drive]) * SCALES
    return dict(zip(NAMES, values.T, strict=True))


def test_names(folder):
    assert shipped.policy_names() == ("ppo_bold", "ppo_ekf", "ppo_history", "ppo_raw")
    save_policy(make_policy(PolicyDesign()), folder / "ppo_ekf" / "seeds" / "seed_3.npz")
    assert shipped.policy_names()[-1] == "ppo_ekf_seed_3"
    assert shipped.selected_policies() == ("ppo_bold", "ppo_ekf", "ppo_history", "ppo_raw")
    assert is_policy_name("ppo_ekf_seed_3@frozen")
    assert policy_controller("ppo_ekf_seed_3").policy.design == PolicyDesign()
    assert policy_needs_filter("ppo_ekf@frozen")
    assert not policy_needs_filter("ppo_history")
    assert not is_deployable_policy("ppo_ekf@true")
    assert is_deployable_policy("ppo_ekf@wrong")
    assert is_policy_name("ppo_raw")
    assert is_policy_name("elsewhere/at@home/policy.npz")
    assert not is_policy_name("B4")
    path = str(folder / "ppo_raw" / "policy.npz")
    assert policy_controller(path).policy.design == PolicyDesign(features="raw")
    assert "@" not in policy_controller(f"{folder / 'ppo_ekf' / 'policy.npz'}@frozen").policy.training["digest"]


def test_a_file_that_was_trained_anew_is_read_anew(tmp_path):
    file = save_policy(make_policy(PolicyDesign()), tmp_path / "policy.npz")
    first = shipped.find_policy(str(file))
    assert shipped.find_policy(str(file)) is first
    save_policy(replace(make_policy(PolicyDesign()), training={**first.training, "seed": 7}), file)
    assert shipped.find_policy(str(file)).training["seed"] == 7


def test_titles_tell_the_arms_apart(folder):
    names = ["ppo_raw", "ppo_history", "ppo_bold", "ppo_ekf", "ppo_ekf@frozen", "ppo_ekf@wrong", "ppo_ekf@true"]
    assert len({policy_title(name) for name in names}) == len(names)


@pytest.mark.parametrize(
    ("name", "complaint"),
    [
        ("ppo_ekg", "ppo_ekf"),
        ("ppo_ekf@frosen", "frozen"),
        ("ppo_raw@true", "does not see the filter"),
        ("nowhere.npz", "no such policy file"),
    ],
)
def test_names_that_mean_nothing(folder, name, complaint):
    with pytest.raises(InputError, match=complaint):
        policy_controller(name)


def test_observations_of_another_environment_are_refused(folder):
    observation, _ = gymnasium.make(TURN_ID).reset(seed=0)
    policy_controller("ppo_raw")(observation)
    with pytest.raises(InputError, match=TURN_EKF_ID):
        policy_controller("ppo_ekf")(observation)


def test_a_controller_is_view_and_network_and_forgets(drive):
    policy = make_policy(PolicyDesign())
    controller, view = PolicyController(policy), PolicyView(policy.design, ddagr(), Sensors())
    driven = []
    for _ in range(2):
        controller.reset()
        view.reset()
        driven.append([controller(observation, info) for observation, info in drive[:20]])
        for (observation, _), action in zip(drive[:20], driven[-1], strict=True):
            expected = view.act(policy(view.observe(observation[None])), observation[None])[0]
            np.testing.assert_array_equal(action, expected)
    np.testing.assert_array_equal(driven[0], driven[1])
    assert np.std(driven[0], axis=0).min() > 0.0


def test_a_silenced_policy_is_the_feed_forward(drive):
    for design in (PolicyDesign(), PolicyDesign(features="raw")):
        size = design.observation_size
        silenced = PolicyController(make_policy(design), estimate="feed_forward")
        zero = replace(make_policy(design), weights=(np.zeros((2, len(design.inputs)), np.float32),))
        other = PolicyController(zero)
        for observation, info in drive[:60]:
            np.testing.assert_array_equal(silenced(observation[:size], info), other(observation[:size], info))
        assert silenced(drive[60][0][:size])[0] > 0.1


def test_the_live_filter_learns_and_the_held_one_does_not(drive):
    live = dict(zip(NAMES, (np.array([observation for observation, _ in drive]) * SCALES).T, strict=True))
    frozen = told(FixedSoil(ddagr(), Sensors()), drive)
    logs = [name for name in NAMES if name.startswith("log_")]
    deviations = [f"deviation_{name}" for name in logs]
    for name in logs:
        assert np.abs(frozen[name]).max() < 1e-3
    for name in deviations:
        np.testing.assert_allclose(frozen[name], frozen[name][0], rtol=1e-2)
        assert frozen[name][0] == pytest.approx(live[name][0], rel=1e-6)
    assert max(np.abs(live[name][-1]) for name in logs) > 0.05
    assert live["deviation_log_traction_rate"][-1] < 0.9 * frozen["deviation_log_traction_rate"][-1]
    # it still follows speed and yaw rate
    assert frozen["estimated_v_x"][-1] == pytest.approx(drive[-1][1]["true_v_x"], rel=0.15)
    assert frozen["estimated_yaw_rate"][-1] == pytest.approx(drive[-1][1]["true_yaw_rate"], rel=0.05)


def test_the_wrong_soil_is_wrong_and_held(drive):
    wrong = told(FixedSoil(ddagr(), Sensors(), wrong_prior()), drive)
    np.testing.assert_allclose(wrong["log_traction_limit"], math.log(WRONG_LIMIT), atol=1e-3)
    np.testing.assert_allclose(wrong["log_traction_rate"], math.log(WRONG_RATE), atol=1e-3)


def test_the_true_motion_is_the_simulators(drive):
    true = told(TrueMotion(), drive)
    np.testing.assert_allclose(true["estimated_v_x"], [info["true_v_x"] for _, info in drive], atol=1e-6)
    np.testing.assert_allclose(true["estimated_yaw_rate"], [info["true_yaw_rate"] for _, info in drive], atol=1e-6)
    slip = drive[-1][1]["true_slip_ratio"]
    assert true["estimated_slip_right"][-1] == pytest.approx((slip[0] + slip[2]) / 2, abs=1e-6)
    assert true["estimated_slip_left"][-1] == pytest.approx((slip[1] + slip[3]) / 2, abs=1e-6)
    observed = dict(zip(NAMES, drive[-1][0] * SCALES, strict=True))
    assert true["log_traction_limit"][-1] == pytest.approx(observed["log_traction_limit"])


def test_ablations_say_what_they_need(drive):
    for estimate in (FixedSoil(ddagr(), Sensors()), TrueMotion()):
        for info in (None, {"ending": 0}):
            with pytest.raises(InputError, match="full"):
                estimate(drive[0][0], info)
