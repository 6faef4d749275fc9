"""Timing, repeated, stuck, saturated and zeroed channels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.recordings.checks.extremes import extremes, false_zeros, saturated_share
from ddagr_gym.recordings.checks.findings import Status
from ddagr_gym.recordings.checks.repeated_readings import longest_freeze, natural_repeats, repeated_readings
from ddagr_gym.recordings.checks.timing import timing
from ddagr_gym.recordings.schema import Recording


def changed(recording, **functions):
    channels = {n: functions[n](v.copy()) if n in functions else v for n, v in recording.channels.items()}
    return replace(recording, channels=channels)


def repeated(count):
    return lambda v: v[(np.arange(v.size) // count) * count]


def status_of(findings, check, channel):
    return next(f.status for f in findings if f.check == check and f.channel == channel)


def test_a_sound_drive_passes(make_drive):
    drive = make_drive()
    for check in (timing, repeated_readings, extremes):
        assert {f.status for f in check(drive)} == {Status.PASS}


def test_jitter_gaps_and_duplicates(make_drive):
    drive = make_drive()
    rng = np.random.default_rng(0)
    jittered = Recording.from_columns({**drive.columns(), "t": drive.t + rng.uniform(0, 0.018, drive.t.size)})
    assert status_of(timing(jittered), "timing", "t, jitter") is Status.SUSPICIOUS
    keep = (np.arange(len(drive)) % 500) > 40
    gappy = Recording.from_columns({n: v[keep] for n, v in drive.columns().items()})
    assert status_of(timing(gappy), "timing", "t, gaps") is Status.SUSPICIOUS
    doubled = drive.with_meta(duplicates_dropped=60)
    assert status_of(timing(doubled), "timing", "t, duplicates") is Status.SUSPICIOUS


def test_a_sensor_that_stops_for_a_third_of_the_time(make_drive):
    def dropping(v):
        v[(np.arange(v.size) % 300) < 100] = np.nan
        return v

    drive = changed(make_drive(), encoder_right=dropping)
    assert status_of(timing(drive), "wait", "encoder_right, share") is Status.SUSPICIOUS
    assert status_of(timing(drive), "wait", "encoder_left, share") is Status.PASS


def test_a_sensor_that_stops_once(make_drive):
    def stopping(v):
        v[3000:3200] = np.nan
        return v

    drive = changed(make_drive(), yaw_rate=stopping)
    assert status_of(timing(drive), "wait", "yaw_rate") is Status.SUSPICIOUS
    assert status_of(timing(drive), "wait", "yaw_rate, share") is Status.PASS


def test_a_sensor_that_hangs_once(make_drive):
    def hanging(v):
        v[3000:3100] = v[3000]
        return v

    drive = changed(make_drive(), yaw_rate=hanging)
    assert status_of(repeated_readings(drive), "frozen", "yaw_rate") is Status.SUSPICIOUS
    assert status_of(repeated_readings(drive), "held", "yaw_rate") is Status.PASS
    assert longest_freeze(drive, "yaw_rate", np.ones(len(drive), dtype=bool)) == pytest.approx(99 * 0.02)


def test_a_sensor_that_is_too_slow(make_drive):
    def thinned(v):
        v[np.arange(v.size) % 50 != 0] = np.nan
        return v

    drive = changed(make_drive(), encoder_left=thinned)
    assert status_of(timing(drive), "rate", "encoder_left") is Status.SUSPICIOUS


def test_a_core_channel_without_samples_is_not_testable(make_drive):
    drive = changed(make_drive(), yaw_rate=lambda v: np.full(v.size, np.nan))
    assert status_of(timing(drive), "rate", "yaw_rate") is Status.NOT_TESTABLE


@pytest.mark.parametrize("count", [2, 5])
def test_undeclared_repeats_are_suspicious(make_drive, count):
    drive = changed(make_drive(), yaw_rate=repeated(count))
    findings = {f.channel: f for f in repeated_readings(drive) if f.check == "held"}
    assert findings["yaw_rate"].status is Status.SUSPICIOUS
    assert findings["yaw_rate"].value == pytest.approx(1 - 1 / count, abs=0.01)
    assert findings["specific_force_x"].status is Status.PASS


def test_declared_channels_are_left_out(make_drive):
    drive = changed(make_drive(), yaw_rate=repeated(5)).with_meta(held={"yaw_rate": 0.1})
    assert "yaw_rate" not in {f.channel for f in repeated_readings(drive)}


@pytest.mark.parametrize("quantum", [1e-4, 1e-3, 5e-3])
def test_a_coarse_gyro_is_not_taken_for_a_repeated_one(make_drive, quantum):
    drive = changed(make_drive(), yaw_rate=lambda v: quantum * np.round(v / quantum))
    assert status_of(repeated_readings(drive), "held", "yaw_rate") is Status.PASS


def test_a_coarse_gyro_that_repeats_is_found(make_drive):
    drive = changed(make_drive(), yaw_rate=lambda v: repeated(4)(1.3e-4 * np.round(v / 1.3e-4)))
    assert status_of(repeated_readings(drive), "held", "yaw_rate") is Status.SUSPICIOUS


@pytest.mark.parametrize("quantum", [0.3, 1.0, 2.0])
def test_natural_repeats_follow_the_resolution(quantum):
    """Rounded differences of unit normal noise are 0 with probability about q/(sigma_d sqrt(2 pi))."""
    values = np.round(np.random.default_rng(0).normal(size=200_000) / quantum) * quantum
    steps = np.abs(np.diff(values))
    assert natural_repeats(steps) >= 0.8 * np.mean(steps == 0)


def test_a_stuck_channel(make_drive):
    drive = changed(make_drive(), encoder_left=lambda v: np.full(v.size, 2.0))
    assert status_of(extremes(drive), "stuck", "encoder_left") is Status.SUSPICIOUS


@pytest.mark.parametrize("channel", ["yaw_rate", "specific_force_y"])
def test_a_clipped_channel(make_drive, channel):
    limit = float(np.quantile(np.abs(make_drive()[channel]), 0.97))
    drive = changed(make_drive(), **{channel: lambda v: np.clip(v, -limit, limit)})
    assert status_of(extremes(drive), "saturation", channel) is Status.SUSPICIOUS


@pytest.mark.parametrize("quantum", [0.01, 0.05, 0.1])
def test_quantised_noise_is_not_clipped(quantum):
    rng = np.random.default_rng(0)
    values = np.round(rng.normal(size=20_000) / quantum) * quantum
    assert saturated_share(values) == 0.0
    assert saturated_share(np.clip(values, -1, 1)) > 0.1


@pytest.mark.parametrize("channel", ["yaw_rate", "encoder_right", "pose_x"])
def test_zeros_for_missing_data(make_drive, channel):
    def zeroed(v):
        rows = np.flatnonzero(np.isfinite(v) & (np.abs(v) > 0.5 * np.nanmax(np.abs(v))))
        v[rows[:: max(1, rows.size // 40)]] = 0.0
        return v

    sound, faulty = make_drive(), changed(make_drive(), **{channel: zeroed})
    assert status_of(extremes(sound), "zeros", channel) is Status.PASS
    assert status_of(extremes(faulty), "zeros", channel) is Status.SUSPICIOUS


def test_zeros_of_a_robot_that_stops_are_measurements():
    ramp = np.linspace(5, 0, 20)
    values = np.concatenate([np.full(100, 5.0), ramp, np.zeros(30), ramp[::-1], np.full(100, 5.0)])
    assert false_zeros(values, longest=50, heaps_count=False) == 0


def test_zeros_on_the_way_through_zero_are_measurements():
    values = np.concatenate([np.linspace(4, 1, 50), [0.0], np.linspace(-1, -4, 50)])
    assert false_zeros(values, longest=5, heaps_count=False) == 0
