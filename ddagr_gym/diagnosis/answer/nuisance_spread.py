"""How sure what was refitted of robot and soil is, as the answer of a diagnosis holds it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class NuisanceSpread:
    """How sure the refitted nuisances are: windows are resampled, and what is expected of each is drawn.

    Attributes:
        intervals: 90 %, by name, in the units of `nuisances`, holding the refitted value in any case.
        shared: names of those that belong to robot and soil; all others belong to a recording.
        correlation: of the resampled values of the shared ones, rows and columns in their order.
    """

    intervals: Mapping[str, tuple[float, float]]
    shared: tuple[str, ...]
    correlation: tuple[tuple[float, ...], ...]
