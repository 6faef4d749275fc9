from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.recordings.checks.clock_drift import Drift, clock_drift, drift_of, drifting_clock
from ddagr_gym.recordings.checks.clock_offsets import ENCODER, POSE, RESPONSE
from ddagr_gym.recordings.checks.findings import Status

CLOCKS = {
    "the encoders": ("encoder_right", "encoder_left"),
    "the pose": ("pose_x", "pose_y", "pose_yaw"),
    "the gyro": ("yaw_rate", "specific_force_x", "specific_force_y", "specific_force_z"),
}


def rng():
    return np.random.default_rng(0)


def drifting(recording, names, seconds):
    """Channels of which every sample is stamped late, by -seconds/2 at first and seconds/2 at last."""
    channels = dict(recording.channels)
    t = recording.t
    late = seconds * (t / t[-1] - 0.5)
    for name in names:
        known = np.isfinite(recording[name])
        at = np.searchsorted(t, (t + late)[known] - 0.5 * recording.period)
        values = np.full(len(recording), np.nan)
        inside = (at > 0) & (at < len(t))
        values[at[inside]] = recording[name][known][inside]
        channels[name] = values
    return replace(recording, channels=channels)


@pytest.mark.parametrize("seed", range(3))
def test_clocks_that_go_alike_pass(make_drive, seed):
    found = clock_drift(make_drive(seed=seed, encoder_latency=0.1, pose_latency=0.5), rng())
    assert {f.status for f in found} == {Status.PASS}


@pytest.mark.parametrize("clock", CLOCKS)
@pytest.mark.parametrize("seconds", [-0.5, 0.4])
def test_the_clock_that_drifts_is_named(make_drive, clock, seconds):
    found = clock_drift(drifting(make_drive(), CLOCKS[clock], seconds), rng())
    named = [f.meaning for f in found if f.status is Status.SUSPICIOUS]
    assert named
    assert all(f"The clock of {clock} drifts" in sentence for sentence in named)


def test_the_size_of_a_drift_is_found(make_drive):
    drift = drift_of(drifting(make_drive(), CLOCKS["the encoders"], 0.4), ENCODER, rng())
    assert drift.change == pytest.approx(0.4, abs=0.05)
    assert drift.interval[0] < 0.4 < drift.interval[1]


def known(change, error=0.02):
    return Drift(change, (change - 2.6 * error, change + 2.6 * error), error, 600.0, 0.9)


def test_a_clock_that_cannot_be_told_from_another_is_not_named_alone():
    # Without pose and response, gyro and encoders explain their offset alike.
    assert set(drifting_clock({ENCODER: known(0.5)})) == {"the gyro", "the encoders"}
    assert drifting_clock({ENCODER: known(0.5), POSE: known(0.0)}) == ("the encoders",)
    assert drifting_clock({ENCODER: known(-0.5), POSE: known(-0.5), RESPONSE: known(0.0)}) == ("the gyro",)
    assert drifting_clock({ENCODER: known(0.02), POSE: known(0.0)}) == ()


def test_a_short_drive_is_not_testable(make_drive):
    assert {f.status for f in clock_drift(make_drive(seconds=20.0), rng())} == {Status.NOT_TESTABLE}
