"""Efforts and simulators that are small enough for a test."""

import pytest

from ddagr_gym.adaptation.corrected import Corrected
from ddagr_gym.adaptation.run import Effort
from ddagr_gym.physics.effects import load_effects
from ddagr_gym.presets import ddagr, get_soil


@pytest.fixture
def little() -> Effort:
    """A few turns of everything."""
    return Effort(rounds=2, taught=2, stages=((2, 1),), selection=2, report=2)


@pytest.fixture
def on_a_slope() -> Corrected:
    """The data sheet's robot and soil on a slope, named with its interval."""
    return Corrected(
        ddagr(),
        get_soil("thesis_a1"),
        load_effects(["slope=0.05"]),
        ({"angle": (0.045, 0.055)},),
        ("slope",),
        sentence="The ground slopes.",
    )
