"""Prediction errors on windows: metrics on drives that are known, and a real drive where there is one."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from benchmarks.filter_study.real_drives import METRICS, motion_channels, prediction_errors, real_drive
from ddagr_gym.identification.windows import CHANNELS, WindowSet

REPOSITORY = Path(__file__).resolve().parents[2]


@pytest.fixture
def circle():
    """Two windows of 2 s on a circle, with a slight drift to the left, and the states that drive it."""
    period, samples, v_x, v_y, turning = 0.05, 40, 0.8, 0.1, 0.5
    t = period * np.arange(1, samples + 1)
    states = np.zeros((2, samples + 1, 12))
    states[..., 0], states[..., 1], states[..., 2] = v_x, v_y, turning
    initial = np.zeros((2, 8))
    initial[:, 2] = [0.0, 2.0]
    empty = np.full((2, samples, len(CHANNELS)), np.nan)
    windows = WindowSet(
        period, np.zeros(2, int), np.zeros(2, int), np.zeros(2), np.zeros((2, samples, 2)), 0, empty, initial
    )
    measured = np.full_like(empty, np.nan)
    measured[..., CHANNELS.index("yaw_rate")] = turning
    for w, yaw in enumerate(initial[:, 2]):
        # exact circle: the velocity (v_x, v_y) in body axes, integrated
        x = (v_x * np.sin(turning * t) - v_y * (1 - np.cos(turning * t))) / turning
        y = (v_x * (1 - np.cos(turning * t)) + v_y * np.sin(turning * t)) / turning
        measured[w, :, CHANNELS.index("pose_x")] = x * np.cos(yaw) - y * np.sin(yaw)
        measured[w, :, CHANNELS.index("pose_y")] = x * np.sin(yaw) + y * np.cos(yaw)
        measured[w, :, CHANNELS.index("pose_yaw")] = yaw + turning * t
    return WindowSet(**{**windows.__dict__, "measured": measured}), states


def test_the_true_motion_has_no_error(circle):
    windows, states = circle
    errors = prediction_errors(windows, motion_channels(windows, states))
    assert list(errors) == list(METRICS)
    for name, values in errors.items():
        np.testing.assert_allclose(values, 0.0, atol=2e-4, err_msg=name)


def test_errors_of_speed_are_told_apart(circle):
    windows, states = circle
    faster, aside = states.copy(), states.copy()
    faster[..., 0] += 0.1
    aside[..., 1] -= 0.05
    found = prediction_errors(windows, motion_channels(windows, faster))
    # over a second the chord is sin(0.25)/0.25 of the way
    np.testing.assert_allclose(found["forward_speed"], 0.1 * np.sin(0.25) / 0.25, rtol=1e-2)
    np.testing.assert_allclose(found["lateral_speed"], 0.0, atol=1e-3)
    found = prediction_errors(windows, motion_channels(windows, aside))
    np.testing.assert_allclose(found["lateral_speed"], -0.05 * np.sin(0.25) / 0.25, rtol=1e-2)
    np.testing.assert_allclose(found["forward_speed"], 0.0, atol=1e-3)
    turned = states.copy()
    turned[..., 2] += 0.1
    found = prediction_errors(windows, motion_channels(windows, turned))
    np.testing.assert_allclose(found["heading"], 0.2, rtol=1e-6)


def test_nothing_measured_gives_nothing(circle):
    windows, states = circle
    blind = WindowSet(**{**windows.__dict__, "measured": np.full_like(windows.measured, np.nan)})
    for values in prediction_errors(blind, motion_channels(blind, states)).values():
        assert np.isnan(values).all()


@pytest.mark.slow
def test_a_real_drive_on_sand():
    folder = Path(
        os.environ.get("DDAGR_RECORDINGS")
        or Path(os.environ.get("DDAGR_SHARED") or REPOSITORY.parent / "shared") / "recordings"
    )
    path = folder / "open" / "warthog_sand.csv.gz"
    if not path.is_file():
        pytest.skip(f"real drives are not at {folder}: set DDAGR_RECORDINGS to their folder")
    found = real_drive(path, "warthog", seed=0)
    assert set(found["drives"]) == {"commands", "wheel_speeds", "dead_reckoning"}
    heading = found["drives"]["wheel_speeds"]["5"]["heading"]
    assert heading["filter"]["value"] < 0.3 * heading["kinematic_no_slip"]["value"]
    assert heading["filter"]["windows"] > 100
    low, high = heading["filter_over_effective_track"]["interval"]
    assert low <= heading["filter_over_effective_track"]["value"] <= high
    assert "heading" not in found["drives"]["dead_reckoning"]["5"]
