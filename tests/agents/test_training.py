"""Training end to end on a few hundred control steps: results, exact continuation, export, command."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="the extra rl is not installed")

import torch

from agents import run as run_module
from agents.asymmetric import TRUTH, WithTruth, true_entries
from agents.checkpoint import read_checkpoint
from agents.export import actor_of, archive_of
from agents.main import load_settings
from agents.run import CHECKPOINT, POLICY, make_environment, train
from agents.settings import PpoSettings, SacSettings, TrainingSettings
from agents.train_ppo import make_ppo
from agents.train_sac import make_sac
from agents.validation import ValidationResult, _judge, drive_all
from ddagr_gym.config import config_names, dump_config
from ddagr_gym.envs.calibrated_draws import EFFECTS, CalibratedDraws, GroundDraws
from ddagr_gym.envs.calibrated_draws import NAME as DRAWS
from ddagr_gym.envs.options import make_settings
from ddagr_gym.errors import InputError
from ddagr_gym.evaluation.ladder_gains import tracker_settings
from ddagr_gym.evaluation.metrics import turn_metrics
from ddagr_gym.evaluation.runs import drive_turn
from ddagr_gym.parameters import Drivetrain
from ddagr_gym.physics import layout
from ddagr_gym.physics.effects import save_effects
from ddagr_gym.physics.effects.gyro_scale import GyroScale
from ddagr_gym.physics.effects.slope import Slope
from ddagr_gym.policies.archive import load_policy
from ddagr_gym.policies.controller import PolicyController
from ddagr_gym.policies.design import PolicyDesign
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.wrappers.policy_view import PolicyViewVecEnv
from ddagr_gym.wrappers.sb3 import TurnVecEnv

PPO = TrainingSettings(
    description="test",
    steps=192,
    environments=4,
    validation_interval=96,
    ppo=PpoSettings(rollout=8, batch=16, epochs=2, hidden=(8, 8)),
)
SAC = replace(PPO, algorithm="sac", steps=64, sac=SacSettings(start=16, batch=16, gradient_steps=2, hidden=(8, 8)))
PATH = replace(PPO, design=PolicyDesign(features="path", tracker=tracker_settings()))
MAKE = {"ppo": make_ppo, "sac": make_sac}


def episodes(count):
    settings = make_settings()
    return [(seed, settings.draw(np.random.default_rng(seed))) for seed in range(count)]


def train_here(settings, folder, seed=0):
    return train(MAKE[settings.algorithm], settings, seed, folder, episodes(1), checkpoint_seconds=0.0)


def members(folder):
    with np.load(folder / POLICY) as archive:
        return {name: archive[name] for name in archive.files}


class Killed(BaseException):
    """Stands for a signal in the middle of a rollout."""


@pytest.mark.parametrize("settings", [PPO, SAC, PATH], ids=["ppo", "sac", "path"])
def test_a_killed_training_goes_on_to_the_bit(tmp_path, monkeypatch, settings):
    whole = train_here(settings, tmp_path / "whole")
    calls = []

    def die(self, steps=1):
        calls.append(steps)
        if len(calls) == 12:
            raise Killed

    with monkeypatch.context() as patch:
        patch.setattr(run_module.Progress, "advance", die)
        with pytest.raises(Killed):
            train_here(settings, tmp_path / "killed")
    torch.manual_seed(99)
    np.random.seed(99)  # noqa: NPY002
    again = train_here(settings, tmp_path / "killed")
    first, second = members(tmp_path / "whole"), members(tmp_path / "killed")
    assert first.keys() == second.keys()
    for name, value in first.items():
        np.testing.assert_array_equal(value, second[name])
    for result in (whole, again):
        del result["cpu_seconds"]
        for entry in result["course"]:
            del entry["cpu_seconds"]
    assert whole == again


def test_what_has_ended_is_not_trained_again(tmp_path, monkeypatch):
    settings = replace(PPO, steps=32)
    result = train_here(settings, tmp_path)
    monkeypatch.setattr(run_module, "make_environment", lambda *_: pytest.fail("trained again"))
    assert train_here(settings, tmp_path) == result
    assert [entry["steps"] for entry in result["course"]] == [0]
    assert {"radius_error_median", "radius_error_p95", "success_rate"} < set(result["validation"])
    assert list((tmp_path / "tensorboard").glob("events*"))
    assert result["validation"]["robot"] == "ddagr"
    assert run_module.describe(result["validation"]).endswith("(turns of the robot ddagr)")


def test_a_turn_that_ends_halfway_round_counts_as_worst():
    _, episode = episodes(1)[0]
    angle = np.linspace(0.0, np.radians(100.0), 600)
    turn = episode.turn
    places = turn.place_on_turn(angle)
    track = np.column_stack([places, turn.sign * angle])
    assert _judge(track, episode) == (np.inf, np.inf, False)


def test_checkpoints_of_other_settings_and_damaged_ones_are_refused(tmp_path):
    train_here(replace(PPO, steps=64), tmp_path)
    with pytest.raises(InputError, match="other settings"):
        train_here(replace(PPO, steps=96), tmp_path)
    (tmp_path / CHECKPOINT).write_bytes(b"nothing")
    with pytest.raises(InputError, match="not a checkpoint"):
        read_checkpoint(tmp_path / CHECKPOINT, PPO.digest())
    assert read_checkpoint(tmp_path / "none.pkl", PPO.digest()) is None


def test_seeds_differ_and_repeat(tmp_path):
    settings = replace(PPO, steps=32)
    for name, seed in (("a", 0), ("b", 0), ("c", 1)):
        train_here(settings, tmp_path / name, seed)
    a, b, c = (members(tmp_path / name) for name in "abc")
    np.testing.assert_array_equal(a["weight_0"], b["weight_0"])
    assert (a["weight_0"] != c["weight_0"]).any()
    assert (a["mean"] != c["mean"]).any()


@pytest.mark.parametrize("algorithm", ["ppo", "sac"])
def test_numpy_inference_equals_torch(algorithm):
    settings = {"ppo": PPO, "sac": SAC}[algorithm]
    normalise = make_environment(settings)
    model = MAKE[algorithm](settings, normalise, 0)
    model.learn(64)
    policy = archive_of(model, normalise, settings, 0)
    rng = np.random.default_rng(0)
    seen = len(settings.design.inputs)
    full = rng.uniform(-3, 3, (64, normalise.observation_space.shape[0])).astype(np.float32)
    predicted, _ = model.predict(normalise.normalize_obs(full), deterministic=True)
    np.testing.assert_allclose(np.clip(policy(full[:, :seen]), -1, 1), predicted, atol=1e-6)
    with torch.no_grad():
        normal = torch.as_tensor(normalise.normalize_obs(full)[:, :seen], dtype=torch.float32)
        np.testing.assert_allclose(policy(full[:, :seen]), actor_of(model)(normal).numpy(), atol=1e-6)


def test_the_actor_does_not_see_the_truth():
    normalise = make_environment(PPO)
    model = make_ppo(PPO, normalise, 0)
    inputs = np.random.default_rng(0).normal(size=(5, normalise.observation_space.shape[0])).astype(np.float32)
    changed = inputs.copy()
    changed[:, -len(TRUTH) :] += 1.0
    tensors = torch.as_tensor(inputs), torch.as_tensor(changed)
    means = [model.policy.get_distribution(tensor).distribution.mean for tensor in tensors]
    values = [model.policy.predict_values(tensor) for tensor in tensors]
    assert bool((means[0] == means[1]).all())
    assert bool((values[0] != values[1]).all())


def test_the_critics_truth_is_that_of_the_simulator():
    design = PolicyDesign(features="raw")
    turns = TurnVecEnv(2, side="right", randomisation=False, info_level="full")
    env = WithTruth(PolicyViewVecEnv(turns, design))
    env.seed(0)
    env.reset()
    for _ in range(60):
        seen, *_ = env.step(np.zeros((2, 2), np.float32))
    truth = dict(zip(TRUTH, true_entries(env.batch).T, strict=True))
    np.testing.assert_array_equal(seen[:, -len(TRUTH) :].T, list(truth.values()))
    row = env.batch.simulator.rows[0]
    assert truth["true_speed"][0] == pytest.approx(row[layout.V_X] / 0.2, rel=1e-5)
    speed = np.hypot(row[layout.V_X], row[layout.V_Y])
    assert truth["true_curvature"][0] == pytest.approx(-0.8 * row[layout.YAW_RATE] / speed, rel=1e-5)
    # the outer wheel of a turn to the right is the left one, and slips forwards more
    assert truth["slip_outer"][0] == pytest.approx(row[[layout.SLIP_RATIO + 1, layout.SLIP_RATIO + 3]].mean(), rel=1e-5)


def test_validation_drives_what_evaluation_drives(tmp_path):
    train_here(replace(PPO, steps=32), tmp_path)
    policy = load_policy(tmp_path / POLICY)
    settings, driven = make_settings(ekf_features=True), episodes(3)
    found = drive_all(policy, policy.design, settings, driven)
    for n, (seed, episode) in enumerate(driven):
        run = drive_turn(PolicyController(policy), settings, seed, episode)
        metrics = turn_metrics(run.columns, episode.turn, episode.robot)
        assert metrics.turn.error == pytest.approx(found.errors[n], abs=2e-4)
        assert run.success == found.successes[n]
        assert run.total_reward == pytest.approx(found.returns[n], abs=0.05)


def test_configurations_are_read_and_overridden():
    for name in config_names("training"):
        assert load_settings(name).steps >= 1
    changed = load_settings("ppo_ekf", ["ppo.learning_rate=1e-5", "steps=7", "design.frames=2"])
    assert (changed.ppo.learning_rate, changed.steps, changed.design.frames) == (1e-5, 7, 2)
    assert changed.digest() != load_settings("ppo_ekf").digest()


@pytest.fixture
def calibration(tmp_path) -> Path:
    """A folder with what training takes of a calibration: two grounds, and a delay that differs between drives."""
    grounds = tuple(GroundDraws(name, get_soil("thesis_a1"), {"soil_strength": 0.1}) for name in ("field", "track"))
    robot = replace(get_robot("ddagr"), motor_rate=2.5, drivetrain=Drivetrain(command_delay=0.2))
    (tmp_path / DRAWS).write_text(dump_config(CalibratedDraws(robot, {"command_delay": 0.02}, grounds)))
    save_effects(tmp_path / EFFECTS, [])
    return tmp_path


def test_a_calibrated_robot_is_trained_on(calibration):
    changes = [f"task.calibration={calibration}", "task.ground=track", "environments=4"]
    settings = load_settings("ppo_ekf", changes)
    environment = make_environment(settings)
    environment.reset()
    environment.step(np.zeros((4, environment.action_space.shape[0])))
    found = environment.unwrapped.env.settings
    assert found.calibrated is not None
    assert [item.name for item in found.calibrated.grounds] == ["track"]
    assert found.randomisation.command_delay == 0.0


def test_a_calibration_counts_by_what_it_says(calibration):
    before = load_settings("ppo_ekf")
    after, field = (
        load_settings("ppo_ekf", [f"task.calibration={calibration}", f"task.ground={g}"]) for g in ("''", "field")
    )
    digest = after.digest()
    assert len({before.digest(), digest, field.digest()}) == 3
    moved = calibration.with_name("moved")
    calibration.rename(moved)
    assert load_settings("ppo_ekf", [f"task.calibration={moved}"]).digest() == digest
    save_effects(moved / EFFECTS, [GyroScale(0.98)])
    assert load_settings("ppo_ekf", [f"task.calibration={moved}"]).digest() != digest
    with pytest.raises(InputError, match="give a folder that `ddagr calibrate` wrote"):
        make_environment(after)


def test_a_robot_of_a_file_is_trained_on_and_counts_by_what_it_says(tmp_path, calibration):
    path = tmp_path / "robot.yaml"
    heavy = replace(get_robot("ddagr"), mass=200.0)
    path.write_text(dump_config(heavy))
    settings = load_settings("ppo_ekf", [f"task.robot={path}", "task.soil=thesis_a1", "environments=2"])
    assert make_environment(settings).unwrapped.env.settings.robot == heavy
    digest = settings.digest()
    path.write_text(dump_config(replace(heavy, mass=201.0)))
    assert len({digest, settings.digest(), load_settings("ppo_ekf", ["task.soil=thesis_a1"]).digest()}) == 3
    with pytest.raises(InputError, match="which has a robot of its own"):
        load_settings("ppo_ekf", [f"task.robot={path}", f"task.calibration={calibration}"])


def test_a_file_of_effects_counts_by_what_it_says(tmp_path):
    path = tmp_path / "effects.yaml"
    before = load_settings("ppo_ekf")

    def digest(angle: float) -> str:
        save_effects(path, [Slope(angle)])
        return replace(before, task=replace(before.task, effects=(str(path),))).digest()

    assert len({digest(0.05), digest(0.3), before.digest()}) == 3
    assert digest(0.05) == digest(0.05)
    for wrong in ("steps", "nothing.here=1", "ppo.surprise=1", "steps=many", "steps=0", "ppo.clip=: ["):
        with pytest.raises(InputError):
            load_settings("ppo_ekf", [wrong])
    with pytest.raises(InputError, match="ppo_ekf"):
        load_settings("ppo_ekg")


def test_command_trains_from_the_checkout(tmp_path, repository):
    words = ["train", "ppo", "--config", "ppo_raw", "--output", str(tmp_path), "--set", "steps=64", "environments=4"]
    words += ["ppo.rollout=8", "ppo.batch=16", "validation_interval=1000"]
    done = subprocess.run(
        [sys.executable, "-P", "-m", "ddagr_gym", *words], capture_output=True, text=True, cwd=tmp_path,
        env={"PYTHONPATH": str(repository), "PATH": "/usr/bin:/bin", "OMP_NUM_THREADS": "1"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "median |e_R|" in done.stdout
    result = json.loads((tmp_path / "ppo_raw" / "seed_0" / "result.json").read_text())
    assert result["steps"] == 64
    assert load_policy(tmp_path / "ppo_raw" / "seed_0" / POLICY).design == PolicyDesign(features="raw")


def test_failures_count_as_worst():
    errors = np.array([0.01, -0.02, 0.03, np.inf])
    found = ValidationResult(errors, errors, np.array([True, True, True, False]), np.ones(4)).summary()
    assert found == {
        "radius_error_median": 0.03, "radius_error_p95": None, "heading_radius_error_median": 0.03,
        "success_rate": 0.75, "mean_return": 1.0,
    }  # fmt: skip
