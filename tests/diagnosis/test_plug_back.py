"""What a diagnosis found goes back into everything that simulates, and predicts there as it was certified."""

import os
from pathlib import Path

import gymnasium
import numpy as np
import pytest

import ddagr_gym.envs  # noqa: F401 (registers the environments)
from ddagr_gym import cli
from ddagr_gym.config import dump_config, parse_config
from ddagr_gym.diagnosis.certification.forecast import (
    cut_forecasts,
    errors_at,
    past_elimination,
    roll_out,
    start_states,
)
from ddagr_gym.identification.fitted_values import with_values
from ddagr_gym.identification.problem import Point
from ddagr_gym.physics.effects import load_effects
from ddagr_gym.physics.effects.files import read_effects_file, save_effects
from ddagr_gym.presets import get_robot, get_soil
from tests.diagnosis.conftest import Sloping


@pytest.fixture(scope="session", params=["effects.json", "effects.yaml"])
def effects_file(request: pytest.FixtureRequest, sloping: Sloping, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The fitted slope as `ddagr diagnose` writes it."""
    path = tmp_path_factory.mktemp("found") / str(request.param)
    known = [{"angle": (0.05, 0.07)}]
    save_effects(path, sloping.chosen.point.effects, intervals=known, data_hash="0" * 64, source="two drives")
    return path


def test_the_file_holds_the_fit_exactly(sloping: Sloping, effects_file: Path) -> None:
    assert load_effects(effects_file) == sloping.chosen.point.effects
    assert read_effects_file(effects_file).data_hash == "0" * 64


def test_predictions_with_the_file_are_as_good_as_certified(sloping: Sloping, effects_file: Path) -> None:
    """The same drives with the file's effects; the certified error came from sizes that were fitted to the other one.

    Sizes fitted to both drives may do a little better or worse than those of one of them: a fifth. Biases of a drive
    that was not seen are not known: they are zero, as in the certification.
    """
    problem = sloping.problem
    own = np.array([p.scope is not None for p in problem.nuisances.parameters])
    values = np.where(own, 0.0, sloping.chosen.point.values)
    forecasts = cut_forecasts(problem, sloping.recordings, 5.0, 2.0)
    assert forecasts is not None
    point = Point(values, sloping.chosen.point.states, load_effects(effects_file))
    states = start_states(forecasts, point, past_elimination(forecasts, point))
    readings, _ = roll_out(forecasts, point, states)
    errors = errors_at(forecasts.future, readings, 5.0)
    for channel in ("position", "specific_force_x", "specific_force_y"):
        certified = sloping.certificate.channels[channel]["5"]
        again = float(np.sqrt(np.nanmean(errors[channel] ** 2)))
        assert again == pytest.approx(certified.corrected.value, rel=0.2), channel
        assert again < 0.5 * certified.refitted.value, channel


def test_an_environment_takes_the_file(sloping: Sloping, effects_file: Path) -> None:
    made = gymnasium.make("DDAGR-Turn-v0", effects=os.fspath(effects_file))
    assert made.unwrapped.settings.effects == sloping.chosen.point.effects
    made.reset(seed=1)
    assert made.step(made.action_space.sample())[0].shape == made.observation_space.shape
    made.close()


def test_the_simulator_takes_the_file(sloping: Sloping, effects_file: Path, tmp_path: Path) -> None:
    output, plain = tmp_path / "with.csv", tmp_path / "without.csv"
    words = ["simulate", "--manoeuvre", "arcs", "--rate", "25", "--no-noise", "--output"]
    assert cli.main([*words, str(output), "--effect", str(effects_file)]) == 0
    assert cli.main([*words, str(plain)]) == 0
    ends = [np.genfromtxt(path, delimiter=",", names=True)[-1] for path in (output, plain)]
    assert abs(ends[0]["true_x"] - ends[1]["true_x"]) > 0.01


def test_a_training_configuration_takes_the_file(sloping: Sloping, effects_file: Path) -> None:
    from agents.settings import TaskSettings
    from ddagr_gym.policies.design import PolicyDesign

    task = parse_config(f"effects: [{effects_file}]", TaskSettings)
    made = gymnasium.make("DDAGR-Turn-v0", **task.environment(PolicyDesign()))
    assert made.unwrapped.settings.effects == sloping.chosen.point.effects
    made.close()


def test_the_corrected_simulator_drives_everywhere(sloping: Sloping, effects_file: Path, tmp_path: Path) -> None:
    """Refitted robot and soil as files beside the effects: an environment and the simulator take them."""
    names = [parameter.name for parameter in sloping.problem.nuisances.parameters]
    values = dict(zip(names, sloping.chosen.point.values.tolist(), strict=True))
    robot, soil = with_values(get_robot("ddagr"), get_soil("thesis_a1"), values)
    assert soil != get_soil("thesis_a1")
    paths = [tmp_path / "robot.yaml", tmp_path / "soil.yaml"]
    for path, item in zip(paths, (robot, soil), strict=True):
        path.write_text(dump_config(item))
    files = [os.fspath(path) for path in paths]
    made = gymnasium.make("DDAGR-Turn-v0", robot=files[0], soil=files[1], effects=os.fspath(effects_file))
    settings = made.unwrapped.settings
    assert (settings.robot, settings.soil, settings.effects) == (robot, soil, sloping.chosen.point.effects)
    made.close()
    words = ["simulate", "--manoeuvre", "arcs", "--rate", "25", "--no-noise", "--effect", str(effects_file)]
    output = tmp_path / "drive.csv"
    assert cli.main([*words, "--robot", files[0], "--soil", files[1], "--output", str(output)]) == 0
    assert output.is_file()
