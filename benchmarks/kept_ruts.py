"""Front against rear: what a diagnosis says of ground that keeps its ruts, and of a mass that is off centre.

    python -m benchmarks.kept_ruts [--workers N] [--cluster ADDRESS] [--parts DIR]

Twelve cases of the concealed benchmark's simulator, three drives of 60 s each, on fields and with noise of their own:
six on ground that keeps its ruts (:mod:`benchmarks.concealed.terrain_memory`), of which 0.1, 0.2 or 0.4 of the depth
springs back; four whose centre of mass lies ahead of or behind the middle, on ordinary ground; two with both. The right
answer to ruts is ``multipass``, for which the rear wheels' soil is stiffer, and which changes axles when the robot
reverses; a mass does not. Written are the answers and a picture (``benchmarks/results/kept_ruts.json``, ``.png``); a
run goes on after the answers in the folder of parts. Two minutes of a core a case.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.concealed.cases import Case, field_plant
from benchmarks.concealed.change import with_body, with_ground
from benchmarks.concealed.manoeuvres import RUNS, programme
from benchmarks.concealed.plant import Plant
from benchmarks.concealed.simulate import plain_log
from benchmarks.concealed.streams import stream
from benchmarks.concealed.terrain_memory import HEIGHT_GRID
from benchmarks.mid_drive_drives import as_recording
from ddagr_gym.api.diagnose import diagnose
from ddagr_gym.files import write_json
from ddagr_gym.presets import get_robot
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style
from ddagr_gym.tasks import ResultStore, Task, TaskRunner, run_tasks

RESULT = Path(__file__).resolve().parent / "results" / "kept_ruts.json"
SET = "kept ruts"
SEED = 1
RUTS, OFFSET = "multipass", "centre_of_mass_offset"


@dataclass(frozen=True)
class Truth:
    """One case.

    Attributes:
        number: of field and noise.
        rebound: share of a rut's depth that springs back; None where the ground keeps nothing.
        offset: of the centre of mass, ahead of the middle [m].
    """

    number: int
    rebound: float | None = None
    offset: float = 0.0

    @property
    def names(self) -> list[str]:
        """Right ones."""
        return [RUTS] * (self.rebound is not None) + [OFFSET] * (self.offset != 0.0)

    @property
    def words(self) -> str:
        """For the picture."""
        ruts = "no ruts" if self.rebound is None else f"ruts, {self.rebound:g} springs back"
        return f"{ruts}; mass {100.0 * self.offset:+.0f} cm"


_RUTS = [Truth(number, rebound) for number, rebound in enumerate((0.1, 0.2, 0.4) * 2)]
_MASS = [Truth(number, offset=offset) for number, offset in enumerate((0.06, -0.06, 0.1, -0.1), start=len(_RUTS))]
CASES = (*_RUTS, *_MASS, Truth(10, 0.2, 0.08), Truth(11, 0.2, -0.08))


def drives(truth: Truth) -> list[Recording]:
    """Three drives of a case.

    Args:
        truth: of it.
    """
    case = Case(SET, truth.number, "single", (), manoeuvres=truth.number)
    plant, robot = _plant(truth, case), get_robot("ddagr")
    return [as_recording(_log(case, plant, run), robot, f"case {truth.number}, {run}") for run in RUNS]


def _plant(truth: Truth, case: Case) -> Plant:
    plant = with_body(field_plant(case, SEED), mass_x=truth.offset)
    return plant if truth.rebound is None else with_ground(plant, rut_mode=HEIGHT_GRID, rebound=truth.rebound)


def _log(case: Case, plant: Plant, run: str) -> dict[str, np.ndarray]:
    start = np.append(np.zeros(2), stream(SEED, SET, case.number, "start", run).uniform(-np.pi, np.pi))
    return plain_log(case, plant, programme(run, case.manoeuvres), start, run, SEED)


def answer(truth: Truth) -> dict[str, Any]:
    """What is said of a case, as JSON has it.

    Args:
        truth: of it.
    """
    found = diagnose(drives(truth), robot="ddagr", soil="thesis_a1", names_only=True).outcome.diagnosis
    return {
        "case": truth.words,
        "truth": truth.names,
        "verdict": list(found.verdict),
        "complete": found.complete,
        "sets": [dict(finding.equivalence_set) for finding in found.findings],
        "detectable": {name: dict(found.detectable_alone[name]) for name in (RUTS, OFFSET)},
        "seconds": found.seconds,
    }


def summary(answers: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Counts of the answers."""
    ruts = [item for item in answers if item["truth"] == [RUTS]]
    mass = [item for item in answers if item["truth"] == [OFFSET]]
    return {
        "ruts": _counts(ruts, RUTS, OFFSET),
        "offset_mass": _counts(mass, OFFSET, RUTS),
        "both_named": sum(set(item["verdict"]) == {RUTS, OFFSET} for item in answers if len(item["truth"]) == 2),
        "both": sum(len(item["truth"]) == 2 for item in answers),
    }


