"""The filter's features: one result through constructor, id, batch and wrapper."""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import ddagr_gym  # noqa: F401  registers the ids
from ddagr_gym.control.observation import EKF_FEATURES, OBSERVATION
from ddagr_gym.envs.registration import TURN_EKF_ID, TURN_ID
from ddagr_gym.errors import InputError
from ddagr_gym.wrappers.ekf import EKFObservation

NAMES = [name for name, _, _ in (*OBSERVATION, *EKF_FEATURES)]
SCALES = np.array([scale for _, _, scale in (*OBSERVATION, *EKF_FEATURES)])


def actions(steps, count):
    return np.random.default_rng(0).uniform(-0.2, 0.8, (steps, count, 2)).astype(np.float32)


def test_checker_finds_nothing():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make(TURN_EKF_ID).unwrapped, skip_render_check=True)


def test_wrapper_equals_the_composed_id():
    composed = gymnasium.make(TURN_EKF_ID)
    wrapped = EKFObservation(gymnasium.make(TURN_ID, info_level="full"))
    assert wrapped.observation_space == composed.observation_space
    for seed in (3, 4):
        np.testing.assert_array_equal(composed.reset(seed=seed)[0], wrapped.reset(seed=seed)[0])
        for action in actions(30, 1)[:, 0]:
            np.testing.assert_array_equal(composed.step(action)[0], wrapped.step(action)[0])


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_batch_equals_single_environments(mode):
    single = SyncVectorEnv([lambda: gymnasium.make(TURN_EKF_ID, max_episode_steps=12)] * 3, autoreset_mode=mode)
    native = gymnasium.make_vec(TURN_EKF_ID, num_envs=3, max_episode_steps=12, autoreset_mode=mode)
    np.testing.assert_array_equal(single.reset(seed=1)[0], native.reset(seed=1)[0])
    for action in actions(40, 3):
        np.testing.assert_array_equal(single.step(action)[0], native.step(action)[0])


def test_the_inertial_filter_is_an_option_of_id_batch_and_wrapper():
    composed = gymnasium.make(TURN_EKF_ID, filter="inertial")
    wrapped = EKFObservation(gymnasium.make(TURN_ID, info_level="full"), filter="inertial")
    native = gymnasium.make_vec(TURN_EKF_ID, num_envs=1, filter="inertial")
    flat = gymnasium.make(TURN_EKF_ID)
    flat.reset(seed=3)
    first = composed.reset(seed=3)[0]
    np.testing.assert_array_equal(first, wrapped.reset(seed=3)[0])
    np.testing.assert_array_equal(first, native.reset(seed=3)[0][0])
    for action in actions(40, 1)[:, 0]:
        seen, other = composed.step(action)[0], flat.step(action)[0]
        np.testing.assert_array_equal(seen, wrapped.step(action)[0])
        np.testing.assert_array_equal(seen, native.step(action[None])[0][0])
    np.testing.assert_array_equal(seen[:12], other[:12])
    assert not np.array_equal(seen[12:], other[12:])


def test_filters_that_cannot_be_are_one_sentence():
    with pytest.raises(InputError, match="'inertial'"):
        gymnasium.make(TURN_EKF_ID, filter="inertail")
    with pytest.raises(InputError, match="ekf_features"):
        gymnasium.make(TURN_ID, filter="inertial")


@pytest.mark.parametrize("filter", ["flat", "inertial", "learned"])
def test_features_follow_the_truth(filter):
    env = gymnasium.make(
        TURN_EKF_ID, soil="thesis_a1", randomisation=False, info_level="full", side="left", filter=filter
    )
    env.reset(seed=0)
    for _ in range(120):
        observation, *_, info = env.step(np.array([0.70, 0.10], np.float32))
    seen = dict(zip(NAMES, observation * SCALES, strict=True))
    radius = np.hypot(info["true_v_x"], info["true_v_y"]) / info["true_yaw_rate"]
    assert seen["estimated_v_x"] / seen["estimated_yaw_rate"] == pytest.approx(radius, rel=0.05)
    assert seen["estimated_slip_right"] == pytest.approx(info["true_slip_ratio"][0], abs=0.03)
    assert seen["estimated_slip_left"] == pytest.approx(info["true_slip_ratio"][1], abs=0.06)
    assert seen["deviation_log_traction_limit"] > 0.0


def test_a_reset_forgets():
    env = gymnasium.make(TURN_EKF_ID)
    first, _ = env.reset(seed=2)
    for action in actions(20, 1)[:, 0]:
        env.step(action)
    again, _ = env.reset(seed=2)
    np.testing.assert_array_equal(first, again)


def test_samples_are_needed():
    with pytest.raises(InputError, match="full"):
        EKFObservation(gymnasium.make(TURN_ID)).reset(seed=0)


def test_the_old_name_says_the_new_one():
    from ddagr_gym.wrappers import ekf

    with pytest.warns(DeprecationWarning, match="EKFObservation"):
        assert ekf.EkfFeatures is EKFObservation


STARTS = {
    "at once": [0.6] * 43,
    "after standing": [0.0] * 3 + [0.6] * 40,
    "backwards": [-0.6] * 43,
    "slowly": [0.25] * 60,
}
"""Actions of both sides."""


@pytest.mark.parametrize("name", ["inertial", "learned"])
@pytest.mark.parametrize("start", STARTS)
def test_a_hard_start_does_not_mislead_the_filter(name, start):
    """Straight on, on soils of the default range: the robot is nearly as fast as its rims."""
    environment = gymnasium.make(TURN_EKF_ID, filter=name, info_level="full")
    speed = NAMES.index("estimated_v_x")
    for seed in range(12):
        environment.reset(seed=seed)
        for command in STARTS[start]:
            observation, *_, info = environment.step(np.full(2, command, dtype=np.float32))
        assert SCALES[speed] * observation[speed] == pytest.approx(info["true_v_x"], abs=0.03), seed
    environment.close()
