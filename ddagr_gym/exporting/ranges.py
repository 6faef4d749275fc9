"""Ranges for randomisation: what carries over of many draws of a corrected simulator."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import Field, dataclass
from typing import Any

import numpy as np

from ddagr_gym.exporting.carried_over import CarriedOver, measured, quantities
from ddagr_gym.exporting.corrected import Corrected
from ddagr_gym.exporting.working_point import LEFT_TURN, RIGHT_TURN, STRAIGHT, check_commands, steady_drives
from ddagr_gym.progress import counting

SHARE = 90
"""Of the draws that a range holds [%]."""

_EXACT = 1e-9
"""Relative width below which a range is none."""


@dataclass(frozen=True)
class Range:
    """A quantity with its range.

    Attributes:
        value: as found; None for no limit, or where there is none.
        low: below which 5 % of the draws are; the value where it is fixed.
        high: above which 5 % are; likewise.
        distribution: normal, or fixed where no draw differs.
        unit: of the numbers.
        group: that it belongs to.
        meaning: in words.
        source: where value and range come from.
    """

    value: float | None
    low: float | None
    high: float | None
    distribution: str
    unit: str
    group: str
    meaning: str
    source: str


def ranges_of(
    corrected: Corrected,
    found: CarriedOver,
    speed: float,
    *,
    draws: int,
    seed: int,
    progress: Callable[[str], None] | None = None,
) -> dict[str, Range]:
    """Ranges of all quantities, by their field of :class:`~ddagr_gym.exporting.carried_over.CarriedOver`.

    Args:
        corrected: to draw from.
        found: its own numbers.
        speed: mean bank speed of the working point [rad/s].
        draws: number of draws.
        seed: of the draws.
        progress: called with a line of text from time to time.
    """
    rng = np.random.default_rng(seed)
    commands = check_commands(speed)[[STRAIGHT, LEFT_TURN, RIGHT_TURN]]
    drawn = []
    with counting(draws, "draws", progress) as counter:
        for _ in range(draws):
            simulated = corrected.draw(rng)
            drawn.append(measured(simulated, steady_drives(simulated, commands)))
            counter.advance()
    return {item.name: _range(item, found, drawn, corrected.spread) for item in quantities()}


def _range(item: Field[Any], found: CarriedOver, drawn: list[CarriedOver], spread: str) -> Range:
    value = float(getattr(found, item.name))
    known = [number for draw in drawn if math.isfinite(number := float(getattr(draw, item.name)))]
    tail = (100 - SHARE) / 2
    low, high = map(float, np.percentile(known, [tail, 100 - tail])) if known else (value, value)
    unit, group, meaning, how = (item.metadata[key] for key in ("unit", "group", "meaning", "how"))
    if not math.isfinite(value):
        return Range(None, None, None, "fixed", unit, group, meaning, how)
    if high - low <= _EXACT * max(abs(value), _EXACT):
        return Range(value, value, value, "fixed", unit, group, meaning, how)
    return Range(value, low, high, "normal", unit, group, meaning, f"{how}; range: {spread}")
