"""The environment's contract: conformance, determinism, endings, observation, bad input."""

import dataclasses
import math
import pickle
import subprocess
import sys
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import ddagr_gym  # noqa: F401  registers the ids
from ddagr_gym.control.constant_speeds import ConstantSpeeds
from ddagr_gym.control.observation import OBSERVATION, decode
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.envs import Episode, Randomisation
from ddagr_gym.envs.registration import TURN_ID, register_environments
from ddagr_gym.envs.turn_kernel import TERMS
from ddagr_gym.errors import InputError, InputWarning
from ddagr_gym.evaluation.calibration import calibrate_constant_speeds
from ddagr_gym.parameters import Imu, Sensors, Soil
from ddagr_gym.physics import layout
from ddagr_gym.presets import get_robot, get_soil


def make(**arguments):
    return gymnasium.make(TURN_ID, **arguments)


def assert_same(a, b):
    """Equal to the bit, nested dictionaries included."""
    if isinstance(a, dict):
        assert a.keys() == b.keys()
        for key in a:
            assert_same(a[key], b[key])
    else:
        np.testing.assert_array_equal(a, b)
        assert type(a) is type(b)


@pytest.fixture(scope="module")
def nominal_controller() -> ConstantSpeeds:
    return calibrate_constant_speeds(get_robot("ddagr"), get_soil("thesis_a1"), RowTurn())


@pytest.mark.parametrize("level", ["small", "full"])
def test_gymnasium_checker_finds_nothing(level):
    env = make(info_level=level, render_mode=None)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped, skip_render_check=True)
    env.close()


def test_sb3_checker_finds_nothing():
    sb3 = pytest.importorskip("stable_baselines3.common.env_checker", reason="the extra rl is not installed")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sb3.check_env(make().unwrapped, warn=True, skip_render_check=True)


def test_registration_is_idempotent_and_by_module_name():
    register_environments()
    register_environments()
    assert isinstance(gymnasium.make(f"ddagr_gym:{TURN_ID}").unwrapped, gymnasium.Env)


def rollout(seed, level="full", steps=60):
    env = make(info_level=level)
    trace = [env.reset(seed=seed)]
    actions = np.random.default_rng(seed).uniform(-1, 1, (steps, 2)).astype(np.float32)
    trace += [env.step(action) for action in actions]
    return trace


def test_same_seed_gives_the_same_bits():
    for a, b in zip(rollout(7), rollout(7), strict=True):
        for left, right in zip(a, b, strict=True):
            assert_same(left, right)


def test_other_seed_gives_another_episode():
    first, second = rollout(1, steps=3), rollout(2, steps=3)
    assert not np.array_equal(first[-1][4]["true_soil"], second[-1][4]["true_soil"])


def test_a_second_reset_continues_the_stream_of_the_seed():
    env = make(info_level="full")
    env.reset(seed=3)
    _, first = env.reset()
    _, second = env.reset()
    env.reset(seed=3)
    _, again = env.reset()
    assert_same(first, again)
    assert not np.array_equal(first["true_soil"], second["true_soil"])


def test_observation_is_new_and_has_documented_entries():
    env = make()
    first, info = env.reset(seed=0)
    assert first.dtype == np.float32
    assert first.shape == (len(OBSERVATION),)
    second, *_, info_2 = env.step(np.zeros(2, np.float32))
    assert first is not second
    assert info is not info_2
    assert all(name in env.unwrapped.__doc__ for name, _, _ in OBSERVATION)


def test_observation_means_the_raw_block():
    env = make(info_level="full")
    env.reset(seed=0)
    for _ in range(20):
        observation, *_, info = env.step(np.array([0.5, 0.3], np.float32))
    seen = decode(observation)
    mean = info["samples"].mean(axis=0)
    np.testing.assert_allclose(seen[:5], mean, rtol=1e-6, atol=1e-6)
    assert info["samples"].shape == (10, 5)
    np.testing.assert_allclose(info["command"], [1.0, 0.6], rtol=1e-6)


def test_heading_to_go_follows_the_gyro_and_the_side():
    for side, sign in (("left", 1.0), ("right", -1.0)):
        env = make(side=side, info_level="full", randomisation=False)
        observation, _ = env.reset(seed=0)
        assert decode(observation).heading_to_go == pytest.approx(math.pi, rel=1e-6)
        for _ in range(50):
            observation, *_, info = env.step(np.array([0.5 + 0.3 * sign, 0.5 - 0.3 * sign], np.float32))
        turned = sign * info["true_yaw"]
        assert turned > 0.2
        assert decode(observation).heading_to_go == pytest.approx(math.pi - turned, abs=0.01)


