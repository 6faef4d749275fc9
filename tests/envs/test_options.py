"""Soils of an environment: by name, or from files of single soils and of distributions."""

from dataclasses import replace
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from ddagr_gym.config import configs_dir, dump_config
from ddagr_gym.envs.options import find_soil, make_settings
from ddagr_gym.errors import InputError
from ddagr_gym.parameters import Drivetrain
from ddagr_gym.physics.soil_draws import get_distribution
from ddagr_gym.presets import get_robot, get_soil


def test_soils_and_distributions_come_from_names_and_files(tmp_path: Path) -> None:
    single = tmp_path / "single.yaml"
    single.write_text(dump_config(get_soil("thesis_a1")))
    assert find_soil(str(single)) == find_soil(single) == find_soil("thesis_a1") == get_soil("thesis_a1")
    assert find_soil(str(configs_dir() / "soils" / "field.yaml")) == find_soil("field") == get_distribution("field")


def test_a_file_that_is_neither_says_why(tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text("cohesion: 3000.0\n")
    with pytest.raises(InputError, match=r"is no soil .* and no distribution "):
        find_soil(str(wrong))


def test_paths_serve_as_well_as_texts(tmp_path: Path) -> None:
    own = tmp_path / "own.yaml"
    own.write_text(dump_config(replace(get_robot("ddagr"), name="mine")))
    assert make_settings(robot=own).robot == make_settings(robot=str(own)).robot
    assert make_settings(robot=own).robot.name == "mine"


def test_a_robot_with_a_drivetrain_comes_from_its_file_and_steps_alike_alone_and_in_a_batch(tmp_path: Path) -> None:
    drivetrain = Drivetrain(command_delay=0.15, load_compliance=0.01, integral_rate=2.0, acceleration_limit=10.0)
    own = tmp_path / "own.yaml"
    own.write_text(dump_config(replace(get_robot("ddagr"), drivetrain=drivetrain)))
    assert make_settings(robot=own).robot.drivetrain == drivetrain
    alone = gymnasium.make("ddagr_gym:DDAGR-Turn-v0", robot=own)
    batch = gymnasium.make_vec("ddagr_gym:DDAGR-Turn-v0", num_envs=2, robot=own)
    usual = gymnasium.make("ddagr_gym:DDAGR-Turn-v0")
    seen = [alone.reset(seed=3)[0], batch.reset(seed=[3, 4])[0][0], usual.reset(seed=3)[0]]
    for action in np.random.default_rng(0).uniform(-1, 1, (20, 2)).astype(np.float32):
        seen = [alone.step(action)[0], batch.step(np.stack([action, action]))[0][0], usual.step(action)[0]]
        np.testing.assert_array_equal(seen[0], seen[1])
    assert not np.array_equal(seen[0], seen[2])
