"""Sizes of what changed, as they are said."""

import math

import numpy as np
import pytest

from ddagr_gym.diagnosis.change.conclusion import _size_shifts, _that_exists
from ddagr_gym.diagnosis.change.drive_scan import Compared
from ddagr_gym.diagnosis.change.shifts import Shift
from ddagr_gym.diagnosis.search.candidates import candidates_of
from ddagr_gym.physics.effects.base import DriveExtent
from ddagr_gym.physics.effects.gyro_bias import GyroBias
from ddagr_gym.physics.effects.soil_change import SoilChange


def test_a_size_stays_inside_what_exists():
    """A soil cannot be softer by more than the whole of it."""
    said = _that_exists(SoilChange(0.5, 0.3), "stiffness", -0.6, 2.6)
    low = SoilChange.parameter("stiffness").metadata["low"]
    assert (said.value, said.interval) == (low, (low, 2.0))
    assert _that_exists(GyroBias(0.02), "bias", 0.021, 0.004).interval == (0.017, 0.025)


def test_a_size_of_which_nothing_is_known_has_no_interval():
    said = _that_exists(SoilChange(0.5, 0.3), "strength", 0.5, math.nan)
    assert (said.value, said.interval, said.unit) == (0.5, None, "-")


def test_what_a_first_step_shows_in_part_must_be_larger_to_be_found():
    bias = Compared(candidates_of(GyroBias, DriveExtent(), 0)[0], ("gyro_bias 0",))
    one = np.eye(1)
    shift = Shift(bias, 2.0 * one[0], 0.0 * one[0], one, 0.5 * one, 8.0, 0.1, 8.0, 8.0)
    usual, partly = (_size_shifts(shift, 40, farther)["bias"] for farther in (1.0, 3.0))
    assert partly.least_detectable == pytest.approx(3.0 * usual.least_detectable)
    # nothing beyond what exists is said to be found
    assert _size_shifts(shift, 40, 1e6)["bias"].least_detectable is None
