"""Draws of a calibration: their spread is that of the file, and nothing leaves its bounds."""

from __future__ import annotations

import math
from dataclasses import replace

import gymnasium
import numpy as np
import pytest

from ddagr_gym.config import dump_config
from ddagr_gym.envs.calibrated_draws import EFFECTS, NAME, CalibratedDraws, GroundDraws, load_draws
from ddagr_gym.errors import InputError
from ddagr_gym.parameters import Drivetrain
from ddagr_gym.physics.effects import save_effects
from ddagr_gym.presets import get_robot, get_soil

ROBOT = replace(get_robot("warthog"), drivetrain=Drivetrain(command_delay=0.05, acceleration_limit=20.0))
DRAWS = CalibratedDraws(
    ROBOT,
    {"motor_rate": 0.1, "command_delay": 0.05, "acceleration_limit": 0.2, "outer_radius": 0.05},
    (
        GroundDraws("sand", get_soil("lete_sand_wong"), {"soil_strength": 0.1}),
        GroundDraws("asphalt", get_soil("firm_ground"), {}),
    ),
)


def test_spreads_are_those_of_the_file():
    rng = np.random.default_rng(1)
    robots = [DRAWS.draw_robot(rng) for _ in range(2000)]
    logarithm = np.log([robot.motor_rate / ROBOT.motor_rate for robot in robots])
    limit = np.log([robot.drivetrain.acceleration_limit / 20.0 for robot in robots])
    # cut off at three deviations: 1.3 % less than the whole normal distribution; standard error 1.6 %
    assert np.std(logarithm) == pytest.approx(0.1 * 0.9866, rel=0.05)
    assert np.std(limit) == pytest.approx(0.2 * 0.9866, rel=0.05)
    assert {robot.mass for robot in robots} == {ROBOT.mass}
    delays = np.array([robot.drivetrain.command_delay for robot in robots])
    # a normal distribution of one deviation above 0 is cut there in 16 % of the draws
    assert np.mean(delays == 0.0) == pytest.approx(0.159, abs=0.03)
    radii = {wheel.major_radius for robot in robots[:5] for wheel in robot.wheels}
    assert len(radii) == 5


def test_grounds_are_drawn_alike_and_one_can_be_chosen():
    rng = np.random.default_rng(2)
    cohesion = [DRAWS.draw_soil(rng).cohesion for _ in range(400)]
    assert np.mean(np.array(cohesion) == 0.0) == pytest.approx(0.5, abs=0.08)  # firm ground has none
    strength = [math.tan(DRAWS.on("sand").draw_soil(rng).friction_angle) for _ in range(500)]
    nominal = math.tan(get_soil("lete_sand_wong").friction_angle)
    assert np.std(np.log(np.array(strength) / nominal)) == pytest.approx(0.0987, rel=0.1)


SLOPING = replace(DRAWS.grounds[0], gradient=(0.04, -0.03), gradient_deviations=(0.004, 0.003))


def test_a_ground_slopes_as_steeply_as_it_did_in_any_direction_of_the_rows():
    rng = np.random.default_rng(3)
    drawn = np.array([SLOPING.draw_gradient(rng) for _ in range(4000)])
    steepness = np.hypot(*drawn.T)
    # along the gradient the deviation is hypot(0.8 x 0.004, 0.6 x 0.003) = 0.0037
    assert np.mean(steepness) == pytest.approx(0.05, abs=0.0005)
    assert np.std(steepness) == pytest.approx(0.0037, rel=0.05)
    # of 4000 directions the mean vector is 0.01 of their length at most, in 67 of 100
    assert np.abs(drawn.mean(axis=0)).max() < 0.03 * 0.05
    before = rng.bit_generator.state
    assert DRAWS.grounds[0].draw_gradient(rng) == (0.0, 0.0)
    assert rng.bit_generator.state == before


def test_episodes_on_a_sloping_ground_slope(tmp_path):
    (tmp_path / NAME).write_text(dump_config(replace(DRAWS, grounds=(SLOPING, DRAWS.grounds[1]))))
    save_effects(tmp_path / EFFECTS, [])
    environment = gymnasium.make("DDAGR-Turn-v0", calibration=tmp_path, randomisation=False)
    angles = []
    for seed in range(12):
        environment.reset(seed=seed)
        episode = environment.unwrapped.episode
        angles.append(episode.slope[0])
        assert (episode.slope[0] > 0.03) == (episode.soils.cohesion != get_soil("firm_ground").cohesion)
    assert 0.0 in angles
    assert max(angles) > 0.03
    level = gymnasium.make("DDAGR-Turn-v0", calibration=tmp_path, ground="asphalt", randomisation=False)
    level.reset(seed=0)
    assert not level.unwrapped.batch.settings.sloping


def test_the_file_reads_back(tmp_path):
    (tmp_path / NAME).write_text(dump_config(DRAWS))
    assert load_draws(tmp_path) == DRAWS
    assert load_draws(tmp_path, "sand").grounds == DRAWS.grounds[:1]
    with pytest.raises(InputError, match="unknown ground 'mud'"):
        load_draws(tmp_path, "mud")
    with pytest.raises(InputError, match="give a folder that `ddagr calibrate` wrote"):
        load_draws(tmp_path / "nothing")
