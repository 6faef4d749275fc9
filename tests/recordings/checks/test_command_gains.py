from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.recordings.checks.command_gains import command_gains, gain_findings, straight_gain
from ddagr_gym.recordings.checks.findings import Status

BANKS = ("right", "left")


def rng():
    return np.random.default_rng(0)


def changed(recording, **functions):
    channels = {n: functions[n](v) if n in functions else v for n, v in recording.channels.items()}
    return replace(recording, channels=channels)


def test_command_gains_are_found(make_drive):
    found = command_gains(make_drive(right_scale=1.1, left_scale=0.9), rng())
    assert found.values == pytest.approx([1.1, 0.9, 1.1 / 0.9], rel=0.01)


@pytest.mark.parametrize("scale", [0.9, 1.0, 1.1])
def test_the_gain_straight_ahead_is_found(make_drive, scale):
    gain, (low, high) = straight_gain(make_drive(seconds=300.0, right_scale=scale, left_scale=scale))
    assert gain == pytest.approx(scale, rel=1e-3)
    assert low <= gain <= high


def test_the_gain_straight_ahead_is_that_of_holds_in_which_the_command_is_followed(make_drive):
    """A limit of the motors slows fast holds; what is slower than a quarter of the fastest is not counted."""
    made = make_drive(seconds=300.0, right_scale=1.1, left_scale=1.1)
    limited = changed(made, encoder_right=lambda v: np.minimum(v, 4.5), encoder_left=lambda v: np.minimum(v, 4.5))
    assert straight_gain(limited)[0] == pytest.approx(1.1, rel=1e-3)


def test_readings_that_come_seldom_and_apart_count(make_drive):
    made = make_drive(seconds=300.0, right_scale=1.1, left_scale=1.1)
    rows = np.arange(len(made))
    seldom = changed(
        made,
        encoder_right=lambda v: np.where(rows % 12 == 0, v, np.nan),
        encoder_left=lambda v: np.where(rows % 12 == 6, v, np.nan),
    )
    assert straight_gain(seldom)[0] == pytest.approx(1.1, rel=2e-3)


def test_steering_may_go_on_while_the_speed_is_held(make_drive):
    """A robot that follows a row never holds a bank's command; its wheels lag behind the steering."""
    made = make_drive(seconds=300.0)
    speed = 4.0 + 2.0 * (made.t // 30.0 % 2.0)
    steering = [np.sin(0.7 * (made.t - late)) for late in (0.0, 0.3)]
    following = changed(
        made,
        command_right=lambda _: speed + steering[0],
        command_left=lambda _: speed - steering[0],
        encoder_right=lambda _: 1.1 * (speed + steering[1]),
        encoder_left=lambda _: 1.1 * (speed - steering[1]),
    )
    gain, (low, high) = straight_gain(following)
    assert gain == pytest.approx(1.1, rel=1e-6)
    assert low <= gain <= high
    found = {item.channel: item.status for item in gain_findings(following, rng())}
    assert found == {
        "command to encoder": Status.NOT_TESTABLE,
        "command to encoder, straight": Status.SUSPICIOUS,
    }


def test_a_speed_that_never_stays_is_not_held(make_drive):
    made = make_drive(seconds=300.0)
    waves = {
        f"{kind}_{bank}": lambda _: 4.0 + 2.0 * np.sin(0.5 * made.t)
        for kind in ("command", "encoder")
        for bank in BANKS
    }
    assert straight_gain(changed(made, **waves)) is None


def test_without_straight_holds_there_is_no_gain(make_drive):
    made = make_drive()
    turning = changed(made, command_left=lambda v: -made["command_right"])
    assert straight_gain(turning) is None
    assert "command to encoder, straight" not in [item.channel for item in gain_findings(turning, rng())]


@pytest.mark.parametrize(
    ("functions", "check", "channel"),
    [
        ({"encoder_left": lambda v: -v}, "sign_and_scale", "command_left to encoder_left"),
        ({"encoder_right": lambda v: 1.3 * v}, "balance", "command to encoder, right to left"),
        (
            {"encoder_right": lambda v: 1.08 * v, "encoder_left": lambda v: 1.08 * v},
            "sign_and_scale",
            "command to encoder, straight",
        ),
    ],
)
def test_faults_are_suspicious(make_drive, functions, check, channel):
    made = make_drive(seconds=300.0)
    sound = {(f.check, f.channel): f for f in gain_findings(made, rng())}
    faulty = {(f.check, f.channel): f for f in gain_findings(changed(made, **functions), rng())}
    assert {f.status for f in sound.values()} == {Status.PASS}
    assert faulty[check, channel].status is Status.SUSPICIOUS


def test_commands_that_are_never_held_are_not_testable(make_drive):
    made = make_drive()
    moving = changed(made, command_right=lambda v: v + np.sin(made.t))
    (finding,) = gain_findings(moving, rng())
    assert finding.status is Status.NOT_TESTABLE
    assert "Hold commands" in finding.remedy
