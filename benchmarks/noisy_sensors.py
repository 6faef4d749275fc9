"""The default controller where its sensors are worse than their data sheets, beside the one without a network.

    python -m benchmarks.noisy_sensors FOLDER [--workers 2]

Drives B6 and B6_pose_wide on all four drawings of the set of stressed sensors (five minutes of two cores; started
again with the same folder, it goes on). They had been opened before the network was left out where the readings at rest
scatter far beyond the data sheet, so this is no fresh reading. Writes ``noisy_sensors.json`` and a picture beside it.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.commits import commit_of
from benchmarks.row_turns import CHECKOUT, rounded
from benchmarks.second_sets import driven, for_picture, kept_of, table, title, version_of
from benchmarks.second_sets_figure import draw
from ddagr_gym.evaluation.scenarios import set_hash
from ddagr_gym.files import make_folder, write_json

RESULT = Path(__file__).resolve().parent / "results" / "noisy_sensors.json"
SETS = ("S5", "S5b", "S5c", "S5d")
CONTROLLERS = ("B6", "B6_pose_wide")


def result_of(summary: Mapping[str, Mapping[str, Any]], sets: Sequence[str]) -> dict[str, Any]:
    """As it is written: hashes, and the metrics that are kept, {set: {arm: ...}}."""
    return {
        "command": "python -m benchmarks.noisy_sensors FOLDER",
        "commit": commit_of(CHECKOUT),
        "scenarios": {name: set_hash(name) for name in sets},
        "controllers": {name: version_of(name) for name in CONTROLLERS},
        "sets": rounded(kept_of(summary, CONTROLLERS, sets, CONTROLLERS[:1])),
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """Drive, write, draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="of the episodes")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--output", type=Path, default=RESULT)
    given = parser.parse_args(arguments)
    result = result_of(driven(make_folder(given.folder), CONTROLLERS, given.workers, SETS, CONTROLLERS[:1]), SETS)
    write_json(given.output, result)
    draw(for_picture(result), {name: title(name) for name in SETS}, given.output.with_suffix(".png"))
    print(table(result))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
