"""The path tracker with a network that corrects its filter, on a third drawing of the scenario sets and plants.

    python -m benchmarks.third_sets FOLDER [--workers 2]

Drives :data:`CONTROLLERS` on S1c to S8c, Tc and the sets named ``on_``, a plant and ``_c`` (50 minutes of two cores;
started again with the same folder, it goes on), checks ``configs/evaluation/third_claims.yaml``, and writes
``benchmarks/results/third_sets.json`` and a picture beside it. Turns that no upper bound makes are left out.

The rule for the default is that of :mod:`benchmarks.second_sets`, with B6 as the former default and S1c as the set in
range. Claims and rule were committed before anything had driven these sets.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from benchmarks.scenario_sets import ON_PLANTS_AGAIN, THIRD
from benchmarks.second_sets import Reading
from benchmarks.second_sets import main as read

CONTROLLERS = ("B1", "B4", "B6", "B6_learned", "B6_pose", "true_path")

READING = Reading(
    "python -m benchmarks.third_sets FOLDER", (*THIRD, *ON_PLANTS_AGAIN), "S1c", CONTROLLERS, "B6",
    "third_claims.yaml", Path(__file__).resolve().parent / "results" / "third_sets.json",
)  # fmt: skip
"""Of the third drawing."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Drive, check, choose, write."""
    return read(arguments, READING, __doc__)


if __name__ == "__main__":
    raise SystemExit(main())