def test_run_in_counts_down_by_the_nominal_tyre_whatever_the_true_one_is():
    env = make(soil="thesis_a1", side="left", randomisation=False)
    env.reset(seed=0)
    episode = env.unwrapped.episode
    wheels = tuple(dataclasses.replace(w, major_radius=1.1 * w.major_radius) for w in episode.robot.wheels)
    worn = dataclasses.replace(episode, robot=dataclasses.replace(episode.robot, wheels=wheels))
    observation, _ = env.reset(seed=0, options={"episode": worn})
    rolled = 0.0
    for _ in range(10):
        observation, *_ = env.step(np.full(2, 0.36, np.float32))
        seen = decode(observation)
        rolled += 0.08 * (seen.encoder_right + seen.encoder_left) / 2.0
    assert seen.run_in_to_go == pytest.approx(0.5 - rolled * get_robot("ddagr").outer_radius, abs=1e-5)


def test_run_in_counts_down_with_the_encoders():
    env = make(randomisation=False, info_level="full", run_in=0.6)
    observation, _ = env.reset(seed=0)
    assert decode(observation).run_in_to_go == pytest.approx(0.6)
    while decode(observation).run_in_to_go > 0:
        observation, *_, info = env.step(np.array([0.36, 0.36], np.float32))
    # the wheels slip by about a percent, so the robot is a little short of the boundary
    assert -0.02 < info["true_x"] < 0.02


def drive(env, controller, **reset):
    observation, _ = env.reset(**reset)
    total = 0.0
    while True:
        observation, reward, terminated, truncated, info = env.step(controller(observation))
        total += reward
        if terminated or truncated:
            return total, terminated, truncated, info


@pytest.mark.parametrize("side", ["left", "right"])
def test_calibrated_turn_reaches_the_next_row(side, nominal_controller):
    env = make(soil="thesis_a1", side=side, randomisation=False)
    total, terminated, truncated, info = drive(env, nominal_controller, seed=0)
    assert terminated
    assert not truncated
    assert info["ending"] == 1
    assert info["success"] is True
    assert abs(info["exit_lateral_error"]) < 0.03
    assert total > 5.0


def test_success_is_what_the_metrics_say(nominal_controller):
    from ddagr_gym.control.row_turn import wheels_fit_furrow

    env = make(soil="thesis_a1", side="left", randomisation=False)
    outcomes = set()
    for inner in (nominal_controller.inner, 0.35):  # the faster inner bank widens the turn
        controller = dataclasses.replace(nominal_controller, inner=inner)
        *_, info = drive(env, controller, seed=0)
        fits = wheels_fit_furrow(info["exit_lateral_error"], info["exit_heading_error"], 0.33)
        assert info["success"] == fits
        outcomes.add(fits)
    assert outcomes == {True, False}


def test_ending_3_off_the_headland():
    env = make(randomisation=False)
    *_, info = drive(env, lambda _: np.array([1.0, 1.0], np.float32), seed=0)
    assert info["ending"] == 3


def test_ending_2_bogged():
    slurry = Soil(500.0, 0.05, 1.0, 0.0, 2.0e4, 0.02, 0.4, 0.15, 0.3)
    env = make(soil=slurry, randomisation=False)
    env.reset(seed=0)
    *_, terminated, _, info = env.step(np.zeros(2, np.float32))
    assert terminated
    assert info["ending"] == 2


def test_time_truncates():
    env = make(randomisation=False)
    _, terminated, truncated, info = drive(env, lambda _: np.zeros(2, np.float32), seed=0)
    assert truncated
    assert not terminated
    assert info["ending"] == 0


def test_reward_is_the_weighted_sum_of_its_named_terms():
    env = make(info_level="full")
    env.reset(seed=4)
    weights = dataclasses.asdict(env.unwrapped.settings.reward)
    assert set(weights) == set(TERMS)
    rng = np.random.default_rng(0)
    for _ in range(40):
        _, reward, *_, info = env.step(rng.uniform(-1, 1, 2).astype(np.float32))
        terms = {name: info[f"reward_{name}"] for name in TERMS}
        assert reward == pytest.approx(sum(weights[name] * terms[name] for name in TERMS), rel=1e-12)


