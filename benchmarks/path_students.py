"""Does a student of the path tracker that sees the true pose turn better than the tracker on the estimated one?

    python -m benchmarks.path_students [--scenarios 40] [--rounds 15] [--output FILE]

Teaches one student in range (the turns of ``configs/training/ppo_path.yaml``) and one on wider ground
(``ppo_path_wide.yaml``), two and a half minutes of one core each, by :mod:`agents.path_student`. Then both drive the
development plants of :mod:`benchmarks.row_turn_plants` beside the tracker whose curvature they correct
(``ppo_path@feed_forward``); no frozen set is read. Writes ``benchmarks/results/path_students.json`` and a picture
beside it. The students are not published.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from agents.main import load_settings
from agents.path_student import PathStudent, StudentSettings
from benchmarks.commits import commit_of
from benchmarks.plants_figure import draw
from benchmarks.row_turn_plants import PLANTS, study, table
from benchmarks.row_turns import CHECKOUT, rounded
from ddagr_gym.files import write_json
from ddagr_gym.policies.archive import save_policy

RESULT = Path(__file__).resolve().parent / "results" / "path_students.json"
BASE = "ppo_path@feed_forward"
STUDENTS = {"student": "ppo_path", "student_wide": "ppo_path_wide"}
"""Configurations of the turns that each is taught on."""
REACH = "design.curvature_scale=1.0"
"""A teacher asks for more than the 0.5/R* that the published arms may add."""
SEED = 0


def taught(how: StudentSettings, folder: Path) -> tuple[dict[str, Path], dict[str, list[float]]]:
    """Files of the students, and what each explained of its labels after every round."""
    files, explained = {}, {}
    for name, config in STUDENTS.items():
        one = PathStudent(load_settings(config, [REACH]), SEED, how)
        files[name] = save_policy(one.teach(), folder / f"{name}.npz")
        explained[name] = one.explained
    return files, explained


def result_of(how: StudentSettings, plants: Sequence[str], scenarios: int) -> dict[str, Any]:
    """Teach, drive, and what is kept of it."""
    with tempfile.TemporaryDirectory(prefix="ddagr-students-") as temporary:
        files, explained = taught(how, Path(temporary))
        found = study([BASE, *map(str, files.values())], plants, scenarios)
    names = dict(zip(map(str, files.values()), files, strict=True)) | {BASE: BASE}
    by_name = {plant: {names[arm]: own for arm, own in arms.items()} for plant, arms in found["plants"].items()}
    return {
        "command": "python -m benchmarks.path_students",
        "commit": commit_of(CHECKOUT),
        "scenarios": scenarios,
        "explained": rounded(explained),
        "plants": rounded(by_name),
    }


def last_explained(result: Mapping[str, Any], rounds: int = 3) -> dict[str, float]:
    """Share of the variance of new labels that each student explained, in the mean over the last rounds [-]."""
    return {name: sum(values[-rounds:]) / len(values[-rounds:]) for name, values in result["explained"].items()}


def main(arguments: Sequence[str] | None = None) -> int:
    """Teach, drive, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenarios", type=int, default=40, help="turns of each on each plant")
    parser.add_argument("--rounds", type=int, default=StudentSettings().rounds, help="of driving and learning")
    parser.add_argument("--output", type=Path, default=RESULT)
    given = parser.parse_args(arguments)
    result = result_of(StudentSettings(rounds=given.rounds), list(PLANTS), given.scenarios)
    write_json(given.output, result)
    draw(result["plants"], {name: PLANTS[name].title for name in result["plants"]}, given.output.with_suffix(".png"))
    print(table(result))
    print({name: round(value, 2) for name, value in last_explained(result).items()})
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
