"""How much the sizes of effects differ between ordinary drives, as measured in pairs of simulated ones.

``python -m benchmarks.simulated_pairs`` drives pairs of worlds that differ in structure, scans both drives of each with
the robot of the first one, and fits to the differences d of a size in multiples of the least that matters

    d/sqrt(V_1 + V_2 + B_1 + B_2 + 2 F^2) ~ t(d0)                                                                  (1)

with what each drive knows, V, what robot and soil are expected to do, B, and the scatter F of each effect; degrees of
freedom d0 are the most with which no more than 5 % of the pairs raise an alarm over the whole library.
``python -m benchmarks.independent_pairs`` does the same on one ground with another simulator and other manoeuvres, and
measures how far parameters move and what is left of the channels; the larger scatter of the two counts, and the fewer
degrees of freedom.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from ddagr_gym.diagnosis.change.expected_scatter import ExpectedScatter
from ddagr_gym.files import read_json

PATH = Path(__file__).resolve().parents[2] / "data" / "change_scatter.json"
"""That the package ships."""


@dataclass(frozen=True)
class MeasuredScatter:
    """Scatter between ordinary drives.

    Attributes:
        same_ground: between drives on one ground.
        other_ground: between drives on two grounds.
    """

    same_ground: ExpectedScatter
    other_ground: ExpectedScatter


@cache
def measured_scatter(path: Path = PATH) -> MeasuredScatter:
    """What a file says, by default that of the package.

    Raises:
        InputError: the file cannot be read, or is no JSON.
    """
    body = read_json(path, remedy="make it with `python -m benchmarks.simulated_pairs`")
    same, other = (
        ExpectedScatter(
            _numbers(body[name]["deviations"]),
            float(body[name]["degrees"]),
            _numbers(body[name].get("moves", {})),
            _numbers(body[name].get("rises", {})),
        )
        for name in ("same_ground", "other_ground")
    )
    return MeasuredScatter(same, other)


def _numbers(mapping: Mapping[str, Any]) -> dict[str, float]:
    return {str(name): float(value) for name, value in mapping.items()}
