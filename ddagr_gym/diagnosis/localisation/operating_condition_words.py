"""Operating conditions in words: "mostly at speeds above 0.6 m/s"."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from ddagr_gym.diagnosis.answer.amounts import number
from ddagr_gym.diagnosis.answer.location import OperatingConditionShare, Unevenness
from ddagr_gym.diagnosis.wording import EVERYWHERE, range_in_words

NOWHERE_MORE = "no motion, place or time stands out"

_MOST_OF_IT = 0.6
"""Share of the driven time from which what shows in it is said to be everywhere (ours)."""

_ONLY = 0.95
"""Share of the weight from which "only" is said instead of "mostly", which means more than half (ours)."""


class Patch(Protocol):
    """A disc, or a band with round ends."""

    @property
    def x(self) -> float: ...  # noqa: D102
    @property
    def y(self) -> float: ...  # noqa: D102
    @property
    def radius(self) -> float: ...  # noqa: D102
    @property
    def half_length(self) -> float: ...  # noqa: D102


def phrase_of(lying: Sequence[OperatingConditionShare], fitted: Sequence[Patch] = (), covered: float = 0.0) -> str:
    """What stands out, in words.

    Args:
        lying: how the weight lies over the operating conditions, what stands out first.
        fitted: place of an effect that is bound to one.
        covered: share of the driven time in which it shows.
    """
    if fitted:
        place = fitted[0]
        where = f"({number(place.x)}, {number(place.y)}) m"
        of = f"the middle line of a band through {where}" if place.half_length > 0.0 else where
        return f"within {number(place.radius)} m of {of}"
    if not lying or not lying[0].stands_out:
        return EVERYWHERE if covered >= _MOST_OF_IT else NOWHERE_MORE
    first = lying[0]
    degree = "only" if first.weight_inside >= _ONLY else "mostly" if first.weight_inside > 0.5 else "above all"
    if first.name == "place":
        x, y, radius = first.edges
        where = f"within {number(radius)} m of ({number(x)}, {number(y)}) m"
    else:
        where = range_in_words(first.name, first.low, first.high)
    inside = min(round(100.0 * first.weight_inside), 100)
    return f"{degree} {where} ({inside} % of it in {100.0 * first.time_inside:.0f} % of the time)"


def uneven_phrase(other: Unevenness, whose: str = "its size") -> str:
    """That a fitted effect is not of one size.

    Args:
        other: where it differs.
        whose: subject of the sentence.
    """
    where = range_in_words(other.name, other.low, other.high)
    inside, outside = number(other.size_inside), number(other.size_outside)
    return f"{whose} is not the same everywhere: {inside} of the fitted one {where}, {outside} elsewhere"