def test_an_episode_can_be_repeated():
    env = make(info_level="full")
    env.reset(seed=11)
    episode = env.unwrapped.episode
    assert isinstance(episode, Episode)
    _, first = env.reset(seed=1, options={"episode": episode})
    _, again = env.reset(seed=1, options={"episode": episode})
    assert_same(first, again)


def test_an_episode_of_another_radius_takes_the_place_of_the_one_that_runs():
    wide = make(radius=1.2)
    wide.reset(seed=3)
    env = make()
    env.reset(seed=11)
    observation, _ = env.reset(options={"episode": wide.unwrapped.episode})
    assert decode(observation).target_radius == pytest.approx(1.2)
    env.step(np.zeros(2, np.float32))


def test_an_episode_that_cannot_be_driven_changes_nothing():
    env = make(info_level="full")
    env.reset(seed=11)
    before = env.unwrapped.episode
    rows = env.unwrapped.batch.simulator.rows.copy()
    sloping = dataclasses.replace(before, slope=(0.05, 0.0))
    slow = dataclasses.replace(before, sensors=Sensors(imu=Imu(sample_rate=50.0)))
    for episode, words in ((sloping, "slope"), (slow, "sample_rate")):
        with pytest.raises(InputError, match=words):
            env.reset(options={"episode": episode})
        assert env.unwrapped.episode is before
        np.testing.assert_array_equal(env.unwrapped.batch.simulator.rows, rows)


@pytest.mark.parametrize("radius", [np.float32(0.8), np.float64(0.8), np.array([0.7, 0.9]), (np.float32(0.7), 1), 1])
def test_numbers_of_numpy_serve_as_well(radius):
    observation, _ = make(radius=radius, speed=np.float32(0.2)).reset(seed=0)
    assert 0.7 <= decode(observation).target_radius <= 1.0


def test_a_turn_that_outlasts_the_episode_is_warned_of():
    with pytest.warns(InputWarning, match=r"a turn of 2\.5 m at 0\.2 m/s takes 44\.3 s and an episode 25 s"):
        make(radius=2.5)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        make(radius=(0.65, 1.2), speed=(0.16, 0.30))


def test_a_long_run_out_is_reached():
    turn = RowTurn(radius=0.8, side="left", run_in=0.5, run_out=1.5)
    controller = calibrate_constant_speeds(get_robot("ddagr"), get_soil("thesis_a1"), turn)
    arguments = {"soil": "thesis_a1", "side": "left", "randomisation": False, "max_episode_steps": 400}
    info = drive(make(run_out=1.5, **arguments), controller)[-1]
    assert (info["ending"], info["success"]) == (1, True)


def test_a_pickled_environment_goes_on_in_another_process(tmp_path):
    env = make(effects=["towed_drag=20"])
    env.reset(seed=3)
    action = np.full(2, 0.4, np.float32)
    env.step(action)
    (tmp_path / "env.pkl").write_bytes(pickle.dumps(env))
    script = f"""
import pickle, numpy
env = pickle.loads(open({str(tmp_path / "env.pkl")!r}, "rb").read())
numpy.save({str(tmp_path / "seen.npy")!r}, env.step(numpy.full(2, 0.4, numpy.float32))[0])
"""
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    np.testing.assert_array_equal(np.load(tmp_path / "seen.npy"), env.step(action)[0])


def test_settings_reach_the_simulator():
    env = make(robot="husky", soil="firm_ground", radius=0.65, side="left", effects=["slope=0.05", "towed_drag=40"])
    env.reset(seed=0)
    simulator = env.unwrapped.batch.simulator
    assert [effect.name for effect in simulator.effects] == ["command_delay", "slope", "towed_drag"]
    env.step(np.zeros(2, np.float32))
    assert simulator.rows[0, layout.SLOPE] == pytest.approx(math.tan(0.05))
    assert env.unwrapped.episode.turn.radius == 0.65


def test_a_range_of_speeds_is_drawn_from():
    env = make(speed=(0.16, 0.30))
    speeds = []
    for seed in range(12):
        observation, _ = env.reset(seed=seed)
        speeds.append(decode(observation).target_speed)
        assert speeds[-1] == pytest.approx(env.unwrapped.episode.turn.speed, abs=1e-6)
    assert 0.16 <= min(speeds) < 0.21
    assert 0.25 < max(speeds) <= 0.30


