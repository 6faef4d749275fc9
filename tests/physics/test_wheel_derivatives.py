"""Derivatives of the wheels' wrenches against differences of the entry points, and what is predicted with them."""

from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.parameters import Numerics
from ddagr_gym.physics import layout, wheel_force
from ddagr_gym.physics.body_dynamics import evaluate_forces, extrapolate_forces
from ddagr_gym.physics.callbacks import EffectActions
from ddagr_gym.physics.numerics import step_numerics
from ddagr_gym.physics.wheel_derivatives import change_of, is_stale, predict_sinkage, relative_motion
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.simulator import Simulator

# Accurate everywhere, so that differences are those of the formulas
FINE = Numerics(section_nodes=16, contact_nodes=16, jacobian_contact_nodes=16, sinkage_tolerance=1e-10)
MOTION = {"v_x": 0.21, "v_y": -0.03, "yaw_rate": 0.15, "omega_right": 1.1, "omega_left": 0.7}
ROBOT, SOIL = get_robot("ddagr"), get_soil("thesis_a1")
WHEEL = ROBOT.wheels[0]
OUTER_RADIUS = WHEEL.outer_radius


@pytest.fixture
def simulator():
    """One DDAGR in MOTION, forces and derivatives evaluated."""
    found = Simulator(1, numerics=FINE)
    found.configure(0, ROBOT, SOIL)
    found.reset(state=MOTION)
    return found


def _evaluate(simulator, row, refresh):
    evaluate_forces(row, refresh, step_numerics(simulator.numerics), _no_effects())


def _no_effects():
    nothing = np.zeros(0, dtype=np.int64)
    return EffectActions(nothing, nothing, np.zeros((0, layout.EFFECT_PARAMETERS)), np.zeros((0, layout.EFFECT_MEMORY)))


def _wrench(v_x, v_y, omega, yaw_rate, sinkage):
    found = wheel_force(WHEEL, SOIL, v_x, v_y, omega, yaw_rate, sinkage, numerics=FINE)
    return np.array([*found.force, found.yaw_moment, found.axle_torque])


def _state(row, i):
    return np.array([row[k + i] for k in (layout.WHEEL_V_X, layout.WHEEL_V_Y, layout.WHEEL_OMEGA)])


def _forces(row):
    blocks = (layout.FORCE_X, layout.FORCE_Y, layout.FORCE_Z, layout.YAW_MOMENT, layout.AXLE_TORQUE)
    return np.array([row[first : first + 4] for first in blocks])


@pytest.mark.parametrize("i", range(4))
def test_derivatives_are_those_of_the_wheel_force(simulator, i):
    row = simulator.rows[0]
    v_x, v_y, omega = _state(row, i)
    speed = relative_motion(row, i)[3]
    assert speed == max(abs(v_x), abs(OUTER_RADIUS * omega))
    step = 1e-6
    for component in range(5):
        for direction, moved in enumerate(np.diag([step, step, step / OUTER_RADIUS])):
            ahead, behind = (
                _wrench(v_x + s * moved[0], v_y + s * moved[1], omega + s * moved[2], row[layout.YAW_RATE],
                        row[layout.SINKAGE + i])
                for s in (1.0, -1.0)
            )  # fmt: skip
            slope = (ahead - behind)[component] / (2 * step)
            changes = [0.0, 0.0, 0.0, 0.0]
            changes[direction] = 1.0 / speed
            scale = np.abs(row[layout.FORCE_Z + i]) / speed
            assert change_of(row, i, component, *changes) == pytest.approx(slope, abs=2e-3 * scale)


def test_derivatives_by_relative_motion_do_not_depend_on_the_speed(simulator):
    slow = simulator.rows[0].copy()
    simulator.reset(state={name: 2.0 * value for name, value in MOTION.items()})
    fast = simulator.rows[0]
    block = slice(layout.DERIVATIVE, layout.DERIVATIVE + 4 * layout.DERIVATIVE_SIZE)
    np.testing.assert_allclose(fast[block], slow[block], rtol=2e-3, atol=1e-3 * np.abs(slow[block]).max())


