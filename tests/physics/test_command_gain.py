"""Gains in the row of a simulator do what the effect of the library does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ddagr_gym.physics import layout
from ddagr_gym.physics.effects.command_gain import CommandGain
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.simulator import Simulator

COMMANDS = np.repeat([[[1.5, 0.8], [-0.5, 1.2]]], 100, axis=1)
PAST = np.repeat([[[1.0, 0.5], [0.0, 0.7]]], 10, axis=1)


def driven(*effects: CommandGain, gains: tuple[float, float] = (1.0, 1.0)) -> np.ndarray:
    robot = get_robot("ddagr")
    late = replace(robot, drivetrain=replace(robot.drivetrain, command_delay=0.2, command_ramp=3.0))
    simulator = Simulator(1, effects=effects)
    simulator.configure(0, late, get_soil("thesis_a1"))
    simulator.rows[:, layout.COMMAND_GAIN : layout.COMMAND_GAIN + 2] = gains
    simulator.reset()
    simulator.remember(PAST)
    return simulator.step(COMMANDS)[0][..., :5]


def test_gains_of_the_row_are_those_of_the_effect():
    np.testing.assert_array_equal(driven(gains=(0.8, 1.1)), driven(CommandGain(0.8, 1.1)))
    assert np.abs(driven(gains=(0.8, 1.1)) - driven()).max() > 0.1
