from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.recordings.checks.findings import Status
from ddagr_gym.recordings.checks.turning import effective_track, enough_turns, gyro_against_pose, turning, turns
from ddagr_gym.recordings.schema import Recording


def rng():
    return np.random.default_rng(0)


@pytest.mark.parametrize(("scale", "bias"), [(1.0, 0.0), (1.1, 0.0), (0.8, 0.03), (-1.0, 0.0), (1.0, -0.05)])
def test_scale_and_bias_of_the_gyro_are_found_beside_a_late_pose(make_drive, scale, bias):
    found = gyro_against_pose(make_drive(gyro_scale=scale, gyro_bias=bias, pose_latency=0.4), rng())
    assert found.values == pytest.approx([scale, bias], abs=0.01)
    assert found.intervals[0][1] - found.intervals[0][0] < 0.05


@pytest.mark.parametrize(("track", "right"), [(1.2, 1.0), (2.0, 1.0), (1.6, 1.1), (1.6, 0.9)])
def test_effective_track_and_balance_are_found(make_drive, track, right):
    found = effective_track(make_drive(effective_track=track, right_scale=right), rng())
    # yaw rate = R/(2 W chi) (w_r/s - w_l) for encoders that read s w_r
    assert found.values[1] == pytest.approx(1.0 / right, rel=0.01)
    assert found.values[0] == pytest.approx(2 * track / (1 + 1 / right), rel=0.01)


@pytest.mark.parametrize(
    ("faults", "check", "channel", "suspect"),
    [
        ({"gyro_scale": -1.0}, "sign_and_scale", "yaw_rate to pose_yaw", "gyro_sign"),
        ({"gyro_scale": -1.0}, "sign_and_scale", "encoder to yaw_rate", "gyro_sign"),
        ({"gyro_scale": 1.1}, "sign_and_scale", "yaw_rate to pose_yaw", "gyro_scale"),
        ({"gyro_bias": 0.05}, "bias", "yaw_rate to pose_yaw", "gyro_bias"),
        ({"right_scale": 1.15}, "balance", "encoder_right to encoder_left", "encoder_scale"),
    ],
)
def test_faults_are_suspicious_and_named(make_drive, faults, check, channel, suspect):
    sound = {(f.check, f.channel): f for f in turning(make_drive(), rng())}
    faulty = {(f.check, f.channel): f for f in turning(make_drive(**faults), rng())}
    assert sound[check, channel].status is Status.PASS
    assert faulty[check, channel].status is Status.SUSPICIOUS
    assert suspect in faulty[check, channel].suspects
    assert faulty[check, channel].remedy


def test_without_the_robot_the_track_is_not_testable(make_drive):
    findings = turning(make_drive().with_meta(geometry=None), rng())
    assert findings[-1].status is Status.NOT_TESTABLE
    assert "--robot" in findings[-1].remedy


def test_a_straight_drive_is_not_testable(warthog):
    t = np.arange(0, 60, 0.05)
    noise = 0.003 * np.random.default_rng(0).normal(size=t.size)
    columns = {"t": t, "encoder_right": 3 + noise, "encoder_left": 3 - noise, "yaw_rate": noise, "pose_yaw": noise}
    assert {f.status for f in turning(Recording.from_columns(columns, warthog), rng())} == {Status.NOT_TESTABLE}


@pytest.mark.parametrize("encoders", [True, False])
def test_a_long_rest_hides_no_fault_of_the_gyro(make_drive, rested, encoders):
    drive = rested(make_drive(gyro_scale=1.3, effective_track=12.0), 600.0)
    if not encoders:
        drive = replace(drive, channels={k: v for k, v in drive.channels.items() if not k.startswith("encoder")})
    assert np.sqrt(np.mean(drive["yaw_rate"] ** 2)) < 0.05
    finding = turning(drive, rng())[0]
    assert finding.status is Status.SUSPICIOUS
    assert finding.value == pytest.approx(1.3, abs=0.01)


def test_a_dead_gyro_is_accused_by_poses_and_wheels_also_after_a_long_rest(make_drive, rested):
    drive = make_drive(effective_track=12.0)
    drive.channels["yaw_rate"][:] *= 1e-4
    assert turns(rested(drive, 2400.0))


def test_neither_rests_nor_spikes_make_turns_of_a_straight_drive(warthog):
    t = np.arange(0, 660, 0.05)
    noise = 0.003 * np.random.default_rng(0).normal(size=t.size)
    speed = np.where(t < 60, 3.0, 0.0)
    columns = {"t": t, "encoder_right": speed, "encoder_left": speed, "yaw_rate": noise, "pose_yaw": noise}
    assert not turns(Recording.from_columns(columns, warthog))
    spikes = {"t": t, "yaw_rate": np.where(np.arange(t.size) % 200 == 0, 0.2, noise)}
    assert not turns(Recording.from_columns(spikes, warthog))


def test_what_counts_as_turns():
    slow, fast = np.full(200, 0.02), np.full(200, 0.2)
    both, moving = np.concatenate([slow, slow, slow, slow, fast]) * 0.4, np.repeat([False, True], [800, 200])
    assert enough_turns(both, moving, 0.05)
    assert not enough_turns(both, np.ones(1000, dtype=bool), 0.05)
    assert not enough_turns(both, moving, 0.001)  # 0.2 s of motion
    assert not enough_turns(np.full(1000, np.nan), moving, 0.05)
