import dataclasses
import math

import numpy as np
import pytest

from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.errors import InputError
from ddagr_gym.evaluation.metrics import (
    TurnStatus,
    exit_state,
    integral_radius,
    radial_error,
    turn_metrics,
    turn_radius_error,
)
from ddagr_gym.parameters import Robot, TorusWheel

ROBOT = Robot(
    name="test",
    mass=168.0,
    yaw_inertia=100.0,
    half_wheelbase=0.33,
    half_track=0.58,
    wheels=(TorusWheel(0.05, 0.1016, 0.2294),),
)


def drive(turn, radius=None, slip_angle=0.0, spacing=0.01, extra_heading=0.0):
    """Pose along a turn driven at another radius than commanded, the body yawed inwards by ``slip_angle``."""
    driven = turn.with_values(radius=radius or turn.radius)
    path = driven.sample(spacing)
    on_turn = (path.distance > driven.run_in) & (path.distance < driven.run_in + driven.turn_length)
    yaw = path.yaw + turn.sign * np.where(on_turn, slip_angle, 0.0)
    if extra_heading:
        c, s = math.cos(extra_heading), math.sin(extra_heading)
        return path.x * c - path.y * s, path.x * s + path.y * c, yaw + extra_heading
    return path.x, path.y, yaw


def columns_of(turn, radius=None, rate=125.0):
    driven = turn.with_values(radius=radius or turn.radius)
    t = np.arange(0.0, driven.duration, 1.0 / rate)
    distance = driven.distance_at(t)
    x, y = driven.position(distance).T
    yaw_rate = driven.yaw_rate(distance)
    right, left = ((turn.speed + side * 0.58 * yaw_rate) / 0.28 for side in (1, -1))
    return {
        "t": t,
        "command_right": right,
        "command_left": left,
        "true_omega_right": right,
        "true_omega_left": left,
        "true_x": x,
        "true_y": y,
        "true_yaw": driven.heading(distance),
        "true_v_x": np.full_like(t, turn.speed),
        "true_v_y": np.zeros_like(t),
        "true_yaw_rate": yaw_rate,
    }


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize(("target", "driven"), [(0.8, 0.8), (0.8, 0.92), (1.2, 1.0), (0.65, 0.7)])
def test_radius_error_of_a_known_arc(side, target, driven):
    turn = RowTurn(radius=target, side=side)
    result = turn_radius_error(*drive(turn, driven), target, side)
    assert result.status is TurnStatus.COMPLETE
    assert result.radius == pytest.approx(driven, rel=1e-9)
    assert result.error == pytest.approx(driven / target - 1, abs=1e-9)
    assert result.integral_radius == pytest.approx(driven, rel=1e-4)
    assert result.residual < 1e-9
    assert result.consistent
    assert result.heading_change == pytest.approx(math.pi)


def test_radius_does_not_depend_on_frame_wrapping_or_slip_angle():
    turn = RowTurn()
    x, y, yaw = drive(turn, 0.9, slip_angle=0.1, extra_heading=2.5)
    result = turn_radius_error(x + 100.0, y - 50.0, np.arctan2(np.sin(yaw), np.cos(yaw)), 0.8, "left")
    assert result.radius == pytest.approx(0.9, rel=1e-9)
    assert result.consistent


def test_spiral_is_flagged_by_the_cross_check():
    angle = np.linspace(0, math.pi, 2000)
    radius = 0.5 + 0.25 * angle
    steps = radius * angle[1]
    x, y = np.cumsum(steps * np.cos(angle)), np.cumsum(steps * np.sin(angle))
    result = turn_radius_error(x, y, angle, 0.8, "left")
    window = (angle >= math.radians(30)) & (angle <= math.radians(150))
    assert result.status is TurnStatus.COMPLETE
    assert result.integral_radius == pytest.approx(np.mean(radius[window]), rel=1e-3)
    assert result.disagreement > 0.01
    assert not result.consistent
    assert result.residual > 0.005


