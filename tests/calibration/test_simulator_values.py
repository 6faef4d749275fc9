"""Fitted values as numbers of a robot: a factor on what the data sheet has, or a sum where that may be nothing."""

from __future__ import annotations

import math

import pytest

from ddagr_gym.calibration.parts import complete_robot
from ddagr_gym.identification.fitted_values import robot_with_values
from ddagr_gym.identification.parameters import robot_parameters
from ddagr_gym.identification.window_model import ideal_sensors
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.simulator import build_row

CHANGES = {
    "motor_rate": -0.2, "half_track": 0.03, "outer_radius": -0.05, "command_delay": 0.3, "integral_rate": 2.0,
    "integral_limit": -0.2, "turning_limit": 0.3, "mean_ramp": -0.1, "turning_ramp": 0.2,
    "power_limit": 0.4, "limit_imbalance": 0.1, "viscous_rate": 0.3,
}  # fmt: skip


def test_the_robot_has_the_row_that_the_fit_simulated():
    """Whatever a parameter does to a row of the simulator, the robot of these values builds the same row."""
    import numpy as np

    robot, soil = complete_robot(get_robot("warthog")), get_soil("firm_ground")
    row = build_row(robot, soil, ideal_sensors(0.05))[None].copy()
    for parameter in robot_parameters(robot):
        parameter.apply(row, CHANGES.get(parameter.name, 0.0), np.zeros(1, dtype=np.int64))
    np.testing.assert_allclose(
        build_row(robot_with_values(robot, CHANGES), soil, ideal_sensors(0.05)), row[0], rtol=1e-12
    )


def test_numbers_are_those_that_a_reader_expects():
    robot = complete_robot(get_robot("warthog"))
    found = robot_with_values(robot, CHANGES)
    assert found.drivetrain.command_delay == pytest.approx(0.3)
    assert found.drivetrain.power_limit == pytest.approx(robot.drivetrain.power_limit * math.exp(0.4))
    assert found.motor_rate == pytest.approx(6.0 * math.exp(-0.2))
    assert robot_with_values(robot, {}) == robot
