"""One truth after another: recorded drives, diagnosis, adaptation, and turns in the truth by three controllers."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import ddagr_gym
from benchmarks.adaptation.plant import TruePlant
from benchmarks.adaptation.truths import TRUTHS, Truth
from ddagr_gym.adaptation.corrected import Corrected
from ddagr_gym.adaptation.run import Adapted, Effort, adapted
from ddagr_gym.adaptation.turns import Columns, CorrectedTurns, DrivenTurn, MeasuredTurns
from ddagr_gym.api.adapt import corrected_by_diagnosis
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.evaluation.adapted_controller import AdaptedSettings
from ddagr_gym.evaluation.bundles import Bundle
from ddagr_gym.evaluation.runs import Controller
from ddagr_gym.files import atomic_path
from ddagr_gym.presets import ddagr, get_soil

ARMS = {"nominal": "nominal", "adapted": "adapted to the recordings", "told": "told the true effect"}
"""Controllers of the demonstration."""

EFFORT = Effort(rounds=3, taught=6, stages=((4, 4), (2, 6)), selection=8, report=0)
"""Of each adaptation; less than the command's, which searches for longer."""

Say = Callable[[str], None]


class TrueTurns:
    """Turns in a truth, as the adaptation measures turns.

    Args:
        truth: what is different.
    """

    def __init__(self, truth: Truth) -> None:
        self.robot, self._plant = ddagr(), TruePlant(truth)

    def turn(self, number: int) -> RowTurn:
        """The commanded turn; even numbers to the left."""
        return RowTurn(side=("left", "right")[number % 2], run_in=0.5)

    def drive(self, controller: Controller, number: int) -> Columns:
        """Columns of a turn."""
        return self._plant.turn(controller, self.turn(number), number)


def diagnosed(truth: Truth, folder: Path) -> Corrected:
    """What the diagnosis makes of recordings of a truth; kept in the folder."""
    if not (folder / "diagnosis" / "diagnosis.json").is_file():
        drives = TruePlant(truth).record(folder / "recordings")
        result = ddagr_gym.diagnose(drives, column_map="concealed", names_only=True, cache=folder / "diagnosis.parts")
        result.report(folder / "diagnosis", overwrite=True)
    return corrected_by_diagnosis(folder / "diagnosis")


def tuned(corrected: Corrected, journal: Path) -> Adapted:
    """Adaptation to a corrected simulator."""
    turns = MeasuredTurns(CorrectedTurns(corrected), journal)
    return adapted(corrected, ddagr(), get_soil("thesis_a1"), turns, effort=EFFORT)


def nominal() -> Bundle:
    """The controller that knows the data sheet alone: B4."""
    return Bundle(AdaptedSettings(), ddagr(), get_soil("thesis_a1"))


def one_truth(truth: Truth, work: Path, turns: int, say: Say) -> dict[str, Any]:
    """Recordings, diagnosis, adaptation and turns of a truth; what is in the folder already is not made again."""
    folder = work / truth.name
    folder.mkdir(parents=True, exist_ok=True)
    say(f"{truth.name}: diagnosing")
    found = diagnosed(truth, folder)
    told = Corrected(ddagr(), get_soil("thesis_a1"), truth.named_effects())
    usable = "unknown" not in found.verdict
    bundles, kept = {"nominal": nominal()}, {}
    for arm, corrected in (("adapted", found), ("told", told)):
        if (arm == "adapted" and not usable) or (arm == "told" and not truth.effect):
            bundles[arm], kept[arm] = bundles["nominal"], "nominal"
            continue
        say(f"{truth.name}: tuning what is {ARMS[arm]}")
        result = tuned(corrected, folder / f"{arm}.jsonl")
        bundles[arm], kept[arm] = result.bundle, result.kept
    measured = MeasuredTurns(TrueTurns(truth), folder / "turns.jsonl")
    driven: dict[str, list[DrivenTurn]] = {}
    for arm, bundle in bundles.items():
        say(f"{truth.name}: driving {turns} turns by the controller that is {ARMS[arm]}")
        driven[arm] = measured.measure_all(bundle, range(turns))
    return {
        "title": truth.title,
        "effect": truth.effect,
        "verdict": list(found.verdict),
        "complete": found.complete,
        "sentence": found.sentence,
        "kept": kept,
        "turns": {arm: [asdict(item) for item in own] for arm, own in driven.items()},
    }


def run(names: Sequence[str], work: Path, turns: int, say: Say) -> dict[str, dict[str, Any]]:
    """Every truth by name; each is kept as ``truth.json`` in its folder."""
    found = {}
    for name in names:
        path = work / name / f"turns_{turns}.json"
        if not path.is_file():
            result = one_truth(TRUTHS[name], work, turns, say)
            with atomic_path(path) as temporary:
                temporary.write_text(json.dumps(result), encoding="utf-8")
        found[name] = json.loads(path.read_text(encoding="utf-8"))
    return found


def as_turns(entries: Sequence[Mapping[str, Any]]) -> list[DrivenTurn]:
    """Turns as they stand in a file."""
    return [DrivenTurn(**entry) for entry in entries]
