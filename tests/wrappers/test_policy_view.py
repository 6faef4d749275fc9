"""The policy's view as a wrapper of SB3's environment."""

import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="the extra rl is not installed")

from ddagr_gym.policies.design import PolicyDesign
from ddagr_gym.policies.view import PolicyView
from ddagr_gym.wrappers.policy_view import PolicyViewVecEnv
from ddagr_gym.wrappers.sb3 import TurnVecEnv

DESIGN = PolicyDesign(features="raw", frames=2)


def make(steps):
    env = PolicyViewVecEnv(TurnVecEnv(2, max_episode_steps=steps), DESIGN)
    env.seed(3)
    return env


def test_inputs_and_actions_are_those_of_the_view():
    env, twin = make(50), TurnVecEnv(2, max_episode_steps=50)
    view = PolicyView(DESIGN, twin.env.settings.robot, twin.env.settings.sensors, 2)
    twin.seed(3)
    seen = twin.reset()
    np.testing.assert_array_equal(env.reset(), view.observe(seen))
    outputs = np.random.default_rng(0).uniform(-1, 1, (8, 2, 2)).astype(np.float32)
    for output in outputs:
        inputs, rewards, _, _ = env.step(output)
        seen, expected, _, _ = twin.step(view.act(output, seen))
        np.testing.assert_array_equal(inputs, view.observe(seen))
        np.testing.assert_array_equal(rewards, expected)
    assert inputs.shape == (2, len(DESIGN.inputs))
    assert env.observation_space.contains(inputs[0])


def test_an_ending_shows_the_old_memory_last_and_then_none():
    env = make(3)
    env.reset()
    correction = DESIGN.inputs.index("correction_0")
    for _ in range(3):
        inputs, _, dones, infos = env.step(np.ones((2, 2), np.float32))
    assert dones.all()
    for n in range(2):
        assert infos[n]["terminal_observation"].shape == (len(DESIGN.inputs),)
        assert infos[n]["terminal_observation"][correction] == pytest.approx(3 * DESIGN.rate_limit)
        assert inputs[n, correction] == 0.0
        run_in = DESIGN.inputs.index("run_in_to_go")
        assert inputs[n, run_in] == pytest.approx(0.5 / 0.8)


def test_state_goes_back():
    env = make(50)
    env.reset()
    env.step(np.ones((2, 2), np.float32))
    saved = env.state()
    first = env.view.act(np.ones((2, 2)), env._seen)
    env.step(np.ones((2, 2), np.float32))
    env.restore(saved)
    np.testing.assert_array_equal(env.view.act(np.ones((2, 2)), env._seen), first)
