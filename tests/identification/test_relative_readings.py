"""Readings relative to the robot's other sensors: what all have in common drops out, contradictions stay."""

import numpy as np
import pytest

from ddagr_gym.identification.block_means import sample_windows
from ddagr_gym.identification.relative_readings import relative_windows, usual_turning
from ddagr_gym.identification.windows import CHANNELS, WindowSet

WINDOWS, SAMPLES, PERIOD, RADIUS = 3, 81, 0.05, 0.3
TURNING = 0.2
YAW, GYRO, SIDEWAYS = (CHANNELS.index(name) for name in ("pose_yaw", "yaw_rate", "specific_force_y"))
PLACE = [CHANNELS.index("pose_x"), CHANNELS.index("pose_y")]


def integral(values):
    """By trapezoids from 0 on."""
    steps = 0.5 * PERIOD * (values[:, 1:] + values[:, :-1])
    return np.concatenate([np.zeros((len(values), 1)), np.cumsum(steps, axis=1)], axis=1)


def driven(yaw_rate, start=0.4):
    """Readings (W, T, 8) of a robot that goes 3 m/s by its wheels and turns at a rate (W, T)."""
    found = np.zeros((*yaw_rate.shape, len(CHANNELS)))
    turned = integral(yaw_rate)
    speed = np.full(yaw_rate.shape, 3.0)
    found[..., CHANNELS.index("encoder_right")] = 10.0 + 0.5
    found[..., CHANNELS.index("encoder_left")] = 10.0 - 0.5
    found[..., GYRO] = yaw_rate
    found[..., SIDEWAYS] = speed * yaw_rate
    found[..., YAW] = start + turned
    found[..., PLACE[0]] = 5.0 + integral(speed * np.cos(start + turned))
    found[..., PLACE[1]] = -2.0 + integral(speed * np.sin(start + turned))
    return found


def windows_of(measured):
    count, samples, _ = measured.shape
    return WindowSet(
        PERIOD, np.zeros(count, dtype=np.int64), np.arange(count), np.arange(count) * 10.0,
        np.zeros((count, samples, 2)), 0, measured, np.zeros((count, 8)),
    )  # fmt: skip


@pytest.fixture
def rate():
    t = np.arange(SAMPLES) * PERIOD
    return np.stack([0.6 * np.sin(0.8 * t + phase) for phase in range(WINDOWS)])


def relative(measured):
    return relative_windows(windows_of(measured), np.ones(8), RADIUS, TURNING)


def test_an_error_that_all_sensors_share_drops_out_of_heading_place_and_sideways(rate):
    """The model turns too little: gyro, heading, place and lateral force are all off, and agree with each other."""
    measured, predicted = driven(1.3 * rate), driven(rate)
    found = relative(measured).differences(predicted)
    plain = sample_windows(windows_of(measured), np.ones(8)).residual(predicted).reshape(found.shape)
    for channel in (YAW, *PLACE, SIDEWAYS):
        assert np.abs(plain[..., channel]).max() > 0.15
        assert np.abs(found[..., channel]).max() < 1e-3
    np.testing.assert_allclose(found[..., GYRO], 0.3 * rate, atol=1e-12)


def test_two_sensors_that_contradict_each_other_stay(rate):
    """A gyro that reads a tenth too much: the heading is off by a tenth of the angle."""
    measured = driven(rate)
    measured[..., GYRO] *= 1.1
    found = relative(measured).differences(driven(rate))
    np.testing.assert_allclose(found[..., YAW], -0.1 * integral(rate), atol=1e-12)


def test_scaled_encoders_show_in_the_place_and_in_the_turning(rate):
    measured = driven(rate)
    measured[..., [CHANNELS.index("encoder_right"), CHANNELS.index("encoder_left")]] *= 1.1
    found = relative(measured).differences(driven(rate))
    way = np.hypot(*np.moveaxis(found[:, -1][:, PLACE], 1, 0))
    assert np.all(way > 0.9)
    assert np.all(way < 1.2)
    np.testing.assert_allclose(found[..., GYRO], -TURNING * 0.1, atol=1e-12)


def test_readings_that_come_seldom_are_filled_alike_in_both(rate):
    measured = driven(rate)
    rows = np.arange(SAMPLES)
    for name in ("encoder_right", "encoder_left"):
        measured[:, rows % 5 != 2, CHANNELS.index(name)] = np.nan
    measured[:, rows % 7 != 3, YAW] = np.nan
    found = relative(measured)
    np.testing.assert_allclose(found.residual(driven(rate)), 0.0, atol=1e-9)
    assert found.mask.reshape(found.sigma.shape)[..., YAW].sum() == np.isfinite(measured[..., YAW]).sum()


def test_windows_without_a_gyro_compare_headings_as_they_are(rate):
    measured = driven(rate)
    measured[..., GYRO] = np.nan
    found = relative(measured).differences(driven(0.5 * rate))
    np.testing.assert_allclose(found[..., YAW], 0.5 * integral(rate), atol=1e-9)


def test_a_derivative_is_the_change_by_a_small_step(rate):
    windows, base = relative(driven(1.2 * rate)), driven(rate)
    rng = np.random.default_rng(0)
    changes = rng.normal(size=(*base.shape, 2))
    found = windows.derivative(changes, base)
    for k in range(2):
        small = windows.change(base + 1e-3 * changes[..., k], base - 1e-3 * changes[..., k]) / 2e-3
        np.testing.assert_allclose(found[..., k], small, atol=2e-3 * np.abs(small).max())
    bent = windows.residual(base) - windows.residual(base + 1e-3 * changes[..., 0])
    np.testing.assert_allclose(1e-3 * found[..., 0], bent, atol=1e-4)


def test_chosen_windows_are_the_same_alone(rate):
    windows, base = relative(driven(1.2 * rate)), driven(rate)
    chosen = np.array([False, True, True])
    np.testing.assert_array_equal(windows.subset(chosen).residual(base[chosen]), windows.residual(base)[chosen])


def test_usual_turning_is_the_slope_of_the_yaw_rate(rate):
    measured = driven(rate)
    measured[..., CHANNELS.index("encoder_right")] = 10.0 + rate / 0.3
    measured[..., CHANNELS.index("encoder_left")] = 10.0 - rate / 0.3
    assert usual_turning(windows_of(measured)) == pytest.approx(0.15, rel=1e-9)
    still = np.zeros_like(measured)
    assert usual_turning(windows_of(still)) == 0.0
