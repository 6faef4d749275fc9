"""Predictions and residuals along drives, however their windows are cut and compared."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from ddagr_gym.identification.gauss_newton import fit
from ddagr_gym.identification.misfit import channel_misfit
from ddagr_gym.identification.relative_readings import relative_windows
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.presets import get_robot
from ddagr_gym.viewers.drive_traces import drive_traces
from tests.diagnosis.change.conftest import WEIGHING
from tests.viewers.conftest import CLOCK


def test_readings_that_are_compared_relative_to_each_other(answered):
    """As against ordinary drives of a calibration: predictions are of the readings, residuals of what is compared."""
    windows, robot = answered.problem.blocked.windows, get_robot("ddagr")
    problem = answered.problem.on(relative_windows(windows, WEIGHING.sigma, robot.outer_radius, 0.1))
    fitted = fit(problem, iterations=1)
    first, second = drive_traces(problem, fitted, fitted, answered.recordings)
    misfit = channel_misfit(problem, fitted)
    for k, name in enumerate(CHANNELS):
        values = np.concatenate([drive.residuals["corrected"][:, k] for drive in (first, second)])
        assert np.nanmean(values**2) == pytest.approx(misfit[name], rel=1e-6)
    whole = windows.recording == 0
    assert first.predictions["corrected"].reshape(fitted.prediction[whole].shape) == pytest.approx(
        fitted.prediction[whole]
    )
    assert (np.diff(first.time) > 0.0).all()
    recording = answered.recordings[0]
    rows = np.searchsorted(recording.t, first.time - 1e-6)
    assert first.measured[:, 2] == pytest.approx(recording["yaw_rate"][rows])


def test_headings_of_all_are_within_a_turn(answered):
    """A receiver that counts from -pi to pi against a model that counts on: no difference of whole turns is shown."""
    around = dataclasses.replace(
        answered.corrected, prediction=answered.corrected.prediction + 2.0 * np.pi * (np.arange(8) == 7)
    )
    first, _ = drive_traces(answered.problem, around, answered.corrected, answered.recordings)
    plain, _ = drive_traces(answered.problem, answered.corrected, answered.corrected, answered.recordings)
    assert first.predictions["refitted"] == pytest.approx(plain.predictions["refitted"], abs=1e-9)


def test_a_clock_that_no_viewer_shows_begins_at_nothing(answered):
    def stamp(clock):
        drive = answered.recordings[0].with_meta(start_time=clock)
        return drive_traces(answered.problem, answered.refitted, answered.refitted, [drive])[0].stamp

    assert stamp(CLOCK) == CLOCK
    assert stamp(-5.0) == 0.0
    assert stamp(1e300) == 0.0
