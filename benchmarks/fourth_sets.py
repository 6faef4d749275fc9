"""The path tracker by a network that learnt on with worse sensors and motors, on a fourth drawing of sets and plants.

    python -m benchmarks.fourth_sets FOLDER [--workers 2]

Drives :data:`CONTROLLERS` on S1d to S8d, Td and the sets named ``on_``, a plant and ``_d`` (about an hour of two
cores; started again with the same folder, it goes on), checks ``configs/evaluation/fourth_claims.yaml``, and writes
``benchmarks/results/fourth_sets.json`` and a picture beside it. Turns that no upper bound makes are left out.

The rule for the default is that of :mod:`benchmarks.second_sets`, with B6_pose as the former default and S1d as the set
in range. Claims and rule were committed before anything had driven these sets.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from benchmarks.scenario_sets import FOURTH, ON_PLANTS_FOURTH
from benchmarks.second_sets import Reading
from benchmarks.second_sets import main as read

CONTROLLERS = ("B1", "B4", "B6", "B6_pose", "B6_pose_wide", "true_path")

READING = Reading(
    "python -m benchmarks.fourth_sets FOLDER", (*FOURTH, *ON_PLANTS_FOURTH), "S1d", CONTROLLERS, "B6_pose",
    "fourth_claims.yaml", Path(__file__).resolve().parent / "results" / "fourth_sets.json", ("B6",),
)  # fmt: skip
"""Of the fourth drawing."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Drive, check, choose, write."""
    return read(arguments, READING, __doc__)


if __name__ == "__main__":
    raise SystemExit(main())