def _counts(items: Sequence[dict[str, Any]], right: str, wrong: str) -> dict[str, int]:
    sets = [{name for found in item["sets"] for name in found} for item in items]
    return {
        "cases": len(items),
        "named": sum(item["verdict"] == [right] for item in items),
        "in_set": sum(right in names for names in sets),
        "nothing": sum(item["verdict"] == ["none"] for item in items),
        "other_axle_effect_without_it": sum(wrong in names and right not in names for names in sets),
    }


def draw(answers: Sequence[dict[str, Any]], path: Path) -> None:
    """Names that were said, with their weights in their sets.

    Args:
        answers: of :func:`answer`.
        path: of the PNG.
    """
    from matplotlib.figure import Figure

    with house_style():
        figure = Figure(figsize=(10.0, 1.0 + 0.42 * len(answers)), layout="constrained")
        panel = figure.subplots()
        for place, item in enumerate(answers):
            _draw_sets(panel, place, item)
        panel.set_yticks(range(len(answers)), [item["case"] for item in answers], fontsize=9)
        panel.set(
            ylim=(len(answers) - 0.4, -0.6),
            xlim=(0.0, max(1, *(len(item["sets"]) for item in answers)) + 0.05),
            xlabel="names said, one unit each; share: weight in its set",
        )
        panel.set_title("green: right; orange: front against rear the other way round; grey: another name", fontsize=9)
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=110))


def _draw_sets(panel: Any, place: int, item: dict[str, Any]) -> None:
    if not item["sets"]:
        panel.text(0.02, place, item["verdict"][0], va="center", fontsize=9)
    for left, names in enumerate(item["sets"]):
        begin = float(left)
        for name, weight in names.items():
            right, other = name in item["truth"], name in (RUTS, OFFSET)
            colour = palette.GREEN if right else palette.VERMILLION if other else palette.GREY
            panel.barh(place, weight, left=begin, height=0.7, color=colour, alpha=0.5, edgecolor=palette.INK)
            panel.text(begin + 0.01, place, name.replace("_", " "), va="center", fontsize=7, clip_on=True)
            begin += weight


def main(words: Sequence[str] | None = None) -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", type=Path, default=RESULT.with_suffix(".parts"), help="folder of finished answers")
    parser.add_argument("--output", type=Path, default=RESULT, help="JSON; the picture has the same name")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--cluster", default="", help="local, or the address of a Ray cluster")
    given = parser.parse_args(words)
    tasks = [Task(truth.words, answer, (truth,), key=f"case-{truth.number:02d}") for truth in CASES]
    with TaskRunner(given.workers, cluster=given.cluster) as runner:
        answers = run_tasks(tasks, "cases", runner, ResultStore(given.parts))
    found = summary(answers)
    write_json(given.output, {"command": "python -m benchmarks.kept_ruts", **found, "answers": answers})
    draw(answers, given.output.with_suffix(".png"))
    print(found)


if __name__ == "__main__":
    main()
