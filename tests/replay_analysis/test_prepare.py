from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.identification.data_split import held_out, training
from ddagr_gym.physics.effects.gyro_bias import GyroBias
from ddagr_gym.physics.effects.pose_latency import PoseLatency
from ddagr_gym.physics.effects.sensor_hold import SensorHold
from ddagr_gym.presets import get_robot
from ddagr_gym.replay_analysis.prepare import prepare, simulated_effects


def prepared(recordings, robot, **more):
    return prepare(recordings, robot, np.random.default_rng(0), **more)


def test_a_recording_of_another_robot_is_refused(make_recording):
    with pytest.raises(InputError, match=r"recording of the robot 'ddagr': replay it with --robot ddagr, not husky"):
        prepared([make_recording()], get_robot("husky"))
    with pytest.raises(InputError, match=r"'rover': replay it with --robot FILE\.yaml"):
        prepared([make_recording().with_meta(robot="rover")], get_robot("husky"))


def test_one_row_is_no_drive(make_recording, robot):
    with pytest.raises(InputError, match="has 1 rows: a replay needs a drive"):
        prepared([make_recording(seconds=0.05)], robot)
    single = tuple((row, row + 1) for row in range(20))
    with pytest.raises(InputError, match="has 20 rows of which no two are in one segment"):
        prepared([make_recording(seconds=1.0).with_meta(segments=single)], robot)


def test_dead_channels_are_named(make_recording, robot):
    recording = make_recording(encoder_right=np.arange(2000.0), encoder_left=np.arange(2000.0))
    found = prepared([recording], robot)
    assert found.dead == ("yaw_rate",)
    assert any(note.startswith("yaw_rate never changes and was left out") for note in found.notes)


def test_no_window_is_none_instead_of_an_error(make_recording, robot):
    recording = make_recording(command_valid=np.zeros(2000, dtype=bool))
    found = prepared([recording], robot)
    assert found.windows(2.0, "commands") is None
    assert found.windows(2.0, "encoders").count == 49


def test_parts_and_numbers_of_windows(make_recording, robot):
    found = prepared([make_recording()], robot)
    seen, judged = (found.windows(1.0, "commands", part=part) for part in (training, held_out))
    assert set(seen.start).isdisjoint(judged.start)
    assert found.windows(1.0, "commands", most=7).count == 7


def test_late_poses_are_moved_and_said_so(make_recording, robot):
    rng = np.random.default_rng(0)
    t = np.arange(0.0, 100.0, 0.05)
    turning = np.repeat(rng.uniform(-1.0, 1.0, 20), 100)
    heading = np.cumsum(turning) * 0.05
    late = np.interp(t - 0.4, t, heading)
    recording = make_recording(yaw_rate=turning, pose_yaw=late, pose_x=late, pose_y=late)
    found = prepared([recording], robot)
    assert found.noise[0].pose_lateness == pytest.approx(0.4, abs=0.05)
    lateness = f"poses come {found.noise[0].pose_lateness:.2f} s behind the gyro"
    assert any(lateness in note for note in found.notes)
    moved = found.recordings[0]["pose_yaw"]
    known = np.isfinite(moved)
    np.testing.assert_allclose(moved[known][100:-100], heading[known][100:-100], atol=0.06)


def test_opposed_signs_are_said(make_recording, robot):
    rng = np.random.default_rng(0)
    turning = np.repeat(rng.uniform(-1.0, 1.0, 20), 100)
    heading = np.cumsum(turning) * 0.05
    recording = make_recording(yaw_rate=-turning, pose_yaw=heading)
    notes = prepared([recording], robot).notes
    assert any("gyro and poses turn opposite ways" in note for note in notes)


def test_the_track_is_fitted_to_poses_by_the_poses_noise_where_the_gyro_is_dead(make_recording, robot):
    from ddagr_gym.replay_analysis.models import fit_baselines

    rng = np.random.default_rng(0)
    speeds = np.repeat(rng.uniform(0.5, 2.0, (20, 2)), 100, axis=0)
    ratio, radius, half_track = 1.6, robot.wheels[0].outer_radius, robot.half_track
    heading = np.cumsum(radius * (speeds[:, 0] - speeds[:, 1]) / (2.0 * half_track * ratio)) * 0.05
    pose = np.where(np.arange(2000) % 5 == 0, heading + rng.normal(0.0, 0.005, 2000), np.nan)
    recording = make_recording(
        encoder_right=speeds[:, 0], encoder_left=speeds[:, 1], pose_yaw=pose, pose_x=0.0 * pose, pose_y=0.0 * pose
    )
    found = prepared([recording], robot)
    assert "yaw_rate" in found.dead
    seen = found.windows(2.0, "encoders", part=training)
    assert fit_baselines(found, robot, "encoders", seen).effective_track.track_ratio == pytest.approx(ratio, rel=0.05)


def test_a_lateness_that_an_effect_says_is_taken_from_the_recordings_once(make_recording, robot):
    t = np.arange(0.0, 100.0, 0.05)
    # a drive that only goes straight does not tell how late its poses are
    recording = make_recording(pose_x=0.2 * (t - 0.4), pose_y=np.zeros(t.size), pose_yaw=np.zeros(t.size))
    late = PoseLatency(0.4)
    found = prepared([recording], robot, effects=(late, GyroBias(0.01)))
    assert found.noise[0].pose_lateness == 0.0
    assert any("moved back by 0.40 s, as an effect says" in note for note in found.notes)
    moved = found.recordings[0]["pose_x"]
    known = np.isfinite(moved)
    np.testing.assert_allclose(moved[known], 0.2 * t[known], atol=1e-9)
    assert simulated_effects((late, SensorHold(0.2), GyroBias(0.01))) == (GyroBias(0.01),)
