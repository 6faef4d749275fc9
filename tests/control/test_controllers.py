"""Controllers of a row turn: loops by hand-made cases, and their order on a soft soil."""

import math

import numpy as np
import pytest

from ddagr_gym.control.constant_speeds import ConstantSpeeds
from ddagr_gym.control.observation import OBSERVATION, SCALES, decode
from ddagr_gym.control.pid import Pid, PidGains
from ddagr_gym.control.radial_pid import RadialPid
from ddagr_gym.control.rolling import RollingWithoutSlip
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.control.true_curvature import TrueCurvature
from ddagr_gym.control.turn_controller import curvature_error
from ddagr_gym.control.yaw_rate_pid import YawRatePid
from ddagr_gym.envs.options import make_settings
from ddagr_gym.errors import InputError
from ddagr_gym.estimation import FilterModel, roll_out
from ddagr_gym.estimation.force_balance import arc_bank_speeds
from ddagr_gym.estimation.layout import STATE
from ddagr_gym.evaluation.calibration import calibrate_constant_speeds, steady_motion, turning_speeds
from ddagr_gym.evaluation.controllers import find_controller
from ddagr_gym.evaluation.metrics import turn_metrics
from ddagr_gym.evaluation.runs import drive_turn
from ddagr_gym.parameters import Sensors
from ddagr_gym.presets import get_robot, get_soil

ROBOT = get_robot("ddagr")


def observation(**values):
    """Scaled observation of a robot in the middle of a left turn of 0.8 m at 0.2 m/s, with entries replaced."""
    entries = {"side": 1.0, "target_radius": 0.8, "target_speed": 0.2, "heading_to_go": 1.5} | values
    return np.array([entries.get(name, 0.0) for name, _, _ in OBSERVATION]) / SCALES


def test_decode_inverts_the_scaling():
    seen = decode(observation(yaw_rate=0.3, encoder_left=-1.2))
    assert seen.yaw_rate == pytest.approx(0.3)
    assert seen.encoder_left == pytest.approx(-1.2)
    assert seen.target_radius == pytest.approx(0.8)


def test_pid_matches_its_definition():
    pid = Pid(PidGains(2.0, 0.5, 0.1, 100.0), 0.1)
    assert pid.update(1.0) == pytest.approx(2.0 + 0.5 * 0.1)
    assert pid.update(3.0) == pytest.approx(2.0 * 3.0 + 0.5 * (0.1 + 0.3) + 0.1 * (3.0 - 1.0) / 0.1)
    pid.reset()
    assert pid.update(1.0) == pytest.approx(2.05)


def test_pid_does_not_wind_up():
    pid = Pid(PidGains(0.0, 1.0, 0.0, 0.5), 1.0)
    for _ in range(100):
        assert pid.update(1.0) <= 0.5
    assert pid.update(-0.2) < 0.5
    assert pid.update(-0.4) < 0.1


def test_rolling_without_slip_is_kinematic():
    right, left = RollingWithoutSlip(ROBOT)(observation()) * ROBOT.maximum_wheel_speed
    radius = ROBOT.wheels[0].outer_radius
    assert radius * (right + left) / 2 == pytest.approx(0.2, rel=1e-6)
    assert radius * (right - left) / (2 * ROBOT.half_track) == pytest.approx(0.2 / 0.8, rel=1e-6)


def test_straights_hold_the_heading():
    controller = RollingWithoutSlip(ROBOT)
    right, left = controller(observation(run_in_to_go=0.3, heading_to_go=math.pi + 0.1))
    assert right > left  # the robot has turned to the right, so it steers left
    right, left = controller(observation(heading_to_go=-0.1))
    assert right < left  # beyond the row's direction


def test_constant_speeds_by_part_and_side():
    controller = ConstantSpeeds(0.7, 1.4, 0.1, 0.05, 2.0)
    np.testing.assert_allclose(controller(observation(run_in_to_go=0.2)), [0.35, 0.35], rtol=1e-6)
    np.testing.assert_allclose(controller(observation()), [0.7, 0.05], rtol=1e-6)
    np.testing.assert_allclose(controller(observation(side=-1.0)), [0.05, 0.7], rtol=1e-6)
    np.testing.assert_allclose(controller(observation(heading_to_go=0.04)), [0.35, 0.35], rtol=1e-6)


def test_constant_speeds_that_roll_without_slip_have_the_track_of_the_wheels():
    turn = RowTurn(radius=0.8, speed=0.2)
    spread = ROBOT.half_track / turn.radius
    assert ConstantSpeeds(1.0, 1.0 + spread, 1.0 - spread).track_ratio(turn, ROBOT) == pytest.approx(1.0)
    assert ConstantSpeeds(1.0, 1.5, 0.5).track_ratio(turn, ROBOT) == pytest.approx(0.5 * 0.8 / ROBOT.half_track)


@pytest.mark.parametrize(("speed", "driven"), [(0.2, 0.1 / 0.2), (0.05, 0.1 / 0.05), (0.01, 0.1 / 0.05)])
def test_a_quarter_of_the_commanded_speed_is_the_least_that_a_curvature_counts_with(speed, driven):
    assert curvature_error(1.25, 0.1, speed, 0.2) == pytest.approx(1.25 - driven)


def test_yaw_rate_loop_turns_faster_when_too_slow():
    controller = YawRatePid(ROBOT, PidGains(2.0, 0.0, 0.0, 2.0))
    slow = controller(observation(yaw_rate=0.1))
    controller.reset()
    right_on = controller(observation(yaw_rate=0.25))
    assert slow[0] - slow[1] > right_on[0] - right_on[1]


