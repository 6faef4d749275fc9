from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.recordings.checks.clock_offsets import (
    clock_offsets,
    encoder_offset,
    gyro_direction,
    pose_offset,
    response_offset,
    unwrapped_heading,
)
from ddagr_gym.recordings.checks.findings import Status
from ddagr_gym.recordings.schema import Recording


def rng():
    return np.random.default_rng(0)


@pytest.mark.parametrize("latency", [-0.4, 0.0, 0.3, 0.9])
def test_the_pose_latency_is_found(make_drive, latency):
    found = pose_offset(make_drive(pose_latency=latency), rng())
    assert found.interval[0] - 0.01 <= latency <= found.interval[1] + 0.01
    assert found.lag == pytest.approx(latency, abs=0.03)


@pytest.mark.parametrize("latency", [-0.3, 0.0, 0.25])
def test_the_encoder_latency_is_found(make_drive, latency):
    found = encoder_offset(make_drive(encoder_latency=latency), rng())
    assert found.lag == pytest.approx(latency, abs=0.03)
    assert found.correlation > 0.98


def test_a_gyro_with_the_wrong_sign_has_the_same_clock(make_drive):
    drive = make_drive(pose_latency=0.3, gyro_scale=-1.0)
    assert gyro_direction(drive) == -1.0
    assert pose_offset(drive, rng()).lag == pytest.approx(0.3, abs=0.03)
    assert pose_offset(drive, rng()).correlation < -0.95


def test_the_response_holds_delay_and_motor_lag(make_drive):
    """A first-order bank lags by about its time constant in correlation; a longer delay shifts it by as much."""
    early = response_offset(make_drive(command_delay=0.1), rng()).lag
    late = response_offset(make_drive(command_delay=0.4), rng()).lag
    assert late - early == pytest.approx(0.3, abs=0.04)
    assert 0.1 < early < 0.1 + 0.3


def test_headings_are_unwrapped_across_gaps_of_more_than_half_a_turn(warthog):
    t = np.arange(0, 20, 0.05)
    yaw = 2.0 * t
    pose = np.where(np.arange(t.size) % 40 == 0, (yaw + np.pi) % (2 * np.pi) - np.pi, np.nan)
    recording = Recording.from_columns({"t": t, "yaw_rate": np.full(t.size, 2.0), "pose_yaw": pose}, warthog)
    rows = np.flatnonzero(np.isfinite(pose))
    heading = unwrapped_heading(recording)[rows]
    np.testing.assert_allclose(heading - heading[0], yaw[rows] - yaw[rows[0]], atol=1e-9)


def test_no_turns_and_no_pose_are_not_testable(warthog):
    t = np.arange(0, 60, 0.05)
    quiet = np.random.default_rng(0).normal(0, 0.003, t.size)
    columns = {"t": t, "encoder_right": np.ones(t.size), "encoder_left": np.ones(t.size), "yaw_rate": quiet}
    findings = clock_offsets(Recording.from_columns(columns, warthog), rng())
    assert [f.status for f in findings] == [Status.NOT_TESTABLE] * 3
    assert all(f.remedy for f in findings)


@pytest.mark.parametrize(
    ("faults", "channel", "suspect"),
    [
        ({"pose_latency": 1.3}, "yaw_rate to pose", "pose_latency"),
        ({"pose_latency": -0.5}, "yaw_rate to pose", "pose_latency"),
        ({"encoder_latency": 0.5}, "yaw_rate to encoder", "sensor_hold"),
        ({"command_delay": -0.4}, "command to encoder", "command_delay"),
    ],
)
def test_shifted_clocks_are_suspicious(make_drive, faults, channel, suspect):
    findings = {f.channel: f for f in clock_offsets(make_drive(**faults), rng())}
    assert findings[channel].status is Status.SUSPICIOUS
    assert suspect in findings[channel].suspects
    assert all(f.status is Status.PASS for name, f in findings.items() if name != channel)
