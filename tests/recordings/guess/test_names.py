from __future__ import annotations

import pytest

from ddagr_gym.recordings.guess.names import command_rank, is_inside_sensor, is_measured, side_of, wheel_joints


@pytest.mark.parametrize(
    ("joint", "side"),
    [
        ("front_left_wheel", "left"),
        ("wheelRight", "right"),
        ("fl_wheel", "left"),
        ("rl", "left"),
        ("lr", "left"),
        ("wheel_rr_joint", "right"),
        ("wheel_fr", "right"),
        ("br_motor", "right"),
        ("l_track", "left"),
        ("r1", "right"),
        ("wheel_1", ""),
        ("left_to_right_link", ""),
        ("arm", ""),
    ],
)
def test_sides_of_joints(joint, side):
    assert side_of(joint) == side


def test_joints_called_wheels_come_before_others():
    assert wheel_joints(("fl_wheel", "fr_wheel", "shoulder_left")) == ("fl_wheel", "fr_wheel")
    assert wheel_joints(("a", "b", "pan_joint", "rear_caster")) == ("a", "b")
    assert wheel_joints(("front_steer_wheel", "left_wheel", "right_wheel")) == ("left_wheel", "right_wheel")


def test_names_of_twists():
    assert [command_rank(name) for name in ("/joy_teleop/cmd_vel", "/twist", "/base_controller/cmd_vel")] == [0, 1, 2]
    assert is_measured("/odom_twist")
    assert not is_measured("/odom_controller/cmd_vel")
    assert is_inside_sensor("/camera/imu")
    assert not is_inside_sensor("/imu/data")
