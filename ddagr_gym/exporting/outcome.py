"""All that an export came to, as its page and the command show it."""

from __future__ import annotations

from dataclasses import dataclass

from ddagr_gym.exporting.carried_over import CarriedOver
from ddagr_gym.exporting.comparison import Comparison
from ddagr_gym.exporting.corrected import Corrected
from ddagr_gym.exporting.ranges import Range


@dataclass(frozen=True)
class Outcome:
    """What carries over of a corrected simulator, its ranges, the comparison, and the files.

    Attributes:
        to: format.
        corrected: what was exported.
        working_point: mean bank speed at which slip was measured [rad/s].
        carried_over: numbers.
        comparison: drives in our simulator and in the other one; in the kinematic model where the other did not run.
        ranges: of all numbers, by name.
        draws: that the ranges come from.
        seed: of the draws.
        files: text by name.
    """

    to: str
    corrected: Corrected
    working_point: float
    carried_over: CarriedOver
    comparison: Comparison
    ranges: dict[str, Range]
    draws: int
    seed: int
    files: dict[str, str]
