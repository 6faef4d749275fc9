from __future__ import annotations

import math

import numpy as np
import pytest

from ddagr_gym.identification.fitted_values import with_values
from ddagr_gym.identification.parameters import (
    command_shift,
    robot_parameters,
    sensor_parameters,
    soil_parameters,
    wheel_speed_shift,
)
from ddagr_gym.parameters import Sensors
from ddagr_gym.physics import layout
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.simulator import build_row


@pytest.fixture
def rows(robot, soil):
    return np.tile(build_row(robot, soil, Sensors()), (4, 1))


def named(parameters):
    return {p.name: p for p in parameters}


def test_strength_scales_cohesion_and_the_tangent_of_friction_at_all_wheels(rows, robot, soil):
    before = rows.copy()
    named(soil_parameters())["soil_strength"].apply(rows, math.log(0.8), np.zeros(4))
    changed = {int(entry) for entry in np.flatnonzero((rows != before).any(axis=0))}
    offsets = {(entry - layout.BASE_SOIL) % 9 for entry in changed}
    assert offsets == {layout.SOIL_COHESION, layout.SOIL_FRICTION_TANGENT}
    assert len(changed) == 8
    np.testing.assert_allclose(rows[:, list(changed)], 0.8 * before[:, list(changed)])


def test_the_exit_angle_ratio_is_added_and_stays_between_0_and_1(rows, soil):
    parameter = named(soil_parameters(soil))["exit_angle_ratio"]
    entry = layout.BASE_SOIL + layout.SOIL_EXIT_RATIO
    before = rows[0, entry]
    parameter.apply(rows, 0.05, np.zeros(4))
    assert rows[0, entry] == pytest.approx(before + 0.05)
    assert before + parameter.low == pytest.approx(0.0)
    assert before + parameter.high == pytest.approx(1.0)


@pytest.mark.parametrize("name", ["firm_ground", "lete_sand_wong", "thesis_a1"])
def test_a_soil_at_its_bounds_can_be_built(name, robot):
    soil = get_soil(name)
    for parameter in soil_parameters(soil):
        for value in (parameter.low, parameter.high):
            with_values(robot, soil, {parameter.name: value})
    strength = named(soil_parameters(soil))["soil_strength"]
    friction = with_values(robot, soil, {"soil_strength": strength.high})[1].friction_angle
    assert (friction == pytest.approx(1.2, abs=1e-6)) is (name != "thesis_a1")


def test_zero_is_nominal(rows, robot, soil):
    before = rows.copy()
    for parameter in (*soil_parameters(soil), *robot_parameters(robot), *sensor_parameters(2, 0.01, 0.1)):
        parameter.apply(rows, 0.0, np.zeros(4))
    np.testing.assert_array_equal(rows, before)


def test_a_bias_concerns_its_own_recording_only(rows):
    second = named(sensor_parameters(2, 0.01, 0.1))["gyro_bias_2"]
    second.apply(rows, 0.003, np.array([0, 1, 1, 0]))
    np.testing.assert_allclose(rows[:, layout.GYRO_BIAS], [0.0, 0.003, 0.003, 0.0])


def test_shifts_change_no_row(rows):
    before = rows.copy()
    for parameter in (command_shift(0.05), wheel_speed_shift(0.4)):
        parameter.apply(rows, 0.03, np.zeros(4))
    np.testing.assert_array_equal(rows, before)


@pytest.mark.parametrize("name", ["ddagr", "warthog", "husky"])
def test_every_uncertain_value_of_a_robot_may_move_within_its_relative_deviation(name):
    robot = get_robot(name)
    made = named(robot_parameters(robot))
    assert set(made) == set(robot.standard_deviations)
    assert made["mass"].prior == pytest.approx(robot.standard_deviations["mass"] / robot.mass)
    assert all(p.factor and p.high >= 4.0 * p.prior for p in made.values())


@pytest.mark.parametrize("name", ["warthog", "husky"])
def test_real_robots_state_what_is_not_known_of_them(name):
    robot = get_robot(name)
    assert {"mass", "yaw_inertia", "half_wheelbase", "half_width", "motor_rate"} <= set(robot.standard_deviations)
    assert "manual" in robot.source
    assert "estimates" in robot.source
