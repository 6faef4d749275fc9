"""Process model: forces of the body, integration scheme, transition matrix."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ddagr_gym.estimation import FilterModel, ForceLaw, SoilPrior, layout, predict, roll_out
from ddagr_gym.estimation.force_laws import LawParameters, wheel_law
from ddagr_gym.estimation.process_model import advance_state, body_forces

MODELS = [ForceLaw.thesis, ForceLaw.coupled]
MOTIONS = [
    [0.155, 0.004, 0.21, 1.19, 0.05],  # left turn
    [0.155, -0.004, -0.21, 0.05, 1.19],  # right turn
    [0.19, 0.0, 0.0, 0.70, 0.71],  # straight
    [-0.15, 0.01, 0.1, -0.6, -0.4],  # backwards
    [0.02, 0.0, 0.3, 0.9, -0.8],  # on the spot
]


def wheel_sums(model, state):
    """Specific force x, y and yaw acceleration, wheel by wheel."""
    robot = model.robot
    parameters = LawParameters(*np.exp(state[5:9]), model.rest_speed, model.reversal_speed)
    total = np.zeros(3)
    for i, (x, y) in enumerate(zip(robot.wheel_x, robot.wheel_y, strict=True)):
        rim = model.outer_radius * state[3 + i % 2]
        values = wheel_law(float(model.law), state[0] - state[2] * y, state[1] + state[2] * x, rim, parameters)
        f_x, f_y = values[0], values[8]
        total += [f_x / robot.mass, f_y / robot.mass, (x * f_y - y * f_x) / robot.yaw_inertia]
    return total


@pytest.mark.parametrize("law", MODELS)
@pytest.mark.parametrize("motion", MOTIONS)
def test_body_is_the_sum_over_wheels(robot, load, law, motion):
    model = FilterModel(robot, law=law)
    state, _ = model.initial()
    state[:5] = motion
    work = load(state)
    body_forces(model.pack(), work)
    np.testing.assert_allclose(work[layout.FORCE : layout.FORCE + 3], wheel_sums(model, state), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("law", MODELS)
@pytest.mark.parametrize("motion", MOTIONS)
def test_gradient_against_fourth_order_differences(robot, load, view, law, motion):
    model = FilterModel(robot, law=law)
    state, _ = model.initial()
    state[:5] = motion
    work = load(state)
    body_forces(model.pack(), work)
    found = view(work, layout.GRADIENT, 3)[:, : layout.MOTION_SIZE]
    for k in range(layout.MOTION_SIZE):
        h = 1e-4
        e = np.eye(layout.STATE_SIZE)[k] * h

        def at(s):
            return wheel_sums(model, s)

        difference = (8 * (at(state + e) - at(state - e)) - at(state + 2 * e) + at(state - 2 * e)) / (12 * h)
        np.testing.assert_allclose(found[:, k], difference, rtol=2e-5, atol=2e-5 * np.abs(found).max())


def test_motors_follow_their_exact_solution(model, load):
    state, _ = model.initial()
    work = load(state)
    decays = advance_state(model.pack(), work, 1.2, -0.4, 0.0, 0.0, 0.05)
    expected = math.exp(-model.robot.motor_rate * 0.05)
    assert decays == pytest.approx((expected, expected), rel=1e-14)
    np.testing.assert_allclose(work[3:5], [1.2 * (1 - expected), -0.4 * (1 - expected)], rtol=1e-14)


def test_a_bank_without_known_command_keeps_its_speed(model, load):
    state, _ = model.initial()
    state[3:5] = 0.4, 0.7
    work = load(state)
    decay_right, decay_left = advance_state(model.pack(), work, math.nan, 0.7, 0.0, 0.0, 0.05)
    assert decay_right == 1.0
    assert decay_left < 1.0
    np.testing.assert_allclose(work[3:5], [0.4, 0.7], rtol=1e-14)


def reference(model, state, command, duration):
    """Velocities and bank speeds after ``duration`` by a stiff solver to 1e-11."""

    def rate(_, y):
        full = state.copy()
        full[:5] = y
        f_x, f_y, turn = wheel_sums(model, full)
        motors = model.robot.motor_rate * (np.asarray(command) - y[3:5])
        return [f_x + y[2] * y[1], f_y - y[2] * y[0], turn, *motors]

    return solve_ivp(rate, (0.0, duration), state[:5], method="Radau", rtol=1e-10, atol=1e-12).y[:, -1]


@pytest.mark.parametrize("law", MODELS)
def test_second_order_convergence(robot, law):
    # From straight into a left turn: smooth, with damping of about 100 1/s.
    model = FilterModel(robot, law=law)
    state, _ = model.initial()
    state[:5] = [0.19, 0.0, 0.0, 0.70, 0.70]
    exact = reference(model, state, (1.0, 0.5), 0.2)[:3]
    errors = []
    for steps in (100, 200, 400, 800):
        fine = replace(model, sample_period=0.2 / steps)
        errors.append(np.abs(roll_out(fine, state, np.tile([1.0, 0.5], (steps, 1)))[-1, :3] - exact).max())
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    np.testing.assert_allclose(orders[1:], 2.0, atol=0.15)


def test_sample_step_is_accurate_in_a_turn(model):
    state, _ = model.initial()
    state[:5] = [0.19, 0.0, 0.0, 0.70, 0.70]
    steps = 100
    coarse = roll_out(model, state, np.tile([1.19, 0.2], (steps, 1)))[-1, :3]
    exact = reference(model, state, (1.19, 0.2), steps * model.sample_period)[:3]
    np.testing.assert_allclose(coarse, exact, atol=1e-4)


def test_large_step_at_a_locked_wheel_stays_put(model):
    # Explicit steps of 8 ms explode here: eigenvalues reach 1e3 1/s with one bank locked.
    state, _ = model.initial()
    state[:5] = [0.122, 0.0, 0.21, 1.195, 0.0]
    series = roll_out(model, state, np.tile([1.195, 0.0], (500, 1)))
    late = series[200:]
    assert np.isfinite(series).all()
    assert np.ptp(late[:, 0]) < 1e-4
    assert np.ptp(late[:, 2]) < 1e-4
    assert 0.10 < late[-1, 0] < 0.20


def test_stops_and_stays_at_rest(model):
    state, _ = model.initial()
    state[:5] = [0.19, 0.0, 0.05, 0.70, 0.70]
    series = roll_out(model, state, np.zeros((1000, 2)))
    assert np.abs(series[-1, :3]).max() < 1e-6


def test_doubling_all_forces_leaves_a_steady_turn(model):
    state, _ = model.initial()
    drive = np.tile([1.1, 0.3], (1500, 1))
    doubled = state.copy()
    doubled[[5, 7, 8]] += math.log(2.0)
    one, two = roll_out(model, state, drive)[-1, :3], roll_out(model, doubled, drive)[-1, :3]
    # not exact: centripetal force m r v_x stays
    np.testing.assert_allclose(one[[0, 2]], two[[0, 2]], rtol=2e-3)
    lighter = replace(model, robot=replace(model.robot, mass=0.5 * model.robot.mass))
    light = roll_out(lighter, state, drive)[-1, :3]
    np.testing.assert_allclose(light, two, rtol=1e-9)


@pytest.mark.parametrize("law", MODELS)
def test_left_and_right_turns_are_mirror_images(robot, law):
    model = FilterModel(robot, law=law)
    state, _ = model.initial()
    right = roll_out(model, state, np.tile([0.3, 1.1], (400, 1)))
    left = roll_out(model, state, np.tile([1.1, 0.3], (400, 1)))
    np.testing.assert_allclose(left[:, [0, 1, 2]], right[:, [0, 1, 2]] * [1, -1, -1], atol=1e-12)


def test_driving_backwards_mirrors_driving_forwards(model):
    state, _ = model.initial()
    there = roll_out(model, state, np.tile([1.1, 0.3], (400, 1)))
    back = roll_out(model, state, np.tile([-1.1, -0.3], (400, 1)))
    np.testing.assert_allclose(there[:, [0, 2]], -back[:, [0, 2]], atol=1e-12)
    np.testing.assert_allclose(there[:, 1], back[:, 1], atol=1e-12)


def test_nose_down_drives_forward_and_left_side_down_slides_left(model):
    # REP 103: pitch about y (left) nose down positive, roll about x (forward) right side down positive.
    state, covariance = model.initial()
    state[:5] = [0.19, 0.0, 0.0, 0.70, 0.70]
    level = predict(model, state, covariance, (0.7, 0.7)).state
    nose_down = predict(model, state, covariance, (0.7, 0.7), attitude=(0.0, 0.1)).state
    left_down = predict(model, state, covariance, (0.7, 0.7), attitude=(-0.1, 0.0)).state
    assert nose_down[0] > level[0]
    assert left_down[1] > level[1]
    np.testing.assert_allclose([nose_down[1], left_down[0]], [level[1], level[0]], atol=1e-6)


def test_more_resistance_slows_the_straight(robot):
    speeds = []
    for share in (0.05, 0.15, 0.30):
        model = FilterModel(robot, prior=SoilPrior(resistance_over_limit=share))
        speeds.append(roll_out(model, model.initial()[0], np.full((600, 2), 0.7))[-1, 0])
    rolling = model.outer_radius * 0.7
    # a1 (1 - exp(-a2 s)) = Rc on a straight
    expected = [rolling * (1 + math.log(1 - share) / model.soil_prior.traction_rate) for share in (0.05, 0.15, 0.30)]
    np.testing.assert_allclose(speeds, expected, rtol=1e-3)


@pytest.mark.parametrize("motion", MOTIONS[:4])
def test_transition_matrix_is_the_derivative_of_the_step(model, load, view, motion):
    # Up to the derivative of A, which is of second order in the step: short steps, and the error must shrink with h^2.
    state, _ = model.initial()
    state[:5] = motion
    packed = model.pack()
    errors = []
    for step in (4e-4, 2e-4):

        def advanced(s, step=step):
            work = load(s)
            advance_state(packed, work, motion[3], motion[4], 0.0, 0.0, step)
            return work[:3].copy()

        work = load(state)
        advance_state(packed, work, motion[3], motion[4], 0.0, 0.0, step)
        found = view(work, layout.TRANSITION, 3)[:, : layout.MOTION_SIZE].copy()
        h = 1e-5
        units = np.eye(layout.STATE_SIZE)[: layout.MOTION_SIZE] * h
        difference = np.stack([(advanced(state + e) - advanced(state - e)) / (2 * h) for e in units], axis=1)
        errors.append(np.abs(found - difference).max())
    assert errors[0] < 2e-3
    assert errors[1] < 0.35 * errors[0] + 1e-7


def test_response_turns_a_constant_acceleration_into_velocity(model, load, view, turning_state):
    # gravity along the body is such an acceleration: the step must move the state by G times it
    state, _ = turning_state
    packed, change = model.pack(), []
    for slope in (0.0, 0.05):
        work = load(state)
        advance_state(packed, work, 1.19, 0.05, slope, 0.0, 0.008)
        change.append(work[:3].copy())
    response = view(work, layout.RESPONSE, 3)[:, 0]
    np.testing.assert_allclose((change[1] - change[0]) / 0.05, response, rtol=1e-9)
