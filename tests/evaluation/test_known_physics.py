"""What named effects mean for a controller, read off the effects' own actions."""

import numpy as np
import pytest

from ddagr_gym.evaluation.known_physics import known_physics
from ddagr_gym.physics.effects import load_effects
from ddagr_gym.presets import ddagr


def known(*effects):
    return known_physics(ddagr(), load_effects(effects))


def test_nothing_is_known_of_a_nominal_robot():
    found = known()
    assert found.robot == ddagr()
    assert found.radius_factors == (1.0, 1.0)
    assert (found.gradient, found.delay, found.used) == ((0.0, 0.0), (0.0, 0.0), ())
    readings = np.array([[0.1, -0.2, 0.3, 0.7, 0.4]])
    assert found.readings.undo(readings) == pytest.approx(readings)


@pytest.mark.parametrize(
    ("effect", "read"),
    [
        ("gyro_scale=1.06", [0.1, -0.2, 0.3 * 1.06, 0.7, 0.4]),
        ("gyro_bias=0.01", [0.1, -0.2, 0.31, 0.7, 0.4]),
        ("encoder_scale=1.05", [0.1, -0.2, 0.3, 0.7 * 1.05, 0.4]),
        ("accelerometer_bias=0.2", [0.3, -0.2, 0.3, 0.7, 0.4]),
    ],
)
def test_errors_of_sensors_are_undone(effect, read):
    found = known(effect)
    assert found.readings.undo(np.array([read])) == pytest.approx(np.array([[0.1, -0.2, 0.3, 0.7, 0.4]]))
    assert len(found.used) == 1


def test_maps_are_undone_in_the_right_order():
    found = known("gyro_bias=0.02", "gyro_scale=1.1")
    assert found.readings.undo(np.array([[0.0, 0.0, 1.1 * (0.3 + 0.02), 0.0, 0.0]]))[0, 2] == pytest.approx(0.3)


def test_loads_and_motors_become_those_of_the_robot():
    assert known("payload=50").robot.mass == pytest.approx(ddagr().mass + 50.0)
    assert 1.0 / known("motor_lag=0.3").robot.motor_rate == pytest.approx(1.0 / ddagr().motor_rate + 0.3)
    assert known("wheel_radius_mismatch=0.04").radius_factors == pytest.approx((1.02, 0.98))
    assert known("command_delay=0.1").delay == pytest.approx((0.1, 0.1))


def test_gravity_turns_with_the_heading():
    found = known("slope=0.05")
    pull = 9.80665 * np.sin(0.05)
    assert found.gravity(0.0) == pytest.approx((-pull, 0.0))
    assert found.gravity(np.pi / 2) == pytest.approx((0.0, pull))


def test_drag_holds_back_by_the_motion():
    assert known("viscous_drag=300").drag(0.2, 0.0, 0.0)[0] == pytest.approx(-300 * 0.2 / ddagr().mass)
    assert known("towed_drag=120").drag(0.2, 0.0, 0.0)[0] == pytest.approx(-120 / ddagr().mass, rel=0.01)


@pytest.mark.parametrize("effect", ["command_deadband=0.1", "imu_lever_arm=0.2", "sensor_hold=0.1", "soil_split=0.7"])
def test_what_remembers_or_hangs_on_the_motion_is_left_to_teaching(effect):
    found = known(effect)
    assert found.used == ()
    assert found.readings.matrix == pytest.approx(np.eye(5))
    assert found.commands.matrix == pytest.approx(np.eye(2))
