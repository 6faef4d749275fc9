"""Transforms of a bag: the pose from /tf, and readings of an IMU turned by its mounting."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.load import load_recording
from tests.recordings.bags import IMU, JOINTS, Sent, transform, write

TIMES = [0.02 * k for k in range(200)]
WHEELS = [Sent("/joints", JOINTS, t, {"name": ["left", "right"], "velocity": [1.0, 1.0]}) for t in TIMES[::2]]


def imus(force=(1.0, 2.0, 9.0), turn=(0.1, 0.2, 0.5), frame="imu_link", orientation=None):
    values = {
        "linear_acceleration": dict(zip("xyz", force, strict=True)),
        "angular_velocity": dict(zip("xyz", turn, strict=True)),
        "orientation": orientation or {"w": 1.0},
    }
    return [Sent("/imu", IMU, t, values, frame) for t in TIMES]


def read(tmp_path, messages, text, storage="sqlite3"):
    (tmp_path / "map.yaml").write_text(text)
    return load_recording(write(tmp_path / "run", messages, storage), str(tmp_path / "map.yaml"))


MOUNTED = "topics: {imu: {frame: base_link, orientation: true}, wheels: {}}"


@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
def test_readings_are_turned_into_the_robots_axes(tmp_path, storage):
    # x of the sensor points to the robot's left: base y = sensor x, base x = -sensor y.
    static = [transform(0.0, "base_link", "imu_link", yaw=math.pi / 2, x=0.3, topic="/tf_static")]
    found = read(tmp_path, [*imus(), *WHEELS, *static], MOUNTED, storage)
    for name, value in (("specific_force_x", -2.0), ("specific_force_y", 1.0), ("specific_force_z", 9.0)):
        np.testing.assert_allclose(found[name], value, atol=1e-12)
    np.testing.assert_allclose(found["yaw_rate"], 0.5, atol=1e-12)
    assert any("turned into base_link" in note for note in found.meta.notes)


def test_an_imu_upside_down_over_two_transforms(tmp_path):
    static = [
        transform(0.0, "base_footprint", "base_link", x=0.1, topic="/tf_static"),
        transform(0.0, "base_link", "mast", yaw=math.pi, topic="/tf_static"),
        transform(0.0, "mast", "imu_link", roll=math.pi, topic="/tf_static"),
    ]
    text = "topics: {imu: {frame: base_footprint}, wheels: {}}"
    found = read(tmp_path, [*imus(), *WHEELS, *static], text)
    # Rolled over (y, z negated), then turned by half a turn (x, y negated).
    found_force = [found[f"specific_force_{axis}"][0] for axis in "xyz"]
    np.testing.assert_allclose([*found_force, found["yaw_rate"][0]], [-1.0, 2.0, -9.0, -0.5], atol=1e-12)


def test_roll_and_pitch_are_those_of_the_robot(tmp_path):
    # The sensor is mounted rolled by 0.4; the robot itself stands level.
    static = [transform(0.0, "base_link", "imu_link", roll=0.4, topic="/tf_static")]
    orientation = {"x": math.sin(0.2), "w": math.cos(0.2)}
    found = read(tmp_path, [*imus(orientation=orientation), *WHEELS, *static], MOUNTED)
    np.testing.assert_allclose(found["roll"], 0.0, atol=1e-12)
    np.testing.assert_allclose(found["pitch"], 0.0, atol=1e-12)


def test_transforms_that_do_not_change_may_be_in_tf(tmp_path):
    moving = [transform(t, "base_link", "imu_link", yaw=math.pi / 2) for t in TIMES[::10]]
    found = read(tmp_path, [*imus(), *WHEELS, *moving], MOUNTED)
    np.testing.assert_allclose(found["specific_force_y"], 1.0, atol=1e-12)


def test_an_unknown_frame_lists_what_is_known(tmp_path):
    static = [transform(0.0, "base", "camera", topic="/tf_static")]
    with pytest.raises(InputError, match=r"no transform from 'imu_link' to 'base_link' \(it knows base, camera"):
        read(tmp_path, [*imus(), *WHEELS, *static], MOUNTED)


def test_a_mounting_that_is_not_known_is_said(tmp_path):
    static = transform(0.0, "base_link", "imu_link", topic="/tf_static")
    static.values["transforms"][0]["transform"]["rotation"] = dict.fromkeys("xyzw", 0.0)
    with pytest.raises(InputError, match=r"rotation of 'imu_link' to the frame above in run has no quaternion"):
        read(tmp_path, [*imus(), *WHEELS, static], MOUNTED)


def test_what_is_above_both_frames_need_not_be_known(tmp_path):
    above = transform(0.0, "base_footprint", "base_link", topic="/tf_static")
    above.values["transforms"][0]["transform"]["rotation"] = dict.fromkeys("xyzw", 0.0)
    mounted = transform(0.0, "base_link", "imu_link", yaw=math.pi / 2, topic="/tf_static")
    found = read(tmp_path, [*imus(), *WHEELS, above, mounted], MOUNTED)
    np.testing.assert_allclose(found["specific_force_y"], 1.0, atol=1e-12)


def odom(t):
    return {"x": 0.5 * t, "y": 0.0, "yaw": 0.1 * t}


def test_the_pose_of_one_moving_transform(tmp_path):
    moving = [transform(t, "odom", "base_footprint", **odom(t)) for t in TIMES[::5]]
    static = [transform(0.0, "base_footprint", "base_link", x=0.2, topic="/tf_static")]
    text = "topics: {imu: {}, wheels: {}, pose: {topic: /tf, parent: odom, child: base_link}}"
    found = read(tmp_path, [*imus(frame="base_link"), *WHEELS, *moving, *static], text)
    rows = np.flatnonzero(np.isfinite(found["pose_x"]))
    np.testing.assert_array_equal(rows, np.arange(0, 200, 5))
    t = found.t[rows]
    np.testing.assert_allclose(found["pose_yaw"][rows], 0.1 * t, atol=1e-6)
    np.testing.assert_allclose(found["pose_x"][rows], 0.5 * t + 0.2 * np.cos(0.1 * t), atol=1e-6)
    np.testing.assert_allclose(found["pose_y"][rows], 0.2 * np.sin(0.1 * t), atol=1e-6)


def test_the_pose_in_the_map_comes_when_the_localisation_knows_something_new(tmp_path):
    moving = [transform(t, "odom", "base_link", **odom(t)) for t in TIMES[::5]]
    # The localisation repeats itself at 50 Hz and finds a new correction every half second.
    corrected = [transform(t + 0.001, "map", "odom", y=1.0 + math.floor(2 * t)) for t in TIMES]
    text = "topics: {imu: {}, wheels: {}, pose: {topic: /tf, parent: map, child: base_link}}"
    found = read(tmp_path, [*imus(), *WHEELS, *moving, *corrected], text)
    rows = np.flatnonzero(np.isfinite(found["pose_y"]))
    assert len(rows) == 8
    np.testing.assert_allclose(found["pose_y"][rows], 1.0 + np.arange(8), atol=1e-9)
    np.testing.assert_allclose(found["pose_x"][rows], 0.5 * found.t[rows], atol=1e-6)


def test_frames_must_be_named(tmp_path):
    moving = [transform(t, "odom", "base_link") for t in TIMES]
    text = "topics: {imu: {}, wheels: {}, pose: {topic: /tf}}"
    with pytest.raises(InputError, match=r"as parent \(map\) and child \(base_link\)"):
        read(tmp_path, [*imus(), *WHEELS, *moving], text)


def test_transforms_are_no_pose_unless_a_map_says_so(tmp_path):
    moving = [transform(t, "odom", "base_link", **odom(t)) for t in TIMES]
    path = write(tmp_path / "run", [*imus(), *WHEELS, *moving])
    assert not load_recording(path).has("pose_x")
