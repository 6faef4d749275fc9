"""Stretches whose poses are in frames of their own are told from those of one frame."""

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.diagnosis.search.scan import scan
from ddagr_gym.diagnosis.setting import Setting, make_problem
from ddagr_gym.identification.gauss_newton import fit
from ddagr_gym.identification.problem import Problem
from ddagr_gym.parameters import Imu, PoseReceiver, Sensors, WheelEncoder
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.pose_frames import frames_apart
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.simulator import simulate


def in_a_frame_of_its_own(recording: Recording, row: int) -> Recording:
    """Poses from a row on seen from the pose there, as in a drive whose stretches begin at (0, 0) each."""
    x, y, yaw = (recording[f"pose_{name}"] for name in ("x", "y", "yaw"))
    first = row + int(np.flatnonzero(np.isfinite(x[row:]))[0])
    apart = np.arange(len(x)) >= row
    cosine, sine = np.cos(yaw[first]), np.sin(yaw[first])
    along, across = x - x[first], y - y[first]
    poses = {
        "pose_x": np.where(apart, cosine * along + sine * across, x),
        "pose_y": np.where(apart, cosine * across - sine * along, y),
        "pose_yaw": np.where(apart, yaw - yaw[first], yaw),
    }
    return replace(recording, channels={**recording.channels, **poses})


def in_two(recording: Recording) -> Recording:
    half = len(recording) // 2
    return replace(recording, meta=replace(recording.meta, spans=((0, half), (half, len(recording)))))


@pytest.fixture(scope="module")
def drive() -> Recording:
    robot = get_robot("ddagr")
    t = np.arange(0.0, 12.0, 0.02)
    commands = np.stack([1.0 + 0.2 * np.sin(t), 0.9 - 0.2 * np.sin(0.7 * t)], axis=1)
    sensors = Sensors(Imu(sample_rate=50.0), WheelEncoder(), PoseReceiver(5.0))
    return Recording.from_columns(simulate(robot, get_soil("thesis_a1"), commands, sensors=sensors, seed=1), robot)


def test_frames(drive: Recording) -> None:
    whole = in_two(drive)
    assert not frames_apart(drive)
    assert not frames_apart(whole)
    assert frames_apart(in_a_frame_of_its_own(whole, len(drive) // 2))


def test_a_pause_in_which_the_robot_was_driven_on_is_no_other_frame(drive: Recording) -> None:
    whole, half = in_two(drive), len(drive) // 2
    paused = replace(whole, t=whole.t + np.where(np.arange(len(drive)) >= half, 60.0, 0.0))
    moved = {"pose_x": drive["pose_x"] + np.where(np.arange(len(drive)) >= half, 10.0, 0.0)}
    assert not frames_apart(replace(paused, channels={**paused.channels, **moved}))
    assert frames_apart(replace(whole, channels={**whole.channels, **moved}))


def test_bad_positions_are_no_other_frame(drive: Recording) -> None:
    noise = np.random.default_rng(0).normal(0.0, 0.05, (2, len(drive)))
    noisy = {"pose_x": drive["pose_x"] + noise[0], "pose_y": drive["pose_y"] + noise[1]}
    assert not frames_apart(in_two(replace(drive, channels={**drive.channels, **noisy})))


def test_nothing_of_the_world_is_tried_where_frames_differ(drive: Recording) -> None:
    def tried(recording: Recording) -> set[str]:
        problem: Problem = make_problem(get_robot("ddagr"), get_soil("thesis_a1"), [recording], Setting())
        return {candidate.name for candidate in scan(problem, fit(problem)).candidates}

    whole = in_two(drive)
    apart = in_a_frame_of_its_own(whole, len(drive) // 2)
    assert tried(whole) - tried(apart) == {"slope", "soil_patch"}
