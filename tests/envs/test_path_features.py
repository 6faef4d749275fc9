"""Estimated pose and path errors in the observation: one result everywhere, B6's pose, and the truth nearby."""

import gymnasium
import numpy as np
import pytest

import ddagr_gym  # noqa: F401  registers the ids
from ddagr_gym.control.observation import EKF_FEATURES, OBSERVATION, PATH_FEATURES
from ddagr_gym.control.path_tracker import path_errors
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.control.tracker_settings import SETTLING
from ddagr_gym.envs.options import make_settings
from ddagr_gym.envs.registration import TURN_EKF_ID, TURN_ID
from ddagr_gym.envs.turn_vector_env import TurnVectorEnv
from ddagr_gym.errors import InputError
from ddagr_gym.estimation import DeadReckoning
from ddagr_gym.evaluation.controllers import find_controller, inertial_model
from ddagr_gym.wrappers.ekf import EKFObservation

OPTIONS = {"filter": "inertial", "path_features": True}
ENTRIES = (*OBSERVATION, *EKF_FEATURES, *PATH_FEATURES)
NAMES, SCALES = [name for name, _, _ in ENTRIES], np.array([scale for _, _, scale in ENTRIES])


def test_id_batch_and_wrapper_agree_to_the_bit():
    composed = gymnasium.make(TURN_EKF_ID, **OPTIONS)
    wrapped = EKFObservation(gymnasium.make(TURN_ID, info_level="full"), **OPTIONS)
    native = TurnVectorEnv(3, ekf_features=True, **OPTIONS)
    assert wrapped.observation_space == composed.observation_space
    for seed in (4, 5):
        first = composed.reset(seed=seed)[0]
        np.testing.assert_array_equal(first, wrapped.reset(seed=seed)[0])
        np.testing.assert_array_equal(first, native.reset(seed=seed - 1)[0][1])
        for action in np.random.default_rng(0).uniform(-0.2, 0.8, (30, 2)).astype(np.float32):
            seen = composed.step(action)[0]
            np.testing.assert_array_equal(seen, wrapped.step(action)[0])
            np.testing.assert_array_equal(seen, native.step(np.tile(action, (3, 1)))[0][1])
    assert seen.shape == (len(NAMES),)


def driven(seed=0, **options):
    """Observations in SI units and infos of a turn by B6."""
    env = gymnasium.make(TURN_EKF_ID, info_level="full", side="left", **OPTIONS, **options)
    observation, info = env.reset(seed=seed)
    controller, found = find_controller("B6", RowTurn(run_in=0.5)), []
    ended = False
    while not ended:
        observation, _, terminated, truncated, info = env.step(controller(observation, info))
        ended = terminated or truncated
        found.append((dict(zip(NAMES, (observation * SCALES).tolist(), strict=True)), info))
    return found


def test_the_pose_is_that_by_which_the_path_tracker_steers():
    reckoning = DeadReckoning(inertial_model(), SETTLING)
    reckoning.reset(-0.5, 0.0, 0.0)
    for seen, info in driven():
        at = reckoning.update(info["command"], info["samples"])
        expected = [at.x, at.y, at.yaw, at.v_y, *at.gravity]
        np.testing.assert_allclose([seen[name] for name, _, _ in PATH_FEATURES[:6]], expected, rtol=1e-6, atol=1e-6)
        errors = path_errors(RowTurn(run_in=0.5), at)
        assert seen["cross_track_error"] == pytest.approx(np.clip(errors.lateral, -1.0, 1.0), abs=1e-6)
        assert seen["course_error"] == pytest.approx(errors.course_error(errors.side_slip), abs=1e-5)
        assert seen["path_to_go"] == pytest.approx(errors.to_go, abs=1e-5)


def test_entries_follow_the_truth_on_a_slope():
    turn = RowTurn(run_in=0.5)
    for seen, info in driven(soil="thesis_a1", effects=[{"name": "slope", "parameters": {"angle": 0.03}}])[60::20]:
        _, lateral = turn.project(info["true_x"], info["true_y"])
        assert seen["cross_track_error"] == pytest.approx(float(lateral), abs=0.06)
        assert seen["estimated_yaw"] == pytest.approx(info["true_yaw"], abs=0.1)
        pull = -9.81 * np.sin(0.03) * np.array([np.cos(info["true_yaw"]), -np.sin(info["true_yaw"])])
        np.testing.assert_allclose([seen["gravity_x"], seen["gravity_y"]], pull, atol=0.12)
        assert seen["path_curvature"] in (0.0, pytest.approx(1.25))


def test_entries_are_mirrored_with_the_turn():
    """A robot at rest at the start of a turn to either side."""
    for side in ("left", "right"):
        env = gymnasium.make(TURN_EKF_ID, side=side, **OPTIONS)
        seen = dict(zip(NAMES, env.reset(seed=0)[0] * SCALES, strict=True))
        assert seen["estimated_x"] == pytest.approx(-0.5)
        assert seen["path_to_go"] == pytest.approx(0.5 + np.pi * 0.8, abs=1e-5)
        assert (seen["cross_track_error"], seen["course_error"], seen["path_curvature"]) == (0.0, 0.0, 0.0)


def test_path_features_need_the_inertial_filter():
    for options in ({}, {"ekf_features": True}, {"ekf_features": True, "filter": "learned"}):
        with pytest.raises(InputError, match="inertial"):
            make_settings(path_features=True, **options)
    with pytest.raises(InputError, match="inertial"):
        EKFObservation(gymnasium.make(TURN_ID, info_level="full"), path_features=True)
