from __future__ import annotations

import math
import re
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.frames import FrameTree
from ddagr_gym.recordings.message_fields import header_stamp
from ddagr_gym.recordings.ros_messages import (
    MOST_JOINTS,
    BankSpeeds,
    extractor,
    imu,
    joint_speeds,
    metres_from,
    nav_sat_fix,
    pose,
)
from ddagr_gym.recordings.topic_map import TopicSource


def quaternion(roll, pitch, yaw):
    cr, sr, cp, sp, cy, sy = (f(a / 2) for a in (roll, pitch, yaw) for f in (math.cos, math.sin))
    return {
        "x": sr * cp * cy - cr * sp * sy,
        "y": cr * sp * cy + sr * cp * sy,
        "z": cr * cp * sy - sr * sp * cy,
        "w": cr * cp * cy + sr * sp * sy,
    }


@given(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1), st.floats(0.8, 1.2))
def test_attitude_of_a_quaternion_of_any_near_unit_length(roll, pitch, yaw, length):
    q = {name: length * value for name, value in quaternion(roll, pitch, yaw).items()}
    sample = pose("pose")({"pose": {"position": {"x": 1, "y": 2}, "orientation": q}})
    assert sample["roll"] == pytest.approx(roll, abs=1e-6)
    assert sample["pitch"] == pytest.approx(pitch, abs=1e-6)
    assert sample["pose_yaw"] == pytest.approx(yaw, abs=1e-6)
    assert (sample["pose_x"], sample["pose_y"]) == (1, 2)


def test_a_quaternion_of_zeros_means_no_attitude():
    sample = pose("pose")({"pose": {"position": {"x": 1, "y": 2}, "orientation": dict.fromkeys("xyzw", 0)}})
    assert math.isnan(sample["pose_yaw"])


@pytest.mark.parametrize(
    ("stamp", "seconds"),
    [
        ({"sec": 3, "nanosec": 500_000_000}, 3.5),
        ({"secs": 3, "nsecs": 500_000_000}, 3.5),
        ({"sec": 3, "nsec": 500_000_000}, 3.5),
        ({"sec": 0, "nanosec": 0}, None),
        ({}, None),
    ],
)
def test_stamps_of_ros_1_ros_2_and_json(stamp, seconds):
    assert header_stamp({"header": {"stamp": stamp}}) == seconds
    as_object = SimpleNamespace(header=SimpleNamespace(stamp=SimpleNamespace(**stamp)))
    assert header_stamp(as_object) == seconds


def test_messages_without_a_header_have_no_stamp():
    assert header_stamp({"linear": {"x": 1}}) is None


def test_imu_takes_attitude_only_when_asked():
    message = {
        "linear_acceleration": {"x": 1, "y": 2, "z": 3},
        "angular_velocity": {"z": 4},
        "orientation": quaternion(0.1, 0.2, 0.3),
    }
    assert set(imu(TopicSource())(message)) == {"specific_force_x", "specific_force_y", "specific_force_z", "yaw_rate"}
    assert imu(TopicSource(orientation=True))(message)["pitch"] == pytest.approx(0.2)


def test_bank_speeds_are_means_over_matching_joints():
    message = {
        "name": ["front_left_wheel", "Front_RIGHT_wheel", "rear_left_wheel", "rear_right_wheel", "arm"],
        "velocity": [1.0, 2.0, 3.0, 5.0, 99.0],
    }
    assert BankSpeeds(TopicSource())(message) == {"encoder_right": 3.5, "encoder_left": 2.0}
    only_front = BankSpeeds(TopicSource(right=("front_right*",), left=("front_left*",)))(message)
    assert only_front == {"encoder_right": 2.0, "encoder_left": 1.0}


@pytest.mark.parametrize(
    ("message", "words"),
    [
        ({"name": ["a", "b"], "velocity": []}, "none of 1 messages has a speed for each of its joints"),
        ({"name": [], "velocity": []}, "none of 1 messages has a speed"),
        ({"name": "left", "velocity": 3.0}, "none of 1 messages has a speed"),
        (
            {"name": ["a"], "velocity": [1.0]},
            r"no joint of a matches the right bank's patterns \*right\*: give",
        ),
        ({"name": ["my_right"], "velocity": [1.0]}, "no joint of my_right matches the left bank's patterns"),
    ],
)
def test_joint_states_without_wheels_are_no_samples_and_say_why(message, words):
    take = BankSpeeds(TopicSource())
    assert take.complaint() == ""
    assert take(message) is None
    assert re.search(words, take.complaint())


def test_banks_that_never_come_in_one_message_are_complained_of():
    take = BankSpeeds(TopicSource())
    assert take({"name": ["left"], "velocity": [1.0]}) is None
    assert take({"name": ["right"], "velocity": [1.0]}) is None
    assert "joints of both banks (left, right): publish right and left wheels in one JointState" in take.complaint()


def test_speeds_that_are_null_or_no_mean_are_not_known():
    message = {"name": ["left", "front_right", "rear_right"], "velocity": [None, math.inf, -math.inf]}
    sample = BankSpeeds(TopicSource())(message)
    assert all(math.isnan(sample[name]) for name in ("encoder_left", "encoder_right"))
    assert math.isnan(joint_speeds()(message)["left"])


