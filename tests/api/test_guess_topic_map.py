"""``ddagr_gym.guess_topic_map``: robots in all forms, and what the result shows."""

from __future__ import annotations

import pytest

import ddagr_gym
from ddagr_gym.errors import InputError
from ddagr_gym.presets import get_robot
from ddagr_gym.recordings.schema import RobotGeometry
from ddagr_gym.recordings.topic_map import load_topic_map
from tests.recordings.bags import Drive, write
from tests.recordings.conftest import drive


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    geometry = RobotGeometry.of(get_robot("warthog"))
    columns = drive(geometry, seconds=30.0).columns()
    messages = Drive(columns, geometry.wheel_radius, geometry.half_track).messages()
    return write(tmp_path_factory.mktemp("api") / "bag", messages)


def test_the_result_shows_writes_and_reads_back(bag, tmp_path):
    guess = ddagr_gym.guess_topic_map(bag, get_robot("warthog"))
    assert guess.headline == (
        "bag: imu is /imu/data, wheels is /joint_states, command is /cmd_vel, pose is /odometry/gps"
    )
    assert "/joint_states" in str(guess)
    html = guess._repr_html_()
    assert "<td" in html
    assert "the wheels follow it" in html
    guess.to_yaml(tmp_path / "own.yaml")
    read = load_topic_map(str(tmp_path / "own.yaml"))
    assert (read.topics, read.robot, read.stamps) == (guess.topic_map.topics, "warthog", "header")
    recording = ddagr_gym.load_recording(bag, tmp_path / "own.yaml")
    assert recording.has("command_right", "encoder_left", "pose_yaw")


@pytest.mark.parametrize(
    ("options", "words"),
    [({"robot": "warthogg"}, "warthog"), ({"seed": -1}, "seed is -1"), ({"maximum_rows": 10}, "--maximum-rows")],
)
def test_bad_arguments(bag, options, words):
    with pytest.raises(InputError, match=words):
        ddagr_gym.guess_topic_map(bag, **options)
