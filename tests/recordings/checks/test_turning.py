from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.recordings.checks.findings import Status
from ddagr_gym.recordings.checks.turning import effective_track, gyro_against_pose, turning
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
