"""What other libraries ask of every environment: checkers, copies, specifications as JSON, CleanRL's wrappers."""

import functools
import pickle
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium import wrappers
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv

import ddagr_gym  # noqa: F401  registers the ids
from ddagr_gym.envs import Randomisation, RewardWeights
from ddagr_gym.envs.options import make_settings
from ddagr_gym.envs.registration import TURN_EKF_ID, TURN_ID
from ddagr_gym.errors import InputError
from ddagr_gym.parameters import Imu, Numerics, Sensors
from ddagr_gym.physics.effects import load_effects
from ddagr_gym.physics.soil_draws import get_distribution
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.wrappers.ekf import EKFObservation

IDS = sorted(name for name in gymnasium.registry if name.startswith("DDAGR"))


def filtered(filter="flat", **arguments):
    return EKFObservation(gymnasium.make(TURN_ID, info_level="full", **arguments), filter=filter)


MAKERS = [
    *(pytest.param(functools.partial(gymnasium.make, name), id=name) for name in IDS),
    pytest.param(functools.partial(gymnasium.make, TURN_EKF_ID, filter="inertial", info_level="full"), id="inertial"),
    pytest.param(filtered, id="wrapped"),
    pytest.param(functools.partial(filtered, "inertial"), id="wrapped-inertial"),
    pytest.param(functools.partial(gymnasium.make, TURN_EKF_ID, filter="learned", info_level="full"), id="learned"),
]


def remade(env):
    return gymnasium.make(EnvSpec.from_json(env.spec.to_json()))


def assert_drive_alike(one, other):
    for action in np.random.default_rng(0).uniform(-0.2, 0.8, (5, 2)).astype(np.float32):
        np.testing.assert_array_equal(one.step(action)[0], other.step(action)[0])


def test_all_ids_are_tried():
    assert set(IDS) == {TURN_ID, TURN_EKF_ID}


@pytest.mark.parametrize("make", MAKERS)
def test_gymnasium_finds_nothing(make):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # the checker asks for the environment without wrappers, and these are to be checked too
        warnings.filterwarnings("ignore", message=".*is different from the unwrapped version.*")
        check_env(make(), skip_render_check=True)


@pytest.mark.parametrize("make", MAKERS)
def test_sb3_finds_nothing(make):
    sb3 = pytest.importorskip("stable_baselines3.common.env_checker", reason="the extra rl is not installed")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sb3.check_env(make(), warn=True, skip_render_check=True)


@pytest.mark.parametrize("make", MAKERS)
def test_a_copy_through_pickle_goes_on_alike(make):
    env = make()
    env.reset(seed=3)
    env.step(np.array([0.5, 0.3], np.float32))
    assert_drive_alike(env, pickle.loads(pickle.dumps(env)))


@pytest.mark.parametrize("make", MAKERS)
def test_an_environment_is_made_again_from_json(make):
    env = make()
    again = remade(env)
    np.testing.assert_array_equal(env.reset(seed=3)[0], again.reset(seed=3)[0])
    assert_drive_alike(env, again)


@pytest.mark.parametrize(
    "arguments",
    [
        {"radius": (0.65, 1.2), "speed": (0.16, 0.3)},
        {"robot": get_robot("husky"), "soil": get_soil("firm_ground")},
        {"soil": get_distribution("field")},
        {"randomisation": Randomisation(mass=0.1), "reward": RewardWeights(progress=1.0)},
        {"sensors": Sensors(imu=Imu(gyro_bias=0.01)), "numerics": Numerics(section_nodes=16)},
        {"effects": ("slope=0.05", "towed_drag=40")},
        {"effects": [{"name": "slope", "parameters": {"angle": 0.05}}]},
    ],
    ids=lambda arguments: "-".join(arguments),
)
def test_arguments_survive_json(arguments):
    env = gymnasium.make(TURN_ID, **arguments)
    assert env.unwrapped.settings != make_settings()
    assert remade(env).unwrapped.settings == env.unwrapped.settings


def test_an_effect_without_its_name_is_one_sentence():
    env = gymnasium.make(TURN_ID, effects=load_effects("slope=0.05"))
    with pytest.raises(InputError, match=r"\{'angle': 0\.05.*without its name"):
        remade(env)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"soil": {"cohesion": 3.0}}, r"soil: .*missing"),
        ({"robot": {"naem": "x"}}, r"robot: unknown key 'naem'.*'name'"),
        ({"reward": {"progress": "much"}}, r"reward: progress is 'much'"),
        ({"radius": [0.7, 0.8, 0.9]}, "low, high"),
    ],
)
def test_fields_that_do_not_fit_are_one_sentence(arguments, words):
    with pytest.raises(InputError, match=words) as caught:
        gymnasium.make(TURN_ID, **arguments)
    assert "\n" not in str(caught.value)


def cleanrl_environment(name):
    """As ``make_env`` of CleanRL's ``ppo_continuous_action.py``."""
    env = wrappers.RecordEpisodeStatistics(wrappers.FlattenObservation(gymnasium.make(name, max_episode_steps=6)))
    env = wrappers.NormalizeObservation(wrappers.ClipAction(env))
    env = wrappers.TransformObservation(env, lambda seen: np.clip(seen, -10, 10), env.observation_space)
    return wrappers.TransformReward(wrappers.NormalizeReward(env, gamma=0.99), lambda reward: np.clip(reward, -10, 10))


@pytest.mark.parametrize("name", IDS)
@pytest.mark.parametrize("vector", [SyncVectorEnv, AsyncVectorEnv])
def test_cleanrl_drives_it(name, vector):
    envs = vector([functools.partial(cleanrl_environment, name)] * 2)
    try:
        observed, _ = envs.reset(seed=1)
        ended = 0
        for action in np.random.default_rng(0).uniform(-2, 2, (8, 2, 2)).astype(np.float32):
            observed, reward, _, truncated, info = envs.step(action)
            ended += int(truncated.sum())
            assert ("episode" in info) == truncated.any()
        assert ended == 2
        assert np.isfinite(observed).all()
        assert np.isfinite(reward).all()
    finally:
        envs.close()
