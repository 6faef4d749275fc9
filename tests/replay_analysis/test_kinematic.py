from __future__ import annotations

import math

import numpy as np
import pytest

from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.replay_analysis.kinematic import KinematicModel, Motor, fit_motor, fit_track

GYRO, YAW = CHANNELS.index("yaw_rate"), CHANNELS.index("pose_yaw")
X, Y = CHANNELS.index("pose_x"), CHANNELS.index("pose_y")
ENCODERS = [CHANNELS.index("encoder_right"), CHANNELS.index("encoder_left")]


@pytest.fixture(scope="module")
def windows(make_windows):
    """Twenty windows of 4 s, driven by smooth random bank speeds."""
    rng = np.random.default_rng(0)
    steps = rng.uniform(-3.0, 3.0, (20, 6, 2))
    return make_windows(np.repeat(steps, 17, axis=1)[:, :100])


def test_constant_bank_speeds_drive_a_circle(make_windows):
    windows = make_windows(np.broadcast_to([3.0, 1.0], (1, 120, 2)).copy())
    prediction = KinematicModel(0.25, 0.5, 2.0).predict(windows)[0]
    turning = 0.25 * (3.0 - 1.0) / (2.0 * 0.5 * 2.0)
    time = 0.05 * np.arange(1, 101)
    radius = 0.25 * 2.0 / turning
    np.testing.assert_allclose(prediction[:, YAW], turning * time)
    # chords of 0.0125 rad: sin(h/2)/(h/2) = 1 - 6.5e-6
    np.testing.assert_allclose(prediction[:, X], radius * np.sin(turning * time), rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(prediction[:, Y], radius * (1.0 - np.cos(turning * time)), rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(prediction[:, CHANNELS.index("specific_force_y")], 0.5 * turning)


def test_the_motor_follows_a_step_after_its_delay(make_windows):
    drive = np.zeros((1, 60, 2))
    drive[:, 10:] = 4.0
    speeds = Motor(2.0, 3.0, delay=0.2).speeds(make_windows(drive))[0, :, 0]
    time = 0.05 * np.arange(41)
    expected = np.where(time > 0.2, 3.0 * (1.0 - np.exp(-2.0 * np.maximum(time - 0.2, 0.0))), 0.0)
    np.testing.assert_allclose(speeds, expected, atol=1e-12)


@pytest.mark.parametrize(("ratio", "delay"), [(1.7, 0.0), (1.3, -0.2), (2.4, 0.1)])
def test_track_and_lateness_of_the_encoders_are_found(windows, ratio, delay):
    measured = KinematicModel(0.25, 0.5, ratio, delay=delay).predict(windows)
    measured[..., GYRO] += np.random.default_rng(1).normal(0.0, 0.01, measured[..., GYRO].shape)
    found = fit_track(_with(windows, measured), 0.25, 0.5, sigma=0.01, robust=2.0)
    assert found.track_ratio == pytest.approx(ratio, rel=0.01)
    assert found.delay == pytest.approx(delay, abs=0.011)


def test_a_robust_loss_ignores_a_few_wild_windows(windows):
    measured = KinematicModel(0.25, 0.5, 1.7).predict(windows)
    measured[:3, :, GYRO] *= -3.0
    plain = fit_track(_with(windows, measured), 0.25, 0.5)
    robust = fit_track(_with(windows, measured), 0.25, 0.5, sigma=0.01, robust=2.0)
    assert robust.track_ratio == pytest.approx(1.7, rel=0.02)
    assert plain is None or abs(plain.track_ratio - 1.7) > 0.3


def test_poses_give_the_track_where_the_gyro_is_dead(windows):
    measured = KinematicModel(0.25, 0.5, 1.7).predict(windows)
    measured[..., GYRO] = 0.0
    found = fit_track(_with(windows, measured), 0.25, 0.5)
    assert found.track_ratio == pytest.approx(1.7, rel=0.02)


def test_no_track_where_the_robot_turns_against_its_wheels(windows):
    measured = KinematicModel(0.25, 0.5, 1.7).predict(windows)
    measured[..., GYRO] *= -1.0
    assert fit_track(_with(windows, measured), 0.25, 0.5, sigma=0.01, robust=2.0) is None


def test_the_motor_is_found_from_encoders(windows):
    true = Motor(3.0, 2.5, 0.12)
    speeds = true.speeds(windows)
    measured = np.full((20, windows.samples, 8), np.nan)
    measured[..., ENCODERS] = 0.5 * (speeds[:, 1:] + speeds[:, :-1])
    found = fit_motor(_with(windows, measured), 6.0, 4.0, 0.02)
    assert found.rate == pytest.approx(3.0, rel=0.02)
    assert found.maximum_speed == pytest.approx(2.5, rel=0.01)
    assert found.delay == pytest.approx(0.12, abs=0.01)


def test_without_encoders_the_motor_is_the_nominal_one(windows):
    assert fit_motor(windows, 6.0, 4.0, 0.02) == Motor(6.0, 4.0)


def test_no_slip_is_the_effective_track_1():
    assert KinematicModel(0.3, 0.5).track_ratio == 1.0
    assert math.isclose(Motor(1.0, 2.0).delay, 0.0)


def _with(windows, measured):
    from dataclasses import replace

    return replace(windows, measured=measured)
