"""Policies that see the estimated path errors, beside the controller that they correct.

    python -m benchmarks.path_policies FOLDER [--workers 2] [--controllers B6,ppo_path,...]

Drives :data:`CONTROLLERS` on the validation set V and on the sets of :mod:`benchmarks.second_sets` (about twenty
minutes of one core; started again with the same folder, it goes on), and writes
``benchmarks/results/path_policies.json`` and a picture beside it. Turns that no upper bound makes are left out.
B4 and ppo_ekf stand there as ``benchmarks/results/second_sets.json`` has them, as long as scenarios and controllers
are the same.

``ppo_path@feed_forward`` is the path tracker of these policies with the network silent. Its turns differ from B6's by
rounding and by the numbers that B6 has calibrated for each turn: how far the two are apart says what differs by chance.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks import second_sets
from benchmarks.commits import commit_of
from benchmarks.row_turn_plants import cell
from benchmarks.row_turns import CHECKOUT, rounded
from benchmarks.second_sets import RESULT as SECOND_RESULT
from benchmarks.second_sets import SETS, for_picture, kept_of, mean_over_sets, title, version_of
from benchmarks.second_sets_figure import draw
from ddagr_gym.errors import InputError
from ddagr_gym.evaluation.scenarios import set_hash
from ddagr_gym.evaluation.summary import BASELINES
from ddagr_gym.files import make_folder, write_json

RESULT = Path(__file__).resolve().parent / "results" / "path_policies.json"
VALIDATION = "V"
ALL_SETS = (VALIDATION, *SETS)
BASE = "B6"
"""Controller that the policies correct, against which they are compared."""
CONTROLLERS = (BASE, "ppo_path@feed_forward", "ppo_path", "ppo_path_wide")
BEFORE = ("B4", "ppo_ekf")
"""Taken from the record of the second sets."""
CLOSER = "improvement_over_B6"

Found = dict[str, dict[str, Any]]
"""{set: {controller: metrics}}."""


def driven(folder: Path, controllers: Sequence[str], workers: int, sets: Sequence[str] = ALL_SETS) -> Found:
    """Metrics of the controllers by episodes that the folder holds or that are driven now."""
    compared = (*BASELINES, BASE)
    return kept_of(second_sets.driven(folder, controllers, workers, sets, compared), controllers, sets, compared)


def from_before(sets: Sequence[str], path: Path = SECOND_RESULT) -> Found:
    """Metrics of :data:`BEFORE` in the record of the second sets.

    Raises:
        InputError: the record is of other scenarios or of other controllers than today's.
    """
    record = json.loads(path.read_text(encoding="utf-8"))
    other = [name for name in BEFORE if record["controllers"].get(name) != version_of(name)]
    other += [name for name in sets if name in record["sets"] and record["scenarios"][name] != set_hash(name)]
    if other:
        raise InputError(f"{path} is of another {other[0]}: run `python -m benchmarks.second_sets` again.")
    return {name: {arm: record["sets"][name][arm] for arm in BEFORE} for name in sets if name in record["sets"]}


def means(found: Found) -> dict[str, dict[str, float]]:
    """Of each controller, success and median |e_R| in the mean over the second sets (at most 100 % a set) [-]."""
    by_arm = {arm: {name: found[name][arm] for name in SETS} for arm in found[SETS[0]]}
    return {
        arm: {metric: mean_over_sets(by_arm, arm, metric, SETS) for metric in ("success_rate", "radius_error_median")}
        for arm in by_arm
    }


def result_of(found: Found) -> dict[str, Any]:
    """As it is written: hashes, means over the second sets, and the metrics of each set."""
    arms = list(found[SETS[0]])
    return {
        "command": "python -m benchmarks.path_policies FOLDER",
        "commit": commit_of(CHECKOUT),
        "scenarios": {name: set_hash(name) for name in found},
        "controllers": {name: version_of(name) for name in arms},
        "means": rounded(means(found)),
        "sets": rounded(found),
    }


def label(name: str) -> str:
    """Of a set, in tables and pictures."""
    return "V: validation" if name == VALIDATION else title(name)


def table(result: Mapping[str, Any]) -> str:
    """Markdown: a row a set, a column a controller: median / 95th percentile of |e_R|, success, all in percent."""
    names = list(result["controllers"])
    lines = [f"| set | {' | '.join(names)} |", "|---" * (len(names) + 1) + "|"]
    for name, found in result["sets"].items():
        lines.append(f"| {label(name)} | {' | '.join(cell(found[arm]) if arm in found else '' for arm in names)} |")
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Drive, compare, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="of the episodes")
    parser.add_argument("--controllers", default=",".join(CONTROLLERS), help="names, separated by commas; B6 is one")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--output", type=Path, default=RESULT)
    given = parser.parse_args(arguments)
    controllers = given.controllers.split(",")
    try:
        before = from_before(ALL_SETS)
        own = driven(make_folder(given.folder), controllers, given.workers)
    except InputError as error:
        parser.error(str(error))
    result = result_of({name: before.get(name, {}) | arms for name, arms in own.items()})
    write_json(given.output, result)
    second = {"sets": {name: found for name, found in result["sets"].items() if name != VALIDATION}}
    draw(for_picture(second), {name: label(name) for name in SETS}, given.output.with_suffix(".png"))
    print(table(result))
    print(json.dumps(result["means"], indent=1))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
