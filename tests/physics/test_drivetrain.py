"""Motor loops: the exact solution of a first-order loop, whatever the step."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddagr_gym.physics import layout
from ddagr_gym.physics.drivetrain import advance_motors
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.simulator import simulate

RATES = st.floats(0.1, 100.0)
SPEEDS = st.floats(-5.0, 5.0)


def _row(speeds, targets, rates):
    row = np.zeros(layout.SIZE)
    row[layout.OMEGA : layout.OMEGA + 2] = speeds
    row[layout.MOTOR_TARGET : layout.MOTOR_TARGET + 2] = targets
    row[layout.MOTOR_RATE : layout.MOTOR_RATE + 2] = rates
    return row


@given(st.tuples(SPEEDS, SPEEDS), st.tuples(SPEEDS, SPEEDS), st.tuples(RATES, RATES), st.floats(1e-4, 2.0))
def test_speed_and_angle_solve_the_loop(speeds, targets, rates, duration):
    row = _row(speeds, targets, rates)
    advance_motors(row, duration)
    for bank in range(2):
        gap, rate = speeds[bank] - targets[bank], rates[bank]
        assert row[layout.OMEGA + bank] == pytest.approx(targets[bank] + gap * math.exp(-rate * duration), abs=1e-12)
        angle = targets[bank] * duration - gap * math.expm1(-rate * duration) / rate
        assert row[layout.WHEEL_ANGLE + bank] == pytest.approx(angle, abs=1e-12)


@given(st.tuples(SPEEDS, SPEEDS), st.tuples(SPEEDS, SPEEDS), RATES, st.integers(2, 20))
def test_many_short_steps_are_one_long_one(speeds, targets, rate, parts):
    once, often = _row(speeds, targets, (rate, rate)), _row(speeds, targets, (rate, rate))
    advance_motors(once, 0.3)
    for _ in range(parts):
        advance_motors(often, 0.3 / parts)
    np.testing.assert_allclose(often, once, atol=1e-12)


def test_banks_of_a_drive_follow_their_commands_exactly():
    robot = get_robot("ddagr")
    drive = simulate(robot, get_soil("thesis_a1"), np.tile([1.2, -0.4], (100, 1)))
    decay = 1.0 - np.exp(-robot.motor_rate * drive["t"])
    np.testing.assert_allclose(drive["true_omega_right"], 1.2 * decay, rtol=1e-12)
    np.testing.assert_allclose(drive["true_omega_left"], -0.4 * decay, rtol=1e-12)


def test_commands_are_limited_to_what_the_motors_follow():
    robot = get_robot("ddagr")
    drive = simulate(robot, get_soil("firm_ground"), np.tile([50.0, -1e9], (500, 1)))
    assert drive["true_omega_right"][-1] == pytest.approx(robot.maximum_wheel_speed, rel=1e-6)
    assert drive["true_omega_left"][-1] == pytest.approx(-robot.maximum_wheel_speed, rel=1e-6)
    assert (drive["command_right"] == 50.0).all()
