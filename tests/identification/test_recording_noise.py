from __future__ import annotations

import math

import numpy as np
import pytest

from ddagr_gym.identification.noise import INSTRUMENT_NOISE
from ddagr_gym.identification.recording_noise import dead_channels, pose_lateness, recording_noise
from ddagr_gym.recordings.checks.clock_offsets import Offset


@pytest.fixture(scope="module")
def moving(make_recording):
    """Rest, then turns; gyro noise 0.01 rad/s with bias 0.004; poses 0.5 s late by a clock of 5 Hz."""

    def make(lateness=0.5, sign=1.0, vibration=0.05):
        rng = np.random.default_rng(0)
        t = np.arange(0.0, 200.0, 0.05)
        steps = np.repeat(rng.uniform(-1.0, 1.0, 40), 100)
        steps[:1000] = 0.0
        moves = np.abs(steps) > 0.0
        heading = np.cumsum(steps) * 0.05
        pose = np.where(np.arange(t.size) % 4 == 0, np.interp(t - lateness, t, heading), np.nan)
        return make_recording(
            seconds=200.0,
            yaw_rate=sign * steps + 0.004 + rng.normal(0.0, 0.01, t.size),
            encoder_right=2.0 * moves + 0.3 * steps,
            encoder_left=2.0 * moves - 0.3 * steps,
            specific_force_x=rng.normal(0.0, 0.02, t.size) + moves * rng.normal(0.0, vibration, t.size),
            pose_x=np.where(np.isfinite(pose), 0.1 * t, np.nan),
            pose_y=np.where(np.isfinite(pose), 0.0, np.nan),
            pose_yaw=np.angle(np.exp(1j * pose)),
        )

    return make


def test_the_sizes_of_the_noise_are_found(moving):
    found = recording_noise(moving(), np.random.default_rng(1)).channels
    assert found["yaw_rate"].sigma == pytest.approx(0.01, rel=0.1)
    # 0.02 at rest; vibration adds 0.05 on the way
    assert found["specific_force_x"].sigma == pytest.approx(math.hypot(0.02, 0.05), rel=0.1)
    assert abs(found["yaw_rate"].correlation) < 0.1


def test_the_gyro_bias_is_that_at_rest(moving):
    bias, deviation = recording_noise(moving(), np.random.default_rng(1)).gyro_bias
    assert bias == pytest.approx(0.004, abs=4.0 * deviation)
    assert deviation < 0.002


def test_the_lateness_of_poses_has_an_interval_where_it_is_told(moving):
    found = recording_noise(moving(0.5), np.random.default_rng(1))
    low, high = found.lateness_interval
    assert low <= found.pose_lateness <= high
    assert high - low < 0.3
    assert recording_noise(moving(-0.2), np.random.default_rng(1)).lateness_interval is None


@pytest.mark.parametrize("lateness", [0.0, 0.5])
def test_the_lateness_of_poses_is_found(moving, lateness):
    found = recording_noise(moving(lateness), np.random.default_rng(1))
    assert found.pose_lateness == pytest.approx(lateness, abs=0.05)
    assert found.pose_jitter < 0.1
    assert not found.opposed


def _with_poses(make_recording, scatter, compass, turning):
    """Poses whose time scatters and whose heading is noisy, of a drive of 200 s at 1 m/s that turns so fast [rad/s]."""
    rng = np.random.default_rng(7)
    t = np.arange(0.0, 200.0, 0.05)
    rate = turning * np.repeat(rng.uniform(-1.0, 1.0, 40), 100)
    heading = (np.cumsum(rate) - 0.5 * rate) * 0.05
    known = np.arange(t.size) % 4 == 0
    read = np.interp(t + scatter * rng.normal(size=t.size), t, heading) + compass * rng.normal(size=t.size)
    return make_recording(
        seconds=200.0,
        yaw_rate=rate + rng.normal(0.0, 0.002, t.size),
        encoder_right=np.full(t.size, 4.0),
        encoder_left=np.full(t.size, 4.0),
        pose_x=np.where(known, t, np.nan),
        pose_y=np.where(known, 0.0, np.nan),
        pose_yaw=np.where(known, np.angle(np.exp(1j * read)), np.nan),
    )


def test_the_scatter_of_the_poses_time_is_told_from_the_noise_of_their_heading(make_recording):
    found = recording_noise(_with_poses(make_recording, 0.1, 0.01, 1.0), np.random.default_rng(1))
    assert found.pose_jitter == pytest.approx(0.1, rel=0.25)
    assert found.channels["pose_x"].sigma == pytest.approx(0.1, rel=0.25)


@pytest.mark.parametrize("turning", [1.0, 0.02, 0.0])
def test_a_noisy_compass_says_nothing_of_the_time_and_so_of_places(make_recording, turning):
    found = recording_noise(_with_poses(make_recording, 0.0, 0.01, turning), np.random.default_rng(1))
    assert found.channels["pose_x"].sigma < 0.05
    assert found.channels["pose_yaw"].sigma == pytest.approx(0.01, rel=0.2)


def test_a_gyro_against_the_poses_is_noticed(moving):
    assert recording_noise(moving(sign=-1.0), np.random.default_rng(1)).opposed


def test_an_ideal_recording_gets_the_instruments_floor(make_recording):
    found = recording_noise(make_recording(), np.random.default_rng(0))
    assert dict(zip(found.channels, found.sigma, strict=False)).keys() <= INSTRUMENT_NOISE.keys()
    for name, floor in INSTRUMENT_NOISE.items():
        assert found.channels[name].sigma == floor


def test_channels_that_never_change_are_dead(make_recording):
    recording = make_recording(encoder_right=np.arange(2000.0), pose_x=np.full(2000, np.nan))
    assert dead_channels(recording) == ("yaw_rate", "encoder_left")


def test_a_robot_that_never_moves_has_no_dead_channel(make_recording):
    assert dead_channels(make_recording()) == ()


@pytest.mark.parametrize(
    ("lag", "interval", "correlation", "expected"),
    [
        (0.4, (0.3, 0.5), 0.9, 0.4),
        (0.4, (0.3, 0.5), -0.9, 0.4),
        (0.4, (0.3, 0.5), 0.2, 0.0),
        (0.4, (-0.5, 1.0), 0.9, 0.0),
        (0.4, (math.nan, math.nan), 0.9, 0.0),
        (-0.1, (-0.2, 0.0), 0.9, 0.0),
    ],
)
def test_only_a_clear_lateness_is_corrected(lag, interval, correlation, expected):
    assert pose_lateness(Offset(lag, interval, correlation, np.empty(0), 10)) == expected


def test_no_offset_is_no_lateness():
    assert pose_lateness(None) == 0.0