def test_radius_range_and_sides_are_drawn():
    env = make(radius=(0.65, 1.2))
    turns = []
    for seed in range(12):
        env.reset(seed=seed)
        turns.append(env.unwrapped.episode.turn)
    assert {turn.side for turn in turns} == {"left", "right"}
    assert 0.65 <= min(t.radius for t in turns) < max(t.radius for t in turns) <= 1.2


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"soil": "thesis_a2"}, "thesis_a1"),
        ({"robot": "huskey"}, "husky"),
        ({"radius": -1.0}, "radius"),
        ({"radius": float("nan")}, "radius"),
        ({"side": "up"}, "side"),
        ({"effects": ["slop=0.1"]}, "slope"),
        ({"info_level": "ful"}, "full"),
        ({"render_mode": "ansi"}, "render_mode"),
        ({"speed": 0.0}, "speed"),
        ({"speed": (0.3, 0.2)}, "low, high"),
        ({"radius": (0.7, 0.8, 0.9)}, "low, high"),
        ({"radius": ("a", "b")}, "low, high"),
        ({"radius": True}, "low, high"),
        ({"radius": None}, "low, high"),
        ({"radius": 3.0}, "headland is 3 m deep"),
        ({"radius": (0.8, 4.0)}, "headland is 3 m deep"),
        ({"speed": 2.6}, "at most 2.5 m/s"),
        ({"speed": "fast"}, "low, high"),
        ({"side": ["left"]}, "side"),
        ({"soil": None}, "soil is None: give a name, a file, a Soil"),
        ({"soil": 3}, "soil is 3"),
        ({"robot": None}, "robot is None: give a name, a file, a Robot"),
        ({"randomisation": None}, "randomisation is None: give True, False"),
        ({"sensors": None}, "sensors is None: give a Sensors"),
        ({"reward": 1.0}, "reward is 1.0: give a RewardWeights"),
        ({"numerics": "fine"}, "numerics is 'fine'"),
        ({"radious": 0.8}, "unknown argument of the environment 'radious': did you mean 'radius'"),
        ({"sensors": Sensors(imu=Imu(sample_rate=100.0))}, "sample_rate is 100 Hz .* give 125 Hz"),
    ],
)
def test_bad_arguments_are_one_sentence(arguments, words):
    with pytest.raises(InputError, match=words) as caught:
        gymnasium.make(TURN_ID, disable_env_checker=True, **arguments).reset(seed=0)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("action", "words"),
    [
        (np.zeros(3, np.float32), "shape"),
        (0.0, "shape"),
        (np.array([np.nan, 0.0]), "not finite"),
        (np.array([np.inf, 0.0]), "not finite"),
        ("left", "numbers"),
    ],
)
def test_bad_actions_are_one_sentence(action, words):
    env = make().unwrapped
    env.reset(seed=0)
    with pytest.raises(InputError, match=words):
        env.step(action)


def test_actions_beyond_the_box_are_clipped():
    env = make(info_level="full").unwrapped
    env.reset(seed=0)
    *_, info = env.step(np.array([5.0, -5.0]))
    np.testing.assert_array_equal(info["command"], [2.0, -2.0])


def test_step_before_reset_is_refused():
    with pytest.raises(gymnasium.error.ResetNeeded):
        make().unwrapped.step(np.zeros(2, np.float32))


def test_unknown_reset_option_is_refused():
    with pytest.raises(InputError, match="soyl"):
        make().reset(seed=0, options={"soyl": 1})


def test_randomisation_none_gives_one_robot():
    env = make(soil="thesis_a1", randomisation=Randomisation.none(), side="left")
    env.reset(seed=0)
    first = env.unwrapped.episode
    env.reset(seed=1)
    assert env.unwrapped.episode == first
    assert first.robot == get_robot("ddagr")
    assert first.sensors == Sensors()


def test_close_may_be_called_twice():
    env = make()
    env.reset(seed=0)
    env.close()
    env.close()


def test_rgb_array_renders_and_changes():
    pytest.importorskip("pygame", reason="the extra render is not installed")
    env = make(render_mode="rgb_array")
    env.reset(seed=0)
    first = env.render()
    for _ in range(40):
        env.step(np.array([0.5, 0.5], np.float32))
    second = env.render()
    assert first.dtype == np.uint8
    assert first.ndim == 3
    assert first.shape[2] == 3
    assert (first != second).any()
    env.close()
    env.close()
