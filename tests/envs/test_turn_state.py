"""A batch goes on from a saved state to the bit, in a fresh batch too."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from ddagr_gym.envs.turn_state import restore_state, save_state
from ddagr_gym.envs.turn_vector_env import TurnVectorEnv
from ddagr_gym.errors import InputError


def drive(env, steps, seed):
    rng = np.random.default_rng(seed)
    seen = []
    for _ in range(steps):
        observations, rewards, terminated, truncated, _ = env.step(rng.uniform(-0.2, 0.8, (3, 2)).astype(np.float32))
        seen += [observations, rewards, terminated, truncated]
    return seen


@pytest.mark.parametrize("options", [{}, {"ekf_features": True}, {"ekf_features": True, "filter": "inertial"},
                                     {"ekf_features": True, "filter": "learned"},
                                     {"ekf_features": True, "filter": "inertial", "path_features": True}])  # fmt: skip
def test_a_fresh_batch_goes_on_to_the_bit(options):
    arguments = {"num_envs": 3, "max_episode_steps": 12, "autoreset_mode": "SameStep", **options}
    env = TurnVectorEnv(**arguments)
    env.reset(seed=1)
    drive(env, 17, 0)
    saved = pickle.loads(pickle.dumps(save_state(env)))
    expected = drive(env, 20, 5)  # over an ending, so that new episodes are drawn too
    twin = TurnVectorEnv(**arguments)
    restore_state(twin, saved)
    for first, second in zip(expected, drive(twin, 20, 5), strict=True):
        np.testing.assert_array_equal(first, second)


def test_later_steps_do_not_change_what_was_saved():
    env = TurnVectorEnv(3)
    env.reset(seed=1)
    saved = save_state(env)
    first = drive(env, 3, 0)
    restore_state(env, saved)
    second = drive(env, 3, 0)
    restore_state(env, saved)
    third = drive(env, 3, 0)
    for one, two, three in zip(first, second, third, strict=True):
        np.testing.assert_array_equal(one, two)
        np.testing.assert_array_equal(one, three)


def test_other_batches_are_refused():
    env = TurnVectorEnv(2)
    with pytest.raises(InputError, match="reset"):
        save_state(env)
    env.reset(seed=1)
    with pytest.raises(InputError, match="2 environments"):
        restore_state(TurnVectorEnv(3), save_state(env))
    with pytest.raises(InputError, match="not alike"):
        restore_state(TurnVectorEnv(2, ekf_features=True), save_state(env))
    env = TurnVectorEnv(2, ekf_features=True)
    env.reset(seed=1)
    with pytest.raises(InputError, match="filter"):
        restore_state(TurnVectorEnv(2, ekf_features=True, filter="inertial"), save_state(env))
