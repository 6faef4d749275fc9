"""Signals that several checks share, near the ends of what a sensor has read."""

from __future__ import annotations

import numpy as np

from ddagr_gym.recordings.checks.regression import sampled
from ddagr_gym.recordings.checks.signals import LONGEST_AGE, filled, integral, smoothed
from ddagr_gym.recordings.schema import Recording

T = np.arange(0.0, 20.0, 0.05)


def read_between(first: float, last: float, every: float = 0.5) -> Recording:
    """A bank that turns at 2 rad/s, read seldom and for a part of the drive."""
    rows = (np.abs(T / every - np.round(T / every)) < 1e-6) & (first <= T) & (last >= T)
    return Recording.from_columns({"t": T, "encoder_right": np.where(rows, 2.0, np.nan)})


def test_a_slow_sensor_is_known_from_end_to_end():
    """Otherwise whole stretches of drives in steps would be lost to it."""
    made = read_between(0.5, 19.5)
    values = made["encoder_right"]
    np.testing.assert_allclose(integral(made, values), 2.0 * T)
    np.testing.assert_array_equal(sampled(made, slice(0, T.size), values, T), 2.0)
    assert np.isfinite(filled(made, "encoder_right")[T >= 0.5]).all()


def test_a_sensor_that_has_stopped_is_not_known():
    made = read_between(0.0, 12.0, every=0.05)
    values, gone = made["encoder_right"], T > 12.0 + LONGEST_AGE + 1e-9
    found = [integral(made, values), sampled(made, slice(0, T.size), values, T), filled(made, "encoder_right")]
    for signal in found:
        np.testing.assert_array_equal(np.isnan(signal), gone)
    assert np.isnan(smoothed(made, values, 1.0)[gone]).all()
