"""The batch as an SB3 VecEnv."""

import gymnasium
import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="the extra rl is not installed")

from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

from ddagr_gym.envs.registration import TURN_ID
from ddagr_gym.envs.turn_vector_env import TurnVectorEnv
from ddagr_gym.errors import InputError
from ddagr_gym.wrappers.sb3 import TurnVecEnv


def test_endings_carry_the_terminal_observation():
    env = TurnVecEnv(2, max_episode_steps=3)
    env.seed(4)
    first = env.reset()
    twin = TurnVectorEnv(2, max_episode_steps=3, autoreset_mode="SameStep")
    np.testing.assert_array_equal(first, twin.reset(seed=4)[0])
    for _ in range(3):
        observations, rewards, dones, infos = env.step(np.zeros((2, 2), np.float32))
        expected = twin.step(np.zeros((2, 2), np.float32))
    np.testing.assert_array_equal(observations, expected[0])
    assert dones.all()
    assert rewards.dtype == np.float32
    for n, info in enumerate(infos):
        np.testing.assert_array_equal(info["terminal_observation"], expected[4]["final_obs"][n])
        assert info["TimeLimit.truncated"] is True
        assert info["is_success"] is False


def test_ppo_learns_a_few_steps_on_it():
    env = VecNormalize(VecMonitor(TurnVecEnv(4)))
    model = PPO("MlpPolicy", env, n_steps=16, batch_size=32, n_epochs=1, seed=0, device="cpu")
    before = model.policy.action_net.weight.detach().clone()
    model.learn(64)
    assert model.num_timesteps == 64
    assert bool((model.policy.action_net.weight != before).any())


def test_staggered_episodes_end_apart_and_from_then_on_take_their_time():
    env = TurnVecEnv(4, staggered=True, max_episode_steps=8)
    env.seed(1)
    env.reset()
    ends = [np.flatnonzero(env.step(np.zeros((4, 2), np.float32))[2]).tolist() for _ in range(16)]
    assert ends[:8] == [[], [0], [], [1], [], [2], [], [3]]
    assert ends[8:] == ends[:8]


def test_options_reach_the_batch():
    single = gymnasium.make(TURN_ID, radius=1.2)
    single.reset(seed=1)
    env = TurnVecEnv(2)
    env.reset()
    for options in ({"episode": single.unwrapped.episode}, [{"episode": single.unwrapped.episode}] * 2):
        env.set_options(options)
        np.testing.assert_allclose(env.reset()[:, 8], 1.2, rtol=1e-6)
    env.set_options([{"episode": single.unwrapped.episode}, {}])
    with pytest.raises(InputError, match="give a single dictionary"):
        env.reset()


def test_what_the_batch_shares_is_set_and_called_for_all():
    env = TurnVecEnv(3)
    env.set_attr("max_episode_steps", 7, indices=[2, 0, 1])
    assert env.get_attr("max_episode_steps", indices=[1]) == [7]
    for ask in (lambda: env.set_attr("max_episode_steps", 9, indices=0), lambda: env.env_method("reset", indices=[1])):
        with pytest.raises(InputError, match="for the whole batch: give None"):
            ask()
    assert env.get_attr("max_episode_steps") == [7, 7, 7]