def test_short_arc_has_its_own_status():
    turn = RowTurn()
    x, y, yaw = drive(turn, 0.9)
    part = np.abs(yaw) < math.radians(100)
    result = turn_radius_error(x[part], y[part], yaw[part], 0.8, "left")
    assert result.status is TurnStatus.SHORT_ARC
    assert result.radius == pytest.approx(0.9)
    assert result.heading_change == pytest.approx(math.radians(100), abs=0.02)


@pytest.mark.parametrize("side", ["left", "right"])
def test_undefined_radius_is_none_with_a_status(side):
    turn = RowTurn(side=side)
    x, y, yaw = drive(turn)
    straight = turn_radius_error(x, 0 * y, 0 * yaw, 0.8, side)
    wrong_side = turn_radius_error(x, y, -yaw, 0.8, side)
    on_the_spot = turn_radius_error(0 * x, 0 * y, yaw, 0.8, side)
    assert straight.status is wrong_side.status is TurnStatus.NO_TURN
    assert on_the_spot.status is TurnStatus.NOT_A_CIRCLE
    for result in (straight, wrong_side, on_the_spot):
        assert (result.radius, result.error, result.integral_radius, result.consistent) == (None, None, None, False)


def test_integral_radius_is_signed_by_side_and_none_on_a_line():
    x, y, _ = drive(RowTurn(side="right"))
    assert integral_radius(x[120:300], y[120:300], "right") == pytest.approx(0.8, rel=1e-4)
    assert integral_radius(x[120:300], y[120:300], "left") == pytest.approx(-0.8, rel=1e-4)
    assert integral_radius(x[:90], y[:90], "right") is None
    assert integral_radius(x[:1], y[:1], "right") is None


def test_radial_error_of_an_offset_circle():
    """A circle of R + 0.1 that starts on the path: distance from the commanded centre by the cosine rule."""
    turn = RowTurn()
    rms, largest = radial_error(*drive(turn, 0.9), turn)
    angle = np.linspace(0, math.pi, 20001)
    expected = np.sqrt(0.9**2 + 0.1**2 - 2 * 0.9 * 0.1 * np.cos(angle)) - 0.8
    assert largest == pytest.approx(0.2, abs=1e-3)
    assert rms == pytest.approx(math.sqrt(np.mean(expected**2)), rel=5e-3)
    x, y, yaw = drive(turn)
    assert radial_error(x - 10.0, y, yaw, turn) is None


@pytest.mark.parametrize(("side", "sign"), [("left", 1), ("right", -1)])
def test_exit_is_interpolated_at_the_start_line(side, sign):
    turn = RowTurn(side=side)
    x, y, yaw = drive(turn, 0.83, spacing=0.03)
    t = np.linspace(0.0, 20.0, len(x))
    leave = exit_state(t, x, y, yaw, turn, 0.33)
    assert leave.lateral_error == pytest.approx(-sign * 0.06, abs=1e-4)
    assert leave.heading_error == pytest.approx(0.0, abs=0.02)
    assert leave.time == pytest.approx(20.0 * (1 + 0.83 * math.pi) / (1.5 + 0.83 * math.pi), abs=0.01)
    assert leave.wheels_fit
    assert leave.within_practice


@pytest.mark.parametrize(
    ("radius", "fits", "practice"), [(0.84, True, True), (0.86, True, False), (0.87, False, False)]
)
def test_both_success_criteria(radius, fits, practice):
    turn = RowTurn()
    x, y, yaw = drive(turn, radius, spacing=0.002)
    leave = exit_state(np.arange(len(x)), x, y, yaw, turn, 0.33)
    assert (leave.wheels_fit, leave.within_practice) == (fits, practice)


