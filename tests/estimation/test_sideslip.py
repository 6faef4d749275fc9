"""Sideslip from the lateral accelerometer: matched simulation, consistency, invariances."""

from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.estimation.sideslip import CENTRE_AHEAD, SideslipFilter
from ddagr_gym.parameters import Imu

PERIOD = 0.08


def matched_drives(count, seed=0, turning_from=25, steps=150):
    """True delta and bias, and readings, of robots that obey the filter's own model."""
    rng, imu = np.random.default_rng(seed), Imu()
    deviation = np.hypot(imu.accelerometer_noise, imu.accelerometer_resolution / np.sqrt(12.0)) / np.sqrt(10.0)
    kept = np.exp(-PERIOD / 60.0)
    bias = 0.3 * rng.standard_normal(count)
    delta = 1e-3 * rng.standard_normal(count)
    rate = np.zeros((steps, count))
    rate[turning_from:] = 0.25
    readings, deltas, last = [], [], np.zeros(count)
    for step in range(steps):
        spread = (0.02 if step >= turning_from else 1e-3) * np.sqrt(1 - kept**2)
        moved = kept * delta + spread * rng.standard_normal(count)
        v_y_change = (moved - delta) - CENTRE_AHEAD * (rate[step] - last)
        readings.append(v_y_change / PERIOD + rate[step] * 0.2 + bias + deviation * rng.standard_normal(count))
        delta, last = moved, rate[step]
        deltas.append(delta)
    return np.array(readings), rate, np.array(deltas), bias


def run(readings, rate, turning_from=25):
    count = readings.shape[1]
    found = SideslipFilter(Imu(), 10, PERIOD, count)
    speeds = []
    for step, (lateral, yaw) in enumerate(zip(readings, rate, strict=True)):
        turning = np.full(count, step >= turning_from)
        speeds.append(found.update(np.arange(count), lateral, np.full(count, 0.2), yaw, turning))
    return found, np.array(speeds)


def test_errors_agree_with_their_covariance():
    readings, rate, deltas, bias = matched_drives(2000)
    found, speeds = run(readings, rate)
    error = np.column_stack([found.states[:, 0] - deltas[-1], found.states[:, 1] - bias])
    squared = np.einsum("ni,nij,nj->n", error, np.linalg.inv(found.covariances), error)
    # chi-square with two degrees of freedom: mean 2, standard deviation 2
    assert squared.mean() == pytest.approx(2.0, abs=4 * 2 / np.sqrt(2000))
    np.testing.assert_allclose(speeds[-1], found.states[:, 0] - CENTRE_AHEAD * rate[-1])


def test_it_knows_more_than_nothing_of_sideslip():
    readings, rate, deltas, _ = matched_drives(2000)
    _, speeds = run(readings, rate)
    change = deltas[-1] - deltas[40]
    estimated = (speeds[-1] + CENTRE_AHEAD * rate[-1]) - (speeds[40] + CENTRE_AHEAD * rate[40])
    assert np.std(change - estimated) < 0.9 * np.std(change)


def test_the_bias_is_learned_on_the_straight_and_kept():
    readings, rate, _, bias = matched_drives(500)
    straight, _ = run(readings[:25], rate[:25])
    whole, _ = run(readings, rate)
    assert np.sqrt(np.mean((straight.states[:, 1] - bias) ** 2)) < 4e-3
    assert (whole.covariances[:, 1, 1] < straight.covariances[:, 1, 1]).all()


def test_covariances_stay_symmetric_and_positive():
    readings, rate, _, _ = matched_drives(5, steps=3000)
    found, _ = run(readings, rate)
    np.testing.assert_allclose(found.covariances, np.swapaxes(found.covariances, 1, 2), rtol=1e-9)
    assert (np.linalg.eigvalsh(found.covariances) > 0.0).all()


def test_rows_do_not_depend_on_each_other_and_forget():
    readings, rate, _, _ = matched_drives(3)
    together, speeds = run(readings, rate)
    alone, single = run(readings[:, 1:2], rate[:, 1:2])
    np.testing.assert_allclose(speeds[:, 1:2], single, rtol=1e-9, atol=1e-15)
    together.reset(np.array([1]))
    fresh = SideslipFilter(Imu(), 10, PERIOD, 1)
    np.testing.assert_array_equal(together.states[1], fresh.states[0])
    np.testing.assert_array_equal(together.covariances[1], fresh.covariances[0])
    np.testing.assert_allclose(together.states[0], run(readings[:, :1], rate[:, :1])[0].states[0], rtol=1e-9)
    assert (alone.states[0] != fresh.states[0]).all()


def test_mirrored_readings_give_mirrored_sideslip():
    readings, rate, _, _ = matched_drives(4)
    _, left = run(readings, rate)
    _, right = run(-readings, -rate)
    np.testing.assert_allclose(left, -right, atol=1e-15)
