"""Where the joint fit begins."""

from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.calibration.fit_starts import LEAST_TURNING, _turning_start, held_turning, size_of
from ddagr_gym.calibration.parts import complete_robot
from ddagr_gym.identification.residual_weights import Weights
from ddagr_gym.presets import get_robot


def repeated(right: np.ndarray, left: np.ndarray) -> np.ndarray:
    """(1, T, 2) readings of which the right ones come at even samples and the left ones at odd samples."""
    rows = np.arange(len(right))
    return np.where(np.column_stack([rows % 2 == 0, rows % 2 == 1]), np.column_stack([right, left]), np.nan)[None]


def test_banks_that_are_never_read_together_still_turn():
    right, left = np.full(40, 6.0), np.full(40, -2.0)
    turning = held_turning(repeated(right, left))
    assert np.isnan(turning[0, 0])
    assert np.allclose(turning[0, 1:], 4.0)


def test_a_reading_is_held_in_its_own_window_only():
    speeds = np.concatenate([repeated(np.full(4, 6.0), np.full(4, -2.0)), np.full((1, 4, 2), np.nan)])
    assert np.isnan(held_turning(speeds)[1]).all()


@pytest.mark.parametrize("share", [0.5, 1.0])
def test_the_limit_starts_at_the_fastest_turning_of_repeated_readings(share):
    robot = get_robot("warthog")
    fastest = share * complete_robot(robot).drivetrain.turning_limit
    speeds = repeated(np.full(200, fastest), np.full(200, -fastest))
    assert _turning_start(robot, speeds) == pytest.approx(np.log(share))


def test_a_drive_that_hardly_turns_starts_at_a_share_of_a_likely_limit():
    robot = get_robot("warthog")
    assert _turning_start(robot, repeated(np.full(200, 5.0), np.full(200, 5.0))) == pytest.approx(np.log(LEAST_TURNING))
    assert _turning_start(robot, np.full((1, 200, 2), np.nan)) == 0.0


def test_what_a_start_leaves_is_the_mean_logarithm_of_all_channels_that_count():
    sigma = np.array([[[0.5, 2.0, np.inf]], [[0.5, 8.0, np.inf]]])
    assert size_of(Weights(sigma, np.ones(3))) == pytest.approx(np.log(0.5 * 2.0 * 0.5 * 8.0) / 4.0)
