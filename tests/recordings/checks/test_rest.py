"""Noise and gravity, the checks that need a robot that stands."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from ddagr_gym.recordings.checks.findings import Status
from ddagr_gym.recordings.checks.gravity import gravity, offset_by_attitude, offset_by_heading, rests
from ddagr_gym.recordings.checks.noise import noise, noise_at_rest
from ddagr_gym.recordings.checks.signals import standstills
from ddagr_gym.recordings.schema import Recording


def stops(
    headings, *, offset=(0.0, 0.0), slope=(0.0, 0.0), sigma=0.02, correlation=0.0, bias=0.0, attitude=False, seed=0
):
    """Rests of 8 s at the given headings with 4 s of driving between them, 50 Hz."""
    rng = np.random.default_rng(seed)
    rest, move = 400, 200
    speed = np.concatenate([np.concatenate([np.zeros(rest), np.full(move, 3.0)]) for _ in headings])
    yaw = np.repeat(headings, rest + move)
    n = speed.size

    def noisy(mean):
        white = rng.standard_normal(n) * np.sqrt(1 - correlation**2)
        return mean + sigma * lfilter([1.0], [1.0, -correlation], white)

    columns = {
        "t": np.arange(n) * 0.02,
        "encoder_right": speed,
        "encoder_left": speed,
        "specific_force_x": noisy(slope[0] * np.cos(yaw) + slope[1] * np.sin(yaw) + offset[0]),
        "specific_force_y": noisy(-slope[0] * np.sin(yaw) + slope[1] * np.cos(yaw) + offset[1]),
        "specific_force_z": noisy(np.full(n, 9.81)),
        "yaw_rate": noisy(np.full(n, bias)),
        "pose_yaw": (yaw + np.pi) % (2 * np.pi) - np.pi,
    }
    if attitude:
        columns["pitch"] = -np.arcsin((slope[0] * np.cos(yaw) + slope[1] * np.sin(yaw)) / 9.80665)
        columns["roll"] = np.arcsin((-slope[0] * np.sin(yaw) + slope[1] * np.cos(yaw)) / 9.80665)
    return Recording.from_columns(columns)


ROUND = (0.0, 1.5, 3.0, -1.5, 0.7)


def test_rests_are_found_with_their_margins():
    pieces = standstills(stops(ROUND))
    assert len(pieces) == 5
    lengths = [(p.stop - p.start) * 0.02 for p in pieces]
    # The first has no motion before it; the others lose half a second at each end.
    assert lengths[0] == pytest.approx(7.5, abs=0.05)
    assert lengths[1:] == pytest.approx([7.0] * 4, abs=0.05)


@pytest.mark.parametrize(("sigma", "correlation"), [(0.02, 0.0), (0.2, 0.6), (0.005, 0.9)])
def test_level_and_correlation_of_the_noise_are_found(sigma, correlation):
    found = noise_at_rest(stops(ROUND, sigma=sigma, correlation=correlation), "specific_force_x")
    assert found.sigma == pytest.approx(sigma, rel=0.15)
    assert found.correlation == pytest.approx(correlation, abs=0.06)
    assert found.sigma_interval[0] < sigma < found.sigma_interval[1]


def test_the_intervals_of_noise_hold_the_truth():
    held = [0, 0]
    for seed in range(100):
        found = noise_at_rest(stops(ROUND, correlation=0.5, seed=seed), "specific_force_x")
        held[0] += found.sigma_interval[0] < 0.02 < found.sigma_interval[1]
        held[1] += found.correlation_interval[0] < 0.5 < found.correlation_interval[1]
    assert min(held) >= 95


def test_a_sound_robot_at_rest_passes():
    assert {f.status for f in noise(stops(ROUND))} == {Status.PASS}


@pytest.mark.parametrize(
    ("options", "check", "suspect"),
    [
        ({"bias": 0.05}, "bias", "gyro_bias"),
        ({"sigma": 0.0}, "noise", "sensor_hold"),
        ({"correlation": 0.995}, "correlation", "sensor_hold"),
    ],
)
def test_faults_at_rest_are_suspicious(options, check, suspect):
    found = [f for f in noise(stops(ROUND, **options)) if f.channel == "yaw_rate" and f.check == check]
    assert found[0].status is Status.SUSPICIOUS
    assert suspect in found[0].suspects


def test_a_robot_that_never_stands_is_not_testable(warthog):
    t = np.arange(0, 30, 0.05)
    ones = np.ones(t.size)
    moving = Recording.from_columns(
        {"t": t, "encoder_right": ones, "encoder_left": ones, "specific_force_x": ones}, warthog
    )
    assert [f.status for f in noise(moving)] == [Status.NOT_TESTABLE]
    assert [f.status for f in gravity(moving)] == [Status.NOT_TESTABLE]


def test_slope_and_offset_are_told_apart_by_heading():
    values, intervals = offset_by_heading(rests(stops(ROUND, offset=(0.4, -0.1), slope=(0.8, -0.5))))
    assert values == pytest.approx([0.4, -0.1], abs=0.01)
    assert intervals[0][0] < 0.4 < intervals[0][1]


def test_one_heading_cannot_tell_them_apart():
    assert offset_by_heading(rests(stops((0.1, 0.2, 0.15, 0.1)))) is None
    (finding,) = [f for f in gravity(stops((0.1,) * 4, offset=(0.5, 0.0))) if "direction" in f.channel]
    assert finding.status is Status.PASS
    assert "cannot be distinguished" in finding.meaning


def test_roll_and_pitch_give_the_slope():
    values, _ = offset_by_attitude(rests(stops((0.1, 0.2), offset=(0.3, 0.0), slope=(0.8, -0.5), attitude=True)))
    assert values == pytest.approx([0.3, 0.0], abs=0.01)


@pytest.mark.parametrize(
    ("options", "channel"),
    [
        ({"offset": (0.6, 0.0)}, "specific_force_x"),
        ({"offset": (0.0, -0.6), "slope": (1.0, 0.0)}, "specific_force_y"),
        ({"offset": (0.0, 0.6), "attitude": True}, "specific_force_y"),
    ],
)
def test_an_offset_that_does_not_turn_is_suspicious(options, channel):
    findings = {f.channel: f for f in gravity(stops(ROUND, **options))}
    assert findings[channel].status is Status.SUSPICIOUS
    assert "imu_tilt" in findings[channel].suspects
    other = "specific_force_y" if channel.endswith("x") else "specific_force_x"
    assert findings[other].status is Status.PASS


def test_a_slope_alone_is_not_suspicious():
    assert {f.status for f in gravity(stops(ROUND, slope=(1.0, 0.5)))} == {Status.PASS}


@pytest.mark.parametrize("planar", [False, True])
def test_the_exact_zeros_of_a_planar_pose_are_no_attitude(planar):
    drive = stops((0.5, 0.6, 0.7, 0.6), slope=(1.0, 0.5))
    level = np.zeros(len(drive)) if planar else np.full(len(drive), 1e-6)
    drive = Recording.from_columns({**drive.columns(), "roll": level, "pitch": level})
    suspicious = [f for f in gravity(drive) if f.status is Status.SUSPICIOUS]
    assert [f.channel for f in suspicious] == ([] if planar else ["specific_force_x"])


def test_a_wrong_scale_shows_in_the_size_of_gravity():
    drive = stops(ROUND)
    drive.channels["specific_force_z"][:] *= 1.05
    assert gravity(drive)[0].status is Status.SUSPICIOUS


def commanded(drive, *, on_change=False):
    """The drive with commands that are its encoders' speeds."""
    speed = np.array(drive["encoder_right"])
    if on_change:
        speed[1:][np.diff(speed) == 0] = np.nan
    return Recording.from_columns({**drive.columns(), "command_right": speed, "command_left": speed})


