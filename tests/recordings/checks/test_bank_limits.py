from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.recordings.checks.bank_limits import bank_limits, limit_of
from ddagr_gym.recordings.checks.findings import Status


def rng():
    return np.random.default_rng(0)


def capped(recording, limit):
    names = ("encoder_right", "encoder_left")
    return replace(
        recording, channels={**recording.channels, **{n: np.clip(recording[n], -limit, limit) for n in names}}
    )


@pytest.mark.parametrize("seed", range(3))
def test_banks_that_follow_all_commands_pass(make_drive, seed):
    found = bank_limits(make_drive(seed=seed, seconds=240.0), rng())
    assert [f.status for f in found] == [Status.PASS, Status.PASS]
    assert all(f.value == 0.0 for f in found)
    assert "follows its commands" in found[0].meaning


def test_capped_banks_are_named_with_their_limit(make_drive):
    found = bank_limits(capped(make_drive(seconds=240.0), 2.0), rng())
    assert [f.status for f in found] == [Status.SUSPICIOUS, Status.SUSPICIOUS]
    assert "The right bank stops at 2 rad/s" in found[0].meaning
    assert found[0].suspects == ("motor_saturation",)


def test_a_limit_is_found_beside_scatter_and_a_gain():
    noise = np.random.default_rng(1)
    command = noise.uniform(0.5, 10.0, 200)
    speed = np.minimum(0.9 * command, 6.0) + noise.normal(0.0, 0.1, 200)
    limit = limit_of(command, speed, rng())
    assert limit.speed == pytest.approx(6.0, abs=0.15)
    assert limit.share == pytest.approx(np.mean(0.9 * command > 6.0), abs=0.03)
    assert limit.interval[0] <= limit.share <= limit.interval[1]


def test_droop_alone_is_no_limit():
    noise = np.random.default_rng(1)
    command = noise.uniform(0.5, 10.0, 200)
    limit = limit_of(command, 0.7 * command + noise.normal(0.0, 0.2, 200), rng())
    assert math.isinf(limit.speed)
    assert limit.share == 0.0


def test_few_commands_are_not_testable(make_drive):
    assert {f.status for f in bank_limits(make_drive(seconds=20.0), rng())} == {Status.NOT_TESTABLE}
