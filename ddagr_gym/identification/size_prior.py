"""How large effects are before any data: an effect worth naming is some times its least meaningful size.

Without it two effects with the same traces (a tilted and a biased accelerometer) tie whatever sizes they need, and a
direction that the data hardly see is blown up until it explains noise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from ddagr_gym.physics.effects import Effect

TYPICAL_MULTIPLE = 5.0
"""Standard deviation of a size in least meaningful sizes (ours: effects of 2 to 10 times are worth a diagnosis)."""


def size_scale(effect: Effect | type[Effect], name: str) -> float:
    """Standard deviation of a size about neutral, in its unit (theory: identification, eq. (5))."""
    return TYPICAL_MULTIPLE * float(effect.parameter(name).metadata["least"])


def size_penalty(effects: Sequence[Effect]) -> float:
    """Cost of the sizes of effects: half the sum of squares over their standard deviations.

    Categorical effects and those whose neutral is a limit out of reach (motor saturation) cost nothing.
    """
    total = 0.0
    for effect in effects:
        if effect.categorical or not effect.differentiable:
            continue
        for name in effect.size_names():
            away = getattr(effect, name) - effect.parameter(name).metadata["neutral"]
            total += 0.5 * (away / size_scale(effect, name)) ** 2
    return total


_SPREAD = 0.7
"""Standard deviation of the logarithm of a size about the typical one (ours: most are 2 to 15 times the least)."""


def implausibility(effect: Effect) -> float:
    """Half the square of how far a size is from a typical one, on a logarithmic scale; it settles ties only.

    A biased and a tilted accelerometer leave the same traces: 0.1 m/s^2 is an ordinary bias and hardly a tilt, 0.5
    m/s^2 an ordinary tilt and hardly a bias. Below the least meaningful size nobody would care about either, so that
    all such sizes are equally unusual: else ever smaller ones would drive out what fits better.
    """
    if effect.categorical or not effect.differentiable:
        return 0.0
    multiples = [
        (getattr(effect, name) - data["neutral"]) / data["least"]
        for name in effect.size_names()
        for data in (effect.parameter(name).metadata,)
    ]
    size = math.sqrt(sum(multiple**2 for multiple in multiples))
    return 0.5 * (math.log(max(size, 1.0) / TYPICAL_MULTIPLE) / _SPREAD) ** 2