def read_where(drive, rows):
    """The drive with encoders that report in some rows only."""
    encoders = {name: np.where(rows, drive[name], np.nan) for name in ("encoder_right", "encoder_left")}
    return Recording.from_columns({**drive.columns(), **encoders})


@pytest.mark.parametrize("on_change", [False, True])
@pytest.mark.parametrize("commands", [False, True])
def test_without_encoders_there_are_no_rests(commands, on_change):
    drive = commanded(stops(ROUND), on_change=on_change) if commands else stops(ROUND)
    drive = read_where(drive, np.zeros(len(drive), dtype=bool))
    assert standstills(drive) == []
    assert {f.status for f in noise(drive)} == {Status.NOT_TESTABLE}


def test_a_robot_whose_encoders_die_is_not_taken_to_rest_while_commands_are_in_force():
    drive = commanded(stops(ROUND), on_change=True)
    dead = read_where(drive, drive.t < 15.0)  # the second rest is from 12 to 20 s
    kept = standstills(drive)
    assert len(kept) == 5
    for piece in standstills(dead):
        assert any(whole.start <= piece.start and piece.stop <= whole.stop for whole in kept)


@pytest.mark.parametrize(("first", "known"), [(0.6, True), (4.0, False)])
def test_slow_encoders_cost_no_rest_before_their_first_reading(first, known):
    """A rest of 7.5 s from t = 0, seen from the first reading on or a second before it."""
    drive = stops(ROUND)
    pieces = standstills(read_where(drive, drive.t >= first))
    assert (drive.t[pieces[0].start] == 0.0) == known
    told = commanded(drive)
    assert standstills(read_where(told, told.t >= first))[0].start == 0


def test_before_the_first_reading_a_command_may_move_the_robot():
    drive = commanded(stops(ROUND))
    going = np.where(drive.t < 0.3, 1.0, drive["command_right"])
    drive = Recording.from_columns({**drive.columns(), "command_right": going})
    assert standstills(read_where(drive, drive.t >= 0.6))[0].start >= round(0.8 / 0.02)
