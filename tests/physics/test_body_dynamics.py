"""Loads, gravity and Newton-Euler of the body against statics and an independent rigid-body calculation."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddagr_gym.parameters import STANDARD_GRAVITY, Numerics, Robot, Sensors
from ddagr_gym.physics import equilibrium_sinkage, layout, wheel_force
from ddagr_gym.physics.body_dynamics import accelerate, place_wheels, restore_body, share_load, tilt_gravity
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.simulator import Simulator, build_row

OFFSETS = st.tuples(st.floats(-0.3, 0.3), st.floats(-0.5, 0.5), st.floats(0.0, 1.0))
ANGLES = st.floats(-math.pi, math.pi)


def _row(robot: Robot | None = None, **entries: float) -> np.ndarray:
    row = build_row(robot or get_robot("ddagr"), get_soil("thesis_a1"), Sensors())
    restore_body(row)
    for name, value in entries.items():
        values = np.atleast_1d(value)
        index = getattr(layout, name)
        row[index : index + values.size] = values
    return row


def _loads(row):
    return row[layout.LOAD : layout.LOAD + 4]


@given(OFFSETS)
def test_loads_carry_the_weight_through_the_centre_of_mass(offset):
    robot = get_robot("ddagr").with_values(centre_of_mass=offset)
    row = _row(robot)
    tilt_gravity(row)
    share_load(row)
    loads, weight = _loads(row), robot.mass * STANDARD_GRAVITY
    assert loads.sum() == pytest.approx(weight)
    assert loads @ robot.wheel_x == pytest.approx(weight * offset[0], abs=1e-9 * weight)
    assert loads @ robot.wheel_y == pytest.approx(weight * offset[1], abs=1e-9 * weight)
    assert (loads >= 0).all()


@given(st.floats(-0.25, 0.25), ANGLES, ANGLES)
def test_gravity_on_a_slope_is_fixed_in_the_world(angle, direction, yaw):
    gradient = math.tan(angle) * np.array([math.cos(direction), math.sin(direction)])
    row = _row(SLOPE=gradient, YAW=yaw)
    tilt_gravity(row)
    gravity = row[layout.GRAVITY : layout.GRAVITY + 3]
    assert np.linalg.norm(gravity) == pytest.approx(STANDARD_GRAVITY)
    # body axes back to the ground plane's: the downhill part points down the gradient and does not depend on yaw
    turn = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
    downhill = -STANDARD_GRAVITY * math.sin(angle) * np.array([math.cos(direction), math.sin(direction)])
    np.testing.assert_allclose(turn @ gravity[:2], downhill, atol=1e-12)


def test_uphill_wheels_are_relieved_by_the_height_of_the_centre_of_mass():
    robot = get_robot("ddagr")
    angle, height = 0.1, robot.centre_of_mass[2]
    row = _row(robot, SLOPE=[math.tan(angle), 0.0])
    tilt_gravity(row)
    share_load(row)
    normal = robot.mass * STANDARD_GRAVITY * math.cos(angle)
    shift = height * math.tan(angle) / robot.half_wheelbase
    front, rear = 0.25 * normal * (1 - shift), 0.25 * normal * (1 + shift)
    np.testing.assert_allclose(_loads(row), [front, front, rear, rear], rtol=1e-12)


def test_tipping_robot_unloads_a_side_and_never_pulls():
    row = _row(get_robot("ddagr").with_values(centre_of_mass=(0.0, 0.0, 3.0)), SLOPE=[0.0, 0.5])
    tilt_gravity(row)
    share_load(row)
    loads = _loads(row)
    np.testing.assert_allclose(loads[[1, 3]], 0.0)
    assert (loads[[0, 2]] > 0).all()


@given(
    OFFSETS, st.floats(-2, 2), st.floats(-2, 2), st.floats(-2, 2), st.floats(-500, 500), st.floats(-500, 500),
    st.floats(-300, 300),
)  # fmt: skip
def test_acceleration_of_the_origin_is_newton_eulers(offset, v_x, v_y, rate, force_x, force_y, moment):
    """Solve the same motion about the centre of mass in an inertial frame, then carry it to the body origin."""
    robot = get_robot("ddagr").with_values(centre_of_mass=offset)
    row = _row(robot, V_X=v_x, V_Y=v_y, YAW_RATE=rate)
    accelerate(row, np.array([force_x, force_y, moment]))
    force = np.array([force_x, force_y, 0.0])
    arm = np.array([offset[0], offset[1], 0.0])
    spin = np.array([0.0, 0.0, rate])
    at_centre = force / robot.mass
    alpha = (np.array([0.0, 0.0, moment]) + np.cross(-arm, force)) / robot.yaw_inertia
    at_origin = at_centre + np.cross(alpha, -arm) + np.cross(spin, np.cross(spin, -arm))
    np.testing.assert_allclose(row[layout.SPECIFIC_FORCE : layout.SPECIFIC_FORCE + 2], at_origin[:2], atol=1e-10)
    in_body_axes = at_origin - np.cross(spin, np.array([v_x, v_y, 0.0]))
    derivative = row[layout.ACCELERATION : layout.ACCELERATION + 3]
    np.testing.assert_allclose(derivative, [*in_body_axes[:2], alpha[2]], atol=1e-10)


@given(st.floats(-5, 5), st.floats(-5, 5), ANGLES)
def test_hubs_are_placed_by_the_pose(x, y, yaw):
    robot = get_robot("ddagr")
    row = _row(robot, X=x, Y=y, YAW=yaw)
    place_wheels(row)
    hubs = (x + 1j * y) + (np.array(robot.wheel_x) + 1j * np.array(robot.wheel_y)) * np.exp(1j * yaw)
    np.testing.assert_allclose(row[layout.WHEEL_X : layout.WHEEL_X + 4], hubs.real, atol=1e-12)
    np.testing.assert_allclose(row[layout.WHEEL_Y : layout.WHEEL_Y + 4], hubs.imag, atol=1e-12)


MOTION = {"v_x": 0.21, "v_y": -0.03, "yaw_rate": 0.4, "omega_right": 1.1, "omega_left": 0.3}


def test_settled_wheels_are_the_entry_points_wheels():
    """The body's forces are ``equilibrium_sinkage`` and ``wheel_force`` at each hub, summed by Newton-Euler."""
    robot, soil, numerics = get_robot("ddagr"), get_soil("thesis_a1"), Numerics(sinkage_tolerance=1e-8)
    simulator = Simulator(1, numerics=numerics)
    simulator.configure(0, robot, soil)
    simulator.reset(state=MOTION)
    row = simulator.rows[0]
    total = np.zeros(3)
    for i in range(4):
        x, y = robot.wheel_x[i], robot.wheel_y[i]
        v_x, v_y = MOTION["v_x"] - MOTION["yaw_rate"] * y, MOTION["v_y"] + MOTION["yaw_rate"] * x
        omega = MOTION["omega_left" if i % 2 else "omega_right"]
        motion = (v_x, v_y, omega, MOTION["yaw_rate"])
        load = 0.25 * robot.mass * STANDARD_GRAVITY
        sinkage, _ = equilibrium_sinkage(robot.wheels[i], soil, *motion, load, numerics=Numerics.finest())
        result = wheel_force(robot.wheels[i], soil, *motion, sinkage)
        assert row[layout.SINKAGE + i] == pytest.approx(sinkage, rel=1e-3)
        assert row[layout.SLIP_RATIO + i] == pytest.approx(float(result.slip_ratio), abs=1e-12)
        force = [row[layout.FORCE_X + i], row[layout.FORCE_Y + i], row[layout.FORCE_Z + i]]
        np.testing.assert_allclose(force, result.force, atol=1e-3 * load)
        assert row[layout.AXLE_TORQUE + i] == pytest.approx(float(result.axle_torque), abs=1e-3 * load * 0.28)
        moment = x * result.force[1] - y * result.force[0] + result.yaw_moment
        total += [result.force[0], result.force[1], moment]
    expected = [
        MOTION["yaw_rate"] * MOTION["v_y"] + total[0] / robot.mass,
        -MOTION["yaw_rate"] * MOTION["v_x"] + total[1] / robot.mass,
        total[2] / robot.yaw_inertia,
    ]
    np.testing.assert_allclose(row[layout.ACCELERATION : layout.ACCELERATION + 3], expected, atol=5e-3)