def test_backing_over_the_line_on_the_way_in_is_no_exit():
    turn = RowTurn()
    x, y, yaw = drive(turn)
    start = int(np.argmax(x > 0.02))
    stutter = np.concatenate([np.arange(start), np.arange(start, start - 8, -1), np.arange(start - 8, len(x))])
    t = np.arange(len(stutter), dtype=float)
    leave = exit_state(t, x[stutter], y[stutter], yaw[stutter], turn, 0.33)
    assert leave.lateral_error == pytest.approx(0.0, abs=1e-4)
    half = len(stutter) // 2
    assert exit_state(t[:half], x[stutter][:half], y[stutter][:half], yaw[stutter][:half], turn, 0.33) is None


def test_metrics_of_a_whole_turn():
    turn = RowTurn(radius=0.8, side="right")
    metrics = turn_metrics(columns_of(turn, 0.83), turn, ROBOT)
    assert metrics.turn.error == pytest.approx(0.03 / 0.8, abs=1e-6)
    assert metrics.exit.lateral_error == pytest.approx(0.06, abs=1e-3)
    assert metrics.duration == pytest.approx((1.0 + 0.83 * math.pi) / turn.speed, abs=0.01)
    assert metrics.radial_error_maximum == pytest.approx(0.06, abs=1e-3)
    assert metrics.slip_energy is None
    assert (metrics.bank_stalls, metrics.robot_stalls) == (0, 0)
    step = 2 * 0.58 * turn.speed / 0.83 / 0.28
    assert metrics.wheel_speed_variation == pytest.approx(2 * step / metrics.duration, rel=0.01)


def test_metrics_never_hold_nan_and_say_when_there_is_no_turn():
    turn = RowTurn()
    still = {name: np.zeros(100) for name in columns_of(turn)} | {"t": np.arange(100) / 125.0}
    still["true_x"] = np.full(100, -1.0)
    metrics = turn_metrics(still, turn, ROBOT)
    assert metrics.turn.status is TurnStatus.NO_TURN
    assert (metrics.exit, metrics.radial_error_rms, metrics.slip_energy) == (None, None, None)
    flat = dataclasses.asdict(metrics)
    numbers = [v for v in [*flat.values(), *flat["turn"].values()] if isinstance(v, float)]
    assert np.isfinite(numbers).all()


def test_metrics_use_wheel_forces_up_to_the_exit():
    """Four wheels dragged at their hub speed against 10 N: the energy is 10 N times the way of each hub."""
    turn = RowTurn(run_in=0.0)
    columns = columns_of(turn)
    for wheel in range(1, 5):
        forces = {name: np.zeros_like(columns["t"]) for name in ("force_y", "yaw_moment", "axle_torque")}
        columns |= {f"true_{name}_{wheel}": value for name, value in forces.items()}
        columns[f"true_force_x_{wheel}"] = np.full_like(columns["t"], -10.0)
    metrics = turn_metrics(columns, turn, ROBOT)
    assert metrics.slip_energy == pytest.approx(4 * 10.0 * math.pi * 0.8, rel=0.01)
    del columns["true_yaw_moment_3"]
    assert turn_metrics(columns, turn, ROBOT).slip_energy is None


def test_bad_input_is_one_sentence():
    turn = RowTurn()
    columns = columns_of(turn)
    with pytest.raises(InputError, match="column 'true_yaw' is missing"):
        turn_metrics({k: v for k, v in columns.items() if k != "true_yaw"}, turn, ROBOT)
    columns["true_x"] = columns["true_x"].copy()
    columns["true_x"][7] = math.nan
    with pytest.raises(InputError, match=r"true_x\[7\] is nan"):
        turn_metrics(columns, turn, ROBOT)
    with pytest.raises(InputError, match=r"y has shape \(2,\)"):
        turn_radius_error([0.0, 1.0, 2.0], [0.0, 1.0], [0.0, 1.0, 2.0], 0.8, "left")
    with pytest.raises(InputError, match="target_radius is -1"):
        turn_radius_error([0.0], [0.0], [0.0], -1.0, "left")
    with pytest.raises(InputError, match="unknown side 'up'"):
        turn_radius_error([0.0], [0.0], [0.0], 0.8, "up")