def test_a_robot_that_only_gains_speed_keeps_its_derivatives(simulator):
    row = simulator.rows[0]
    row[layout.WHEEL_V_X : layout.WHEEL_V_X + 12] *= 1.7
    assert not any(is_stale(row, i, 0.01) for i in range(4))
    row[layout.WHEEL_OMEGA] *= 1.02
    assert [is_stale(row, i, 0.01) for i in range(4)] == [True, False, False, False]
    row[layout.DERIVATIVE_VALID] = 0.0
    assert all(is_stale(row, i, 0.01) for i in range(4))


def test_derivatives_at_rest_are_stale_with_any_motion():
    simulator = Simulator(1, numerics=FINE)
    simulator.configure(0, ROBOT, SOIL)
    simulator.reset()
    row = simulator.rows[0]
    assert not is_stale(row, 0, 0.1)
    row[layout.WHEEL_V_X] = 1e-7
    assert is_stale(row, 0, 0.1)


def _errors(simulator, predict):
    """Errors of ``predict(row, exact)`` for changes of the motion by 4, 2 and 1 percent."""
    errors = []
    for size in (0.04, 0.02, 0.01):
        row, exact = simulator.rows[0].copy(), simulator.rows[0].copy()
        for moved in (row, exact):
            moved[layout.V_X] *= 1.0 + size
            moved[layout.V_Y] += 0.5 * size * MOTION["v_x"]
            moved[layout.YAW_RATE] *= 1.0 - size
        _evaluate(simulator, exact, -1.0)
        errors.append(predict(row, exact))
    return errors


def _assert_second_order(errors):
    """The part of the yaw rate, which predictions leave out, is of first order and small."""
    assert errors[0] > 2.2 * errors[1] > 4.8 * errors[2] > 0


def test_predicted_sinkage_is_right_to_second_order(simulator):
    def predict(row, exact):
        motion = [relative_motion(row, i) for i in range(4)]
        row[layout.WHEEL_V_X : layout.WHEEL_V_X + 12] = exact[layout.WHEEL_V_X : layout.WHEEL_V_X + 12]
        # the yaw rate is no part of the prediction
        for i in range(4):
            predict_sinkage(row, i, *motion[i][:3])
        found = exact[layout.SINKAGE : layout.SINKAGE + 4]
        before = simulator.rows[0][layout.SINKAGE : layout.SINKAGE + 4]
        assert np.abs(row[layout.SINKAGE : layout.SINKAGE + 4] - found).max() < 0.3 * np.abs(before - found).max()
        return np.abs(row[layout.SINKAGE : layout.SINKAGE + 4] - found).max()

    _assert_second_order(_errors(simulator, predict))


def test_extrapolated_forces_are_right_to_second_order(simulator):
    def predict(row, exact):
        assert extrapolate_forces(row, 0.2, _no_effects())
        np.testing.assert_allclose(
            row[layout.WHEEL_V_X : layout.WHEEL_V_X + 12], exact[layout.WHEEL_V_X : layout.WHEEL_V_X + 12], rtol=1e-14
        )
        np.testing.assert_allclose(row[layout.FORCE_Z : layout.FORCE_Z + 4], row[layout.LOAD : layout.LOAD + 4])
        change = np.abs(_forces(exact) - _forces(simulator.rows[0])).max()
        error = np.abs(_forces(row) - _forces(exact)).max()
        assert error < 0.3 * change
        return error

    _assert_second_order(_errors(simulator, predict))


@pytest.mark.parametrize("reason", ["limit of zero", "change beyond the limit", "bogged", "unloaded", "no derivative"])
def test_forces_are_not_extrapolated_where_it_may_not_be(simulator, reason):
    row = simulator.rows[0].copy()
    row[layout.V_X] *= 1.01
    limit = 0.05
    if reason == "limit of zero":
        limit = 0.0
    elif reason == "change beyond the limit":
        row[layout.V_X] *= 1.2
    elif reason == "bogged":
        row[layout.BOGGED + 2] = 1.0
    elif reason == "unloaded":
        row[layout.LOAD + 1] = 0.0
    else:
        row[layout.DERIVATIVE_VALID] = 0.0
    before = row.copy()
    assert not extrapolate_forces(row, limit, _no_effects())
    np.testing.assert_array_equal(row, before)
