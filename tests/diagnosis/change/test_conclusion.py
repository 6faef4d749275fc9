"""Sizes of what changed, as they are said."""

import math

from ddagr_gym.diagnosis.change.conclusion import _that_exists
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
