from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.recordings.checks.accelerometer import accelerometer, force_coefficients
from ddagr_gym.recordings.checks.findings import Status


def rng():
    return np.random.default_rng(0)


@pytest.mark.parametrize("angle", [-0.3, 0.0, 0.2, 1.2])
def test_the_mounting_angle_is_found(make_drive, angle):
    found = force_coefficients(make_drive(mounting_yaw=angle, travel=1.0), rng())
    assert found.values[2] == pytest.approx(angle, abs=0.03)
    assert found.values[:2] == pytest.approx(np.full(2, np.cos(angle)), abs=0.05)


def test_slip_lowers_both_coefficients_alike(make_drive):
    found = force_coefficients(make_drive(travel=0.7), rng())
    assert found.values[:3] == pytest.approx([0.7, 0.7, 0.0], abs=0.04)


def test_an_offset_while_driving_is_found(make_drive):
    found = force_coefficients(make_drive(force_offset=(0.5, -1.5)), rng())
    assert found.values[3:] == pytest.approx([0.5, -1.5], abs=0.05)


@pytest.mark.parametrize(
    ("faults", "check", "channel"),
    [
        ({"force_x_sign": -1.0}, "accelerometer", "specific_force_x"),
        ({"force_y_sign": -1.0}, "accelerometer", "specific_force_y"),
        ({"mounting_yaw": 0.25}, "mounting", "specific_force"),
        ({"force_offset": (0.0, 1.4)}, "offset", "specific_force_y"),
    ],
)
def test_faults_are_suspicious(make_drive, faults, check, channel):
    sound = {(f.check, f.channel): f.status for f in accelerometer(make_drive(), rng())}
    faulty = {(f.check, f.channel): f.status for f in accelerometer(make_drive(**faults), rng())}
    assert set(sound.values()) == {Status.PASS}
    assert faulty[check, channel] is Status.SUSPICIOUS


def test_without_the_robot_it_is_not_testable(make_drive):
    (finding,) = accelerometer(make_drive().with_meta(geometry=None), rng())
    assert finding.status is Status.NOT_TESTABLE
