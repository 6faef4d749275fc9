"""Ranges for randomisation: what carries over of many draws of a corrected simulator."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

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
        name: field of :class:`~ddagr_gym.exporting.carried_over.CarriedOver`.
        value: as found; infinite for no limit, NaN where there is none.
        low: below which 5 % of the draws are.
        high: above which 5 % are.
        distribution: normal, or fixed where no draw differs.
        draws: that have the quantity.
        unit: of the numbers.
        group: that it belongs to.
        meaning: in words.
        source: where value and range come from.
    """

    name: str
    value: float
    low: float
    high: float
    distribution: str
    draws: int
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
) -> tuple[Range, ...]:
    """Ranges of all quantities.

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
    return tuple(_range(name, found, drawn, corrected.spread) for name in (item.name for item in quantities()))


def _range(name: str, found: CarriedOver, drawn: list[CarriedOver], spread: str) -> Range:
    value = float(getattr(found, name))
    known = [number for item in drawn if math.isfinite(number := float(getattr(item, name)))]
    tail = (100 - SHARE) / 2
    low, high = map(float, np.percentile(known, [tail, 100 - tail])) if known else (value, value)
    fixed = not math.isfinite(value) or high - low <= _EXACT * max(abs(value), _EXACT)
    data = next(item.metadata for item in quantities() if item.name == name)
    source = data["how"] if fixed else f"{data['how']}; range: {spread}"
    return Range(
        name, value, value if fixed else low, value if fixed else high, "fixed" if fixed else "normal", len(known),
        data["unit"], data["group"], data["meaning"], source,
    )  # fmt: skip