def test_single_joints_go_by_name_in_any_order():
    take = joint_speeds()
    assert take({"name": ["a", "b"], "velocity": [1.0, 2.0]}) == {"a": 1.0, "b": 2.0}
    assert take({"name": ["b", "a"], "velocity": [2.0, 1.0]}) == {"a": 1.0, "b": 2.0}
    assert take({"name": [], "velocity": []}) is None
    many = [f"joint_{k}" for k in range(2 * MOST_JOINTS)]
    assert len(take({"name": many, "velocity": [0.0] * len(many)})) == MOST_JOINTS - 2


@pytest.mark.parametrize("field", ["linear_acceleration", "angular_velocity", "orientation"])
@pytest.mark.parametrize("mounting", [None, np.eye(3)])
def test_what_an_imu_says_it_does_not_measure_is_not_known(field, mounting):
    message = {
        "linear_acceleration": {"x": 1, "y": 2, "z": 3},
        "angular_velocity": {"x": 0, "y": 0, "z": 4},
        "orientation": quaternion(0.1, 0.2, 0.3),
        f"{field}_covariance": [-1.0] + [0.0] * 8,
    }
    channels = {
        "linear_acceleration": {"specific_force_x", "specific_force_y", "specific_force_z"},
        "angular_velocity": {"yaw_rate"},
        "orientation": {"roll", "pitch"},
    }
    take = imu(TopicSource(orientation=True), None if mounting is None else lambda _: mounting)
    lacking = {name for name, value in take(message).items() if math.isnan(value)}
    # A rotation mixes the axes of one vector, never two vectors.
    assert lacking == channels[field]
    message[f"{field}_covariance"] = [0.01] + [0.0] * 8
    assert not any(math.isnan(value) for value in take(message).values())


@pytest.mark.parametrize(
    ("latitude", "metres"),
    # Length of one degree of latitude and of longitude on the WGS 84 ellipsoid (NGA tables).
    [(0.0, (111319.5, 110574.3)), (45.0, (78846.8, 111131.7)), (60.0, (55800.0, 111412.2))],
)
def test_degrees_become_metres_on_the_ellipsoid(latitude, metres):
    half = 0.0005
    east, _ = metres_from(latitude, 10.0, latitude, 10.0 + half)
    _, north = metres_from(latitude, 10.0, latitude + half, 10.0)
    assert east / half == pytest.approx(metres[0], rel=2e-5)
    assert north / half == pytest.approx(metres[1], rel=2e-5)


def test_longitude_may_cross_the_date_line():
    east, _ = metres_from(0.0, 179.9999, 0.0, -179.9999)
    assert east == pytest.approx(22.26, abs=0.01)


def test_fixes_without_satellites_are_no_samples():
    extract = nav_sat_fix()
    assert math.isnan(extract({"latitude": 50.0, "longitude": 8.0, "status": {"status": -1}})["pose_x"])
    assert extract({"latitude": 50.0, "longitude": 8.0, "status": {"status": 0}}) == {"pose_x": 0.0, "pose_y": 0.0}
    assert math.isnan(extract({"latitude": 95.0, "longitude": 8.0, "status": {"status": 0}})["pose_x"])


def test_twists_need_the_robot():
    with pytest.raises(InputError, match="--robot"):
        extractor("Twist", TopicSource(), None, "file.bag")


def transform_of(child, parent, x=0.0, w=1.0):
    """A message of /tf; without a turn, or with a quaternion of zeros where ``w`` is 0."""
    rotation = dict.fromkeys("xyz", 0.0) | {"w": w}
    moved = {"translation": {"x": x, "y": 0.0, "z": 0.0}, "rotation": rotation}
    return {"header": {"frame_id": parent}, "child_frame_id": child, "transform": moved}


def test_a_transform_with_a_quaternion_of_zeros_is_no_pose():
    pose_of = extractor("TFMessage", TopicSource(parent="odom", child="base_link"), None, "drive.bag")
    assert pose_of(transform_of("base_link", "odom", 1.0))["pose_x"] == 1.0
    assert pose_of(transform_of("base_link", "odom", 2.0, w=0.0)) is None
    assert pose_of(transform_of("base_link", "odom", 3.0))["pose_x"] == 3.0


def test_a_pose_that_was_not_known_comes_with_the_next_transform():
    """The lower transform is bad once: the upper one's news is told with the next one."""
    pose_of = extractor("TFMessage", TopicSource(parent="map", child="base_link"), None, "drive.bag")
    for message in (transform_of("base_link", "odom"), transform_of("odom", "map", 10.0)):
        assert pose_of(message) is None
    assert pose_of(transform_of("base_link", "odom", 1.0, w=0.0)) is None
    assert pose_of(transform_of("base_link", "odom", 2.0))["pose_x"] == 12.0


def test_an_imu_whose_mounting_is_not_known_is_refused():
    tree = FrameTree()
    tree.add(transform_of("imu_link", "base_link", w=0.0), static=True)
    readings = extractor("Imu", TopicSource(frame="base_link", orientation=True), None, "drive.bag", tree)
    message = {
        "header": {"frame_id": "imu_link"},
        "linear_acceleration": {"x": 1, "y": 2, "z": 9.8},
        "angular_velocity": dict.fromkeys("xyz", 0.1),
        "orientation": quaternion(0.1, 0.2, 0.3),
    }
    with pytest.raises(InputError, match=r"rotation of 'imu_link' to the frame above in drive\.bag has no quaternion"):
        readings(message)
