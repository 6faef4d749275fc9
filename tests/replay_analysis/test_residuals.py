from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.identification.residual_weights import residuals, successive_correlation
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.replay_analysis.residuals import BIN_QUANTITIES, bin_values, binned_residuals, channel_residuals

GYRO, YAW = CHANNELS.index("yaw_rate"), CHANNELS.index("pose_yaw")


def test_residuals_are_measurement_less_prediction_on_the_circle(make_windows):
    windows = make_windows(np.zeros((1, 24, 2)))
    windows.measured[..., GYRO], windows.measured[..., YAW] = 0.3, np.pi - 0.1
    prediction = np.zeros_like(windows.measured)
    prediction[..., YAW] = -np.pi + 0.1
    found = residuals(windows, prediction)
    np.testing.assert_allclose(found[..., GYRO], 0.3)
    np.testing.assert_allclose(found[..., YAW], -0.2)
    assert np.isnan(found[..., 0]).all()


def test_the_table_has_size_bias_and_share_of_the_noise():
    rng = np.random.default_rng(0)
    residual = np.full((50, 40, 8), np.nan)
    residual[..., GYRO] = 0.1 + rng.normal(0.0, 0.2, (50, 40))
    residual[..., 3] = 1.0
    (row,) = channel_residuals(residual, np.full(8, 0.05), left_out=("encoder_right",))
    assert (row.channel, row.unit, row.count) == ("yaw_rate", "rad/s", 2000)
    assert row.bias == pytest.approx(0.1, abs=0.02)
    assert row.rms == pytest.approx(np.hypot(0.1, 0.2), rel=0.05)
    assert row.relative == pytest.approx(row.rms / 0.05)


def test_correlation_of_a_first_order_process():
    rng = np.random.default_rng(1)
    values = np.zeros((40, 500))
    for k in range(1, 500):
        values[:, k] = 0.7 * values[:, k - 1] + rng.normal(0.0, 1.0, 40)
    assert successive_correlation(values) == pytest.approx(0.7, abs=0.03)
    assert successive_correlation(np.full((2, 5), np.nan)) == 0.0


@pytest.fixture(scope="module")
def dependent(make_windows):
    """Residuals of the gyro that grow with the predicted yaw rate, and nothing else."""
    rng = np.random.default_rng(2)
    windows = replace(make_windows(np.zeros((60, 60, 2))), measured=np.zeros((60, 40, 8)))
    record = rng.uniform(-1.0, 1.0, (60, 40, 7))
    residual = np.zeros((60, 40, 8))
    residual[..., GYRO] = 0.5 * record[..., 4] + rng.normal(0.0, 0.05, (60, 40))
    return windows, record, residual


def test_a_residual_that_depends_on_the_yaw_rate_shows_it(dependent):
    windows, record, residual = dependent
    values = bin_values(windows, record)
    assert set(values) == set(BIN_QUANTITIES)
    found = {(r.channel, r.against): r for r in binned_residuals(residual, values, left_out=("encoder_left",))}
    rate = found["yaw_rate", "yaw_rate"]
    np.testing.assert_allclose(rate.means, 0.5 * np.array(rate.centres), atol=0.02)
    speed = found["yaw_rate", "speed"]
    assert np.abs(speed.means).max() < 5.0 * max(speed.deviations)
    assert sum(rate.counts) == residual[..., 0].size
    assert not any(channel in ("encoder_left", "pose_x") for channel, _ in found)


def test_samples_of_one_window_count_as_one_in_the_standard_error(dependent):
    windows, record, _ = dependent
    level = np.random.default_rng(3).normal(0.0, 1.0, 60)
    residual = np.zeros((60, 40, 8))
    residual[..., GYRO] = level[:, None]
    found = binned_residuals(residual, bin_values(windows, record))
    bins = next(r for r in found if (r.channel, r.against) == ("yaw_rate", "slip"))
    # every bin holds about three samples of each window: its mean is as sure as a mean of 60, not of 200 values
    assert np.mean(bins.deviations) == pytest.approx(1.0 / np.sqrt(60.0), rel=0.25)


def test_heading_is_left_out_without_poses(dependent):
    windows, record, residual = dependent
    blind = replace(windows, measured=np.full_like(windows.measured, np.nan))
    assert not any(r.against == "heading" for r in binned_residuals(residual, bin_values(blind, record)))
