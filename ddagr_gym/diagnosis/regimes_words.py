"""Regimes in words: "mostly at speeds above 0.6 m/s"."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

from ddagr_gym.diagnosis.regimes import RegimeShare, Unevenness
from ddagr_gym.reporting.wording import number

EVERYWHERE = "everywhere"
NOWHERE_MORE = "no motion, place or time stands out"

_MOST_OF_IT = 0.6
"""Share of the driven time from which what shows in it is said to be everywhere (ours)."""

_BACKWARDS = 0.02
"""Speed at which a range ends that means driving backwards [m/s] (ours)."""

_ONLY = 0.95
"""Share of the weight from which "only" is said instead of "mostly" (ours)."""


class Disc(Protocol):
    """A round place."""

    @property
    def x(self) -> float: ...  # noqa: D102
    @property
    def y(self) -> float: ...  # noqa: D102
    @property
    def radius(self) -> float: ...  # noqa: D102


_RANGES: dict[str, tuple[str, str]] = {
    "speed": ("at speeds", "m/s"),
    "slip": ("at slips", ""),
    "turning": ("while turning at", "rad/s"),
    "yaw_rate": ("at yaw rates", "rad/s (positive to the left)"),
    "command": ("at commands", "rad/s"),
    "command_change": ("while commands change by", "rad/s"),
    "time": ("at times", "s"),
}


def range_in_words(name: str, low: float | None, high: float | None) -> str:
    """A range of a regime, such as "at speeds above 0.6 m/s".

    Args:
        name: of the regime.
        low: None where it is open.
        high: the same.
    """
    if name == "heading" and low is not None and high is not None:
        ends = [f"{math.degrees(end):.0f}".replace("-", "−") for end in (low, high)]
        return f"while heading between {ends[0]} and {ends[1]} degrees"
    if name == "speed" and low is None and high is not None and abs(high) < _BACKWARDS:
        return "while driving backwards"
    words, unit = _RANGES[name]
    after = f" {unit}" if unit else ""
    if low is None and high is None:
        return EVERYWHERE
    if low is None:
        return f"{words} below {number(high or 0.0)}{after}"
    if high is None:
        return f"{words} above {number(low)}{after}"
    return f"{words} between {number(low)} and {number(high)}{after}"


def phrase_of(lying: Sequence[RegimeShare], fitted: Sequence[Disc] = (), covered: float = 0.0) -> str:
    """What stands out, in words.

    Args:
        lying: how the weight lies over the regimes, what stands out first.
        fitted: place of an effect that is bound to one.
        covered: share of the driven time in which it shows.
    """
    if fitted:
        place = fitted[0]
        return f"within {number(place.radius)} m of ({number(place.x)}, {number(place.y)}) m"
    if not lying or not lying[0].stands_out:
        return EVERYWHERE if covered >= _MOST_OF_IT else NOWHERE_MORE
    first = lying[0]
    degree = "only" if first.weight_inside >= _ONLY else "mostly"
    if first.name == "place":
        x, y, radius = first.edges
        where = f"within {number(radius)} m of ({number(x)}, {number(y)}) m"
    else:
        where = range_in_words(first.name, first.low, first.high)
    inside = min(round(100.0 * first.weight_inside), 100)
    return f"{degree} {where} ({inside} % of it in {100.0 * first.time_inside:.0f} % of the time)"


def uneven_phrase(other: Unevenness) -> str:
    """That a fitted effect is not of one size."""
    where = range_in_words(other.name, other.low, other.high)
    inside, outside = number(other.size_inside), number(other.size_outside)
    return f"its size is not the same everywhere: {inside} of the fitted one {where}, {outside} elsewhere"