def test_radial_loop_turns_in_when_outside():
    controller = RadialPid(ROBOT, PidGains(3.0, 0.0, 0.0, 2.0))
    for _ in range(40):  # straight on where the path bends: outside the circle
        action = controller(observation(encoder_right=0.8, encoder_left=0.8, heading_to_go=math.pi))
    kinematic = RollingWithoutSlip(ROBOT)(observation())
    assert action[0] - action[1] > kinematic[0] - kinematic[1]


def test_true_curvature_needs_the_true_state():
    controller = TrueCurvature(ROBOT, PidGains(0.5, 1.0, 0.0, 2.0))
    with pytest.raises(InputError, match="full"):
        controller(observation(), {"ending": 0})


def test_turning_speeds_make_the_turn():
    soil = get_soil("thesis_a1")
    right, left = turning_speeds(ROBOT, soil, 0.2, 1 / 0.8)
    v_x, v_y, rate = steady_motion(ROBOT, soil, right, left)
    assert math.hypot(v_x, v_y) == pytest.approx(0.2, rel=3e-3)
    assert math.hypot(v_x, v_y) / rate == pytest.approx(0.8, rel=3e-3)


def test_turning_speeds_are_found_on_either_side_of_rest():
    """The inner bank of this turn nearly stands; from a start on the wrong side of that kink nothing is found."""
    soil = get_soil("thesis_a1")
    right, left = turning_speeds(ROBOT, soil, 0.199693, 1 / 0.696994)
    assert abs(left) < 0.1
    v_x, v_y, rate = steady_motion(ROBOT, soil, right, left)
    assert math.hypot(v_x, v_y) == pytest.approx(0.199693, rel=3e-3)
    assert math.hypot(v_x, v_y) / rate == pytest.approx(0.696994, rel=3e-3)


def test_a_turn_too_fast_for_the_motors_is_driven_more_slowly_at_its_radius():
    soil, turn = get_soil("thesis_a1"), RowTurn(radius=0.68, speed=0.25)
    with pytest.raises(InputError, match="lower speed"):
        turning_speeds(ROBOT, soil, turn.speed, 1 / turn.radius)
    constants = calibrate_constant_speeds(ROBOT, soil, turn)
    assert 0.95 * ROBOT.maximum_wheel_speed < constants.outer <= ROBOT.maximum_wheel_speed
    v_x, v_y, rate = steady_motion(ROBOT, soil, constants.outer, constants.inner)
    assert math.hypot(v_x, v_y) / rate == pytest.approx(0.68, rel=3e-3)
    assert 0.9 * 0.25 < math.hypot(v_x, v_y) < 0.25
    straight = steady_motion(ROBOT, soil, constants.straight, constants.straight)
    assert math.hypot(*straight[:2]) == pytest.approx(0.25, rel=3e-3)


def test_impossible_turn_is_one_sentence():
    with pytest.raises(InputError, match="lower speed"):
        turning_speeds(ROBOT, get_soil("thesis_a1"), 0.5, 1 / 0.5)


def radius_error(controller, settings, seed):
    run = drive_turn(controller, settings, seed)
    error = turn_metrics(run.columns, run.episode.turn, run.episode.robot).turn.error
    assert error is not None
    return abs(error)


def test_feedback_of_the_true_state_beats_constants_and_these_beat_kinematics():
    settings = make_settings()
    constants = calibrate_constant_speeds(ROBOT, get_soil("thesis_a1"), RowTurn())
    spread = (constants.outer - constants.inner) / (constants.outer + constants.inner) * 0.8 / ROBOT.half_track
    controllers = {
        "rolling": RollingWithoutSlip(ROBOT),
        "constants": constants,
        "bound": TrueCurvature(ROBOT, PidGains(0.5, 3.0, 0.0, 2.0), spread, 0.055),
    }
    errors = {
        name: np.median([radius_error(controller, settings, seed) for seed in range(6)])
        for name, controller in controllers.items()
    }
    assert errors["bound"] < errors["constants"] < errors["rolling"]


def test_force_balance_solves_the_steady_arc_of_its_law():
    model = FilterModel.of(ROBOT, Sensors())
    parameters = np.exp(model.soil_prior.logs(model.wheel_load)[0])
    right, left = arc_bank_speeds(model, parameters, 0.2, 1 / 0.8)
    mirrored = arc_bank_speeds(model, parameters, 0.2, -1 / 0.8)
    assert mirrored == pytest.approx((left, right), rel=1e-6)
    # rolled out with the same law, these speeds hold speed and radius
    motion = np.zeros(len(STATE))
    motion[:5] = [0.2, 0.0, 0.25, right, left]
    motion[5:9] = np.log(parameters)
    end = roll_out(model, motion, np.tile([right, left], (1000, 1)))[-1]
    assert end[0] == pytest.approx(0.2, rel=0.02)
    assert end[0] / end[2] == pytest.approx(0.8, rel=0.02)


def test_force_balance_controller_needs_features_and_beats_constants():
    controller = find_controller("B4", RowTurn())
    with pytest.raises(InputError, match="EKF"):
        controller(observation())
    errors = {}
    for name in ("B1", "B4"):
        settings = make_settings(ekf_features=name == "B4")
        errors[name] = np.median([radius_error(find_controller(name, RowTurn()), settings, 50 + k) for k in range(6)])
    assert errors["B4"] < errors["B1"]
