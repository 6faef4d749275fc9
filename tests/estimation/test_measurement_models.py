"""Measurement models: what an accelerometer feels, and derivatives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.estimation import FilterModel, layout, roll_out
from ddagr_gym.estimation.measurement_models import entry_column, gyro_column, row_column, specific_force
from ddagr_gym.estimation.process_model import body_forces


def predicted_force(model, load, state, axis):
    work = load(state)
    body_forces(model.pack(), work)
    return specific_force(model.pack(), work, axis)


def test_a_steady_turn_feels_the_centripetal_acceleration_only(model, load):
    # du/dt is zero in a steady turn, its "derivative of the body velocity" too; the wheels still push inwards.
    state = roll_out(model, model.initial()[0], np.tile([1.1, 0.3], (1500, 1)))[-1]
    v_x, v_y, turn = state[:3]
    assert predicted_force(model, load, state, 0) == pytest.approx(-turn * v_y, abs=1e-8)
    assert predicted_force(model, load, state, 1) == pytest.approx(turn * v_x, abs=1e-8)


def test_a_parked_robot_on_a_slope_feels_the_wheels_that_hold_it(model, load):
    slope = 0.05
    state = roll_out(model, model.initial()[0], np.zeros((3000, 2)), attitude=(0.0, slope))[-1]
    # nose down: gravity pulls forward, the wheels hold backwards
    assert predicted_force(model, load, state, 0) == pytest.approx(-9.80665 * np.sin(slope), rel=1e-4)


@pytest.mark.parametrize("axis", [0, 1])
def test_lever_arm(robot, load, turning_state, axis):
    state, _ = turning_state
    position = (0.3, -0.2)
    centred, off = FilterModel(robot), FilterModel(robot, imu_position=position)
    work = load(state)
    body_forces(centred.pack(), work)
    acceleration = work[layout.FORCE + 2]
    turn = state[2]
    extra = (
        -acceleration * position[1] - turn**2 * position[0],
        acceleration * position[0] - turn**2 * position[1],
    )
    difference = predicted_force(off, load, state, axis) - predicted_force(centred, load, state, axis)
    assert difference == pytest.approx(extra[axis], rel=1e-12)


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("position", [(0.0, 0.0), (0.3, -0.2)])
def test_derivative_against_fourth_order_differences(robot, load, turning_state, axis, position):
    state, _ = turning_state
    state[9:] = [1e-3, 0.05, -0.03]
    model = FilterModel(robot, imu_position=position)
    work = load(state)
    body_forces(model.pack(), work)
    specific_force(model.pack(), work, axis)
    row = work[layout.ROW : layout.ROW + layout.STATE_SIZE].copy()
    for k in range(layout.STATE_SIZE):
        h = 1e-4
        e = np.eye(layout.STATE_SIZE)[k] * h
        values = [predicted_force(model, load, state + n * e, axis) for n in (-2, -1, 1, 2)]
        difference = (values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * h)
        assert row[k] == pytest.approx(difference, rel=2e-5, abs=2e-5 * np.abs(row).max())


def test_columns_are_products_with_the_covariance(load, turning_state, rng):
    state, _ = turning_state
    root = rng.standard_normal((12, 12))
    covariance = root @ root.T
    gyro = np.zeros(12)
    gyro[[2, 9]] = 1.0
    row = rng.standard_normal(12)
    for call, h in ((gyro_column, gyro), (lambda w: entry_column(w, 4), np.eye(12)[4]), (row_column, row)):
        work = load(state, covariance)
        work[layout.ROW : layout.ROW + 12] = row
        expected = call(work)
        np.testing.assert_allclose(work[layout.COLUMN : layout.COLUMN + 12], covariance @ h, rtol=1e-12)
        assert expected == pytest.approx(h @ covariance @ h, rel=1e-12)


def test_heavier_robot_feels_less(robot, load, turning_state):
    state, _ = turning_state
    light, heavy = FilterModel(robot), FilterModel(replace(robot, mass=2 * robot.mass))
    assert predicted_force(light, load, state, 0) == pytest.approx(2 * predicted_force(heavy, load, state, 0))
