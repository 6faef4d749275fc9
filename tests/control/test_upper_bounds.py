"""The bounds that see the truth: they need it, and they steer the right way."""

import math

import numpy as np
import pytest

from ddagr_gym.control.observation import OBSERVATION, SCALES, decode
from ddagr_gym.control.pid import PidGains
from ddagr_gym.control.true_path import TruePath
from ddagr_gym.control.true_soil import TrueSoil
from ddagr_gym.control.turn_controller import commanded_turn
from ddagr_gym.errors import InputError
from ddagr_gym.presets import get_robot

ROBOT = get_robot("ddagr")
GAINS = PidGains(10.0, 0.0, 0.0, 5.0)


def observation(**values):
    entries = {"side": 1.0, "target_radius": 0.8, "target_speed": 0.2, "heading_to_go": 1.5} | values
    return np.array([entries.get(name, 0.0) for name, _, _ in OBSERVATION]) / SCALES


def spread(action):
    return float(action[0] - action[1])


def test_commanded_turn_is_read_from_the_first_observation():
    turn = commanded_turn(decode(observation(side=-1.0, target_radius=0.9, run_in_to_go=0.4)))
    assert (turn.side, turn.radius, turn.run_in, turn.speed) == ("right", 0.9, 0.4, 0.2)


def at(radius, angle, heading=None):
    """Info of a robot at a place of a left turn of 0.8 m about (0, 0.8)."""
    return {
        "true_x": radius * math.sin(angle),
        "true_y": 0.8 - radius * math.cos(angle),
        "true_yaw": angle if heading is None else heading,
    }


def test_true_path_steers_back():
    controller = TruePath(ROBOT, GAINS, heading_gain=3.0)
    on_path = spread(controller(observation(), at(0.8, 1.0)))
    assert spread(controller(observation(), at(0.85, 1.0))) > on_path  # outside: turn harder
    assert spread(controller(observation(), at(0.75, 1.0))) < on_path
    assert spread(controller(observation(), at(0.8, 1.0, heading=1.1))) < on_path  # heading too far round
    kinematic = 2.0 * ROBOT.half_track / 0.8 * 0.2 / ROBOT.wheels[0].outer_radius / ROBOT.maximum_wheel_speed
    assert on_path == pytest.approx(kinematic, rel=1e-6)


def test_true_path_straightens_ahead_of_the_end():
    late = TruePath(ROBOT, GAINS, heading_gain=0.0)
    early = TruePath(ROBOT, GAINS, heading_gain=0.0, lead=0.1)
    near_the_end = at(0.8, math.pi - 0.05)
    assert spread(late(observation(), near_the_end)) > 0.1
    assert spread(early(observation(), near_the_end)) == pytest.approx(0.0, abs=1e-6)


def test_true_soil_takes_speeds_from_the_soil_and_corrects_the_curvature():
    asked = []

    def feed_forward(soil, speed, curvature):
        asked.append((tuple(soil), speed, curvature))
        return (1.5, 0.1) if curvature else (0.7, 0.7)

    soils = np.arange(36.0)
    info = {"true_soil": soils, "true_v_x": 0.2, "true_v_y": 0.0, "true_yaw_rate": 0.25}
    controller = TrueSoil(ROBOT, PidGains(1.0, 0.0, 0.0, 5.0), feed_forward)
    np.testing.assert_allclose(controller(observation(), info) * ROBOT.maximum_wheel_speed, [1.5, 0.1], rtol=1e-5)
    assert asked[-1] == (tuple(soils.reshape(4, 9).mean(axis=0)), 0.2, 1.25)
    too_wide = spread(controller(observation(), info | {"true_yaw_rate": 0.2}))
    assert too_wide > 1.4 / ROBOT.maximum_wheel_speed
    straight = controller(observation(run_in_to_go=0.3, heading_to_go=math.pi), info)
    np.testing.assert_allclose(straight * ROBOT.maximum_wheel_speed, [0.7, 0.7], rtol=1e-5)


def test_true_soil_without_a_steady_solution_drives_kinematically():
    info = {"true_soil": np.zeros(36), "true_v_x": 0.2, "true_v_y": 0.0, "true_yaw_rate": 0.25}
    controller = TrueSoil(ROBOT, PidGains(), lambda soil, speed, curvature: None, track_ratio=1.4)
    found = controller(observation(), info) * ROBOT.maximum_wheel_speed
    np.testing.assert_allclose(found, controller.bank_speeds(0.2, 1.25), rtol=1e-5)


@pytest.mark.parametrize(
    "controller", [TruePath(ROBOT, GAINS, 1.0), TrueSoil(ROBOT, GAINS, lambda soil, speed, curvature: None)]
)
def test_bounds_need_the_truth(controller):
    with pytest.raises(InputError, match="full"):
        controller(observation(), {"ending": 0})
