"""What ``ddagr diagnose --calibration`` says where a robot was calibrated with three drives.

    python -m benchmarks.calibrated_pairs [--worlds N] [--changes N] [--workers N]

The three drives before of a pair of the open set of :mod:`benchmarks.changed_pairs` in which nothing changed are what
``ddagr calibrate`` gets: 60 s each on one field of a simulator that shares no code with the package, half of these
worlds with a structure that no effect of the library has. Asked about are, on the same ground, the drive after, and the
same drive with something changed: the singles of that set, one after the other. The nominal is the data sheet on the
thesis's soil.

Written are the score in the terms of :mod:`benchmarks.changed_pairs` and a picture
(``benchmarks/results/calibrated_pairs.json``, ``.png``). A run goes on after the calibrations and answers in the folder
of parts. Five minutes of a core a calibration, one an answer.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import ddagr_gym
from benchmarks.changed_pairs.answers import CHECKOUT, KEPT, SOIL, recordings_of
from benchmarks.changed_pairs.drives import label_of
from benchmarks.changed_pairs.figure import draw
from benchmarks.changed_pairs.plan import Pair, plan
from benchmarks.changed_pairs.score import TARGETS, score
from benchmarks.commits import commit_of
from benchmarks.independent_pairs import ordinary_pairs
from benchmarks.score_concealed import against_targets, share
from ddagr_gym.calibration.ordinary_robot import load_ordinary_robot
from ddagr_gym.diagnosis.answer.verdict import NONE
from ddagr_gym.diagnosis.change.run import what_changed
from ddagr_gym.diagnosis.result.files import as_mapping
from ddagr_gym.files import write_json
from ddagr_gym.tasks import ResultStore, Task, TaskRunner, run_tasks

RESULT = CHECKOUT / "benchmarks" / "results" / "calibrated_pairs.json"
COMMAND = "python -m benchmarks.calibrated_pairs"
SEED = 1


@dataclass(frozen=True)
class Question:
    """A drive that is asked about.

    Attributes:
        name: unlike any other.
        pair: its world, and what changed.
    """

    name: str
    pair: Pair


def questions(worlds: int, changes: int) -> list[list[Question]]:
    """By world, the drive in which nothing changed and those with a single change.

    Args:
        worlds: how many.
        changes: of each world.
    """
    singles = [pair for pair in plan(SEED) if pair.kind == "single"]
    return [
        [Question(world.name, world), *_changed(world, singles[number * changes : (number + 1) * changes])]
        for number, world in enumerate(ordinary_pairs(worlds))
    ]


def _changed(world: Pair, singles: Sequence[Pair]) -> list[Question]:
    """The world's drive with what changed in other pairs."""
    return [
        Question(
            f"{world.name}-{single.name}", replace(world, case=replace(world.case, kind="single", effects=effects))
        )
        for single in singles
        for effects in [single.case.effects]
    ]


def answer(folder: Path, question: Question) -> dict[str, Any]:
    """What is said of a drive against the world's calibration, which is made where it is missing.

    Args:
        folder: of calibrations.
        question: about a drive.
    """
    before, after = recordings_of(question.pair, SEED)
    calibrated = folder / question.pair.name
    if not (calibrated / "calibration.json").exists():
        made = ddagr_gym.calibrate(before, robot=question.pair.robot, soil=SOIL, bank=True, threads=1)
        made.report(calibrated)
    ordinary = load_ordinary_robot(calibrated)
    (ground,) = ordinary.soils
    body = as_mapping(what_changed(after, ordinary, ground).diagnosis)
    return {name: body[name] for name in KEPT if name in body}


def answers(folder: Path, world: Sequence[Question]) -> dict[str, Any]:
    """Answers to the questions about a world by name; arguments as of :func:`answer`."""
    store, found = ResultStore(folder / "answers"), {}
    for question in world:
        if not store.has(question.name):
            store.put(question.name, answer(folder, question))
        found[question.name] = store.get(question.name)
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Calibrate, ask, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--worlds", type=int, default=12, help="that a robot is calibrated in")
    parser.add_argument("--changes", type=int, default=4, help="that are asked about in each, beside none")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    parser.add_argument("--parts", type=Path, default=RESULT.with_suffix(".parts"), help="folder of what is finished")
    given = parser.parse_args(arguments)
    asked = questions(given.worlds, given.changes)
    tasks = [Task(world[0].name, answers, (given.parts, world)) for world in asked]
    with TaskRunner(given.workers) as runner:
        made = run_tasks(tasks, "worlds", runner)
    found = {name: item for world in made for name, item in world.items()}
    _write(asked, found)


def _write(asked: Sequence[Sequence[Question]], found: dict[str, Any]) -> None:
    """Results and picture."""
    labels = {question.name: label_of(question.pair, SEED) for world in asked for question in world}
    figures = score(labels, found)
    about = {
        "command": COMMAND,
        "seed": SEED,
        "commit": commit_of(CHECKOUT),
        "drives": dict(Counter(label["kind"] for label in labels.values())),
    }
    told = share([item["verdict"] != [NONE] for name, item in found.items() if labels[name]["kind"] == "single"])
    body = {"about": about, "targets": against_targets(figures, TARGETS), "told_of_singles": told, **figures}
    write_json(RESULT, body)
    draw(figures, RESULT.with_suffix(".png"))
    shown = ("false_alarms", "right_name", "in_set", "right_name_all_singles", "interval_holds", "sure_and_wrong")
    print({name: figures[name] for name in shown}, told, figures["least_detectable"])


if __name__ == "__main__":
    main()
