"""Effects drawn anew, as uncertain as they were estimated."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields

import numpy as np

from ddagr_gym.physics.effects.base import Effect

DEVIATIONS_OF_AN_INTERVAL = 3.29
"""Width of an interval of 90 % of a normal distribution, in its standard deviations."""


def draw_sizes(
    effect: Effect,
    intervals: Mapping[str, tuple[float, float]],
    rng: np.random.Generator,
    most: float = math.inf,
    inside: bool = False,
) -> Effect:
    """An effect with each estimated parameter drawn from a normal distribution about its estimate, inside its bounds.

    One number is drawn for each interval, in the order of the effect's parameters.

    Args:
        effect: at its estimates.
        intervals: of 90 %, low and high by parameter; the others stay.
        rng: of the draws.
        most: standard deviations at which a draw is cut off.
        inside: cut draws off at the ends of their intervals too.
    """
    drawn = {}
    for item in fields(effect):
        if item.name not in intervals:
            continue
        low, high = intervals[item.name]
        deviation = (high - low) / DEVIATIONS_OF_AN_INTERVAL
        value = getattr(effect, item.name) + deviation * float(np.clip(rng.standard_normal(), -most, most))
        bounds = item.metadata["low"], item.metadata["high"]
        least, largest = (max(low, bounds[0]), min(high, bounds[1])) if inside else bounds
        drawn[item.name] = float(min(max(value, least), largest))
    return effect.with_values(**drawn)
