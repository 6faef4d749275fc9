from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.recordings.checks.findings import Status
from ddagr_gym.recordings.checks.travel import travel, travelled_over_rolled


def rng():
    return np.random.default_rng(0)


def changed(recording, **functions):
    channels = {n: functions[n](v) if n in functions else v for n, v in recording.channels.items()}
    return replace(recording, channels=channels)


@pytest.mark.parametrize(("share", "latency"), [(1.0, 0.0), (0.8, 0.0), (0.6, 0.5)])
def test_the_share_of_travel_is_found(make_drive, share, latency):
    found = travelled_over_rolled(make_drive(travel=share, pose_latency=latency), rng())
    assert found.values[:2] == pytest.approx([share, 0.0], abs=0.02)
    assert found.values[2] > 0.98


def test_a_turned_heading_is_found(make_drive):
    drive = changed(make_drive(), pose_yaw=lambda v: (v + 0.3 + np.pi) % (2 * np.pi) - np.pi)
    along, across, _ = travelled_over_rolled(drive, rng()).values
    assert np.arctan2(across, along) == pytest.approx(-0.3, abs=0.01)


@pytest.mark.parametrize(
    ("functions", "check", "channel"),
    [
        ({"pose_x": lambda v: 1000 * v, "pose_y": lambda v: 1000 * v}, "sign_and_scale", "encoder to pose"),
        ({"encoder_right": lambda v: -v, "encoder_left": lambda v: -v}, "sign_and_scale", "encoder to pose"),
        ({"pose_yaw": lambda v: v + 0.4}, "direction", "pose"),
        ({"pose_y": lambda v: -v}, "coherence", "encoder to pose"),
    ],
)
def test_faults_are_suspicious(make_drive, functions, check, channel):
    sound = {(f.check, f.channel): f for f in travel(make_drive(seconds=300.0), rng())}
    faulty = {(f.check, f.channel): f for f in travel(changed(make_drive(seconds=300.0), **functions), rng())}
    assert {f.status for f in sound.values()} == {Status.PASS}
    assert faulty[check, channel].status is Status.SUSPICIOUS


def test_without_pose_or_robot_travel_is_not_testable(make_drive):
    drive = make_drive()
    without = replace(drive, channels={n: v for n, v in drive.channels.items() if not n.startswith("pose")})
    assert travel(without, rng())[0].status is Status.NOT_TESTABLE
    assert "--robot" in travel(drive.with_meta(geometry=None), rng())[0].remedy
