"""Parts of the reward whose value is known exactly."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ddagr_gym.control.row_turn import SIDES, RowTurn
from ddagr_gym.envs import turn_kernel as kernel
from ddagr_gym.envs.turn_kernel import _steering_error

STEP = 0.016


def steering_errors(turn, x, y):
    """Errors along a track."""
    task = np.zeros(kernel.TASK_SIZE)
    task[kernel.RADIUS], task[kernel.SIGN], task[kernel.RUN_IN] = turn.radius, turn.sign, turn.run_in
    task[kernel.SPEED] = turn.speed
    task[kernel.COURSE] = math.atan2(y[1] - y[0], x[1] - x[0])
    return np.array([_steering_error(task, x[k] - x[k - 1], y[k] - y[k - 1], x[k], y[k]) for k in range(1, len(x))])


@pytest.mark.parametrize("side", SIDES)
def test_steering_is_right_on_the_commanded_path(side):
    turn = RowTurn(radius=0.8, side=side, run_in=0.5, run_out=0.5)
    distance = np.arange(0.0, turn.length, STEP)
    errors = steering_errors(turn, *turn.position(distance).T)
    bends = np.min(np.abs(distance[1:, None] - [turn.run_in, turn.run_in + turn.turn_length]), axis=1) < 2.5 * STEP
    # a chord's direction is half a step behind the path's: 2 x 0.5 x 0.016/0.8
    assert np.abs(errors[~bends]).max() < 0.022
    assert np.abs(errors[bends]).max() < 1.1


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("radius", [0.7, 0.9])
def test_steering_on_another_circle_is_its_curvature_less_the_wanted_one(side, radius):
    turn = RowTurn(radius=0.8, side=side, run_in=0.0, run_out=0.5)
    angle = np.arange(0.0, 2.5, STEP / radius)
    # about the same centre, so that the robot is beside the path and parallel to it
    x, y = radius * np.sin(angle), turn.sign * (turn.radius - radius * np.cos(angle))
    errors = steering_errors(turn, x, y)
    wanted = 1.0 - (turn.radius - radius) / turn.radius
    np.testing.assert_allclose(errors[5:], turn.radius / radius - wanted, atol=0.025)


def test_course_errors_count_twice():
    turn = RowTurn(radius=0.8, side="left", run_in=2.0, run_out=0.5)
    along = np.arange(-2.0, -1.0, STEP)
    slope = 0.1
    x, y = along * math.cos(slope), (along + 2.0) * math.sin(slope)
    errors = steering_errors(turn, x, y)
    np.testing.assert_allclose(errors, y[1:] / 0.8 + 2.0 * slope, atol=1e-6)
    mirrored = steering_errors(RowTurn(radius=0.8, side="right", run_in=2.0, run_out=0.5), x, -y)
    np.testing.assert_allclose(mirrored, errors, atol=1e-12)


def test_a_robot_that_hardly_moves_steers_neither_way():
    turn = RowTurn(radius=0.8, side="left", run_in=0.5)
    x = np.array([-0.5, -0.5 + 1e-4])
    assert steering_errors(turn, x, np.array([0.0, 1e-3])).tolist() == [0.0]
