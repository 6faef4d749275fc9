"""One truth after another: recorded drives, diagnosis, adaptation, and turns in the truth by three controllers."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import ddagr_gym
from benchmarks.adaptation.plant import TruePlant
from benchmarks.adaptation.truths import TRUTHS, Truth
from ddagr_gym.adaptation.corrected import Corrected
from ddagr_gym.adaptation.measured_noise import measured_sensors
from ddagr_gym.adaptation.run import Adapted, Effort, adapted, nominal_settings
from ddagr_gym.adaptation.turns import Columns, CorrectedTurns, DrivenTurn, MeasuredTurns
from ddagr_gym.api.adapt import corrected_by_diagnosis
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.evaluation.bundles import Bundle
from ddagr_gym.evaluation.runs import Controller
from ddagr_gym.files import atomic_path
from ddagr_gym.parameters import Sensors
from ddagr_gym.presets import ddagr, get_soil
from ddagr_gym.recordings.load import load_recording

ARMS = {"nominal": "nominal", "adapted": "adapted to the recordings", "told": "told the true effect"}
"""Controllers of the demonstration."""

_STAGES = ((4, 4), (2, 6))
EFFORT = {
    "B4": Effort(rounds=3, taught=6, stages=_STAGES, selection=8, report=0),
    "B6": Effort(stages=_STAGES, report=0),
}
"""Of each adaptation; less than the command's, which searches for longer."""

Say = Callable[[str], None]


class TrueTurns:
    """Turns in a truth, as the adaptation measures turns.

    Args:
        truth: what is different.
        field: its number.
    """

    def __init__(self, truth: Truth, field: int = 1) -> None:
        self.robot, self._plant = ddagr(), TruePlant(truth, field)

    def turn(self, number: int) -> RowTurn:
        """The commanded turn; even numbers to the left."""
        return RowTurn(side=("left", "right")[number % 2], run_in=0.5)

    def drive(self, controller: Controller, number: int) -> Columns:
        """Columns of a turn."""
        return self._plant.turn(controller, self.turn(number), number)


def diagnosed(truth: Truth, field: int, controller: str, folder: Path) -> Corrected:
    """What the diagnosis makes of recordings of a truth, kept in the folder, and their noise as ``adapt`` takes it."""
    if not (folder / "diagnosis" / "diagnosis.json").is_file():
        drives = TruePlant(truth, field).record(folder / "recordings")
        result = ddagr_gym.diagnose(drives, column_map="concealed", names_only=True, cache=folder / "diagnosis.parts")
        result.report(folder / "diagnosis", overwrite=True)
    found = corrected_by_diagnosis(folder / "diagnosis")
    return found if controller == "B4" else replace(found, sensors=recorded_sensors(folder))


def recorded_sensors(folder: Path) -> Sensors:
    """Sensors with the noise of a truth's recordings."""
    paths = sorted((folder / "recordings").glob("*.csv"))
    return measured_sensors([load_recording(path, "concealed", "ddagr") for path in paths], ddagr())


def tuned(corrected: Corrected, controller: str, journal: Path) -> Adapted:
    """Adaptation of a controller to a corrected simulator."""
    turns = MeasuredTurns(CorrectedTurns(corrected), journal)
    return adapted(corrected, ddagr(), get_soil("thesis_a1"), turns, controller=controller, effort=EFFORT[controller])


def nominal(controller: str) -> Bundle:
    """The controller that knows the data sheet alone."""
    return Bundle(nominal_settings(controller), ddagr(), get_soil("thesis_a1"))


def one_truth(truth: Truth, field: int, controller: str, work: Path, turns: int, say: Say) -> dict[str, Any]:
    """Recordings, diagnosis, adaptation and turns of a truth; what is in the folder already is not made again."""
    folder = work / truth.name
    folder.mkdir(parents=True, exist_ok=True)
    say(f"{truth.name}: diagnosing")
    found = diagnosed(truth, field, controller, folder)
    told = Corrected(ddagr(), get_soil("thesis_a1"), truth.named_effects(), sensors=found.sensors)
    usable = "unknown" not in found.verdict
    bundles, kept = {"nominal": nominal(controller)}, {}
    for arm, corrected in (("adapted", found), ("told", told)):
        if (arm == "adapted" and not usable) or (arm == "told" and not truth.effect):
            bundles[arm], kept[arm] = bundles["nominal"], "nominal"
            continue
        say(f"{truth.name}: tuning what is {ARMS[arm]}")
        result = tuned(corrected, controller, folder / f"{controller}_{arm}.jsonl")
        bundles[arm], kept[arm] = result.bundle, result.kept
    measured = MeasuredTurns(TrueTurns(truth, field), folder / f"{controller}_turns.jsonl")
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


def run(
    names: Sequence[str], field: int, controller: str, work: Path, turns: int, say: Say
) -> dict[str, dict[str, Any]]:
    """Every truth of a field by name; each is kept in its folder in that of the field."""
    found, place = {}, work / f"field_{field}"
    for name in names:
        path = place / name / f"{controller}_turns_{turns}.json"
        if not path.is_file():
            result = one_truth(TRUTHS[name], field, controller, place, turns, say)
            with atomic_path(path) as temporary:
                temporary.write_text(json.dumps(result), encoding="utf-8")
        found[name] = json.loads(path.read_text(encoding="utf-8"))
    return found


def as_turns(entries: Sequence[Mapping[str, Any]]) -> list[DrivenTurn]:
    """Turns as they stand in a file."""
    return [DrivenTurn(**entry) for entry in entries]
