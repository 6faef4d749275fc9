"""Which names and forms a diagnosis gives to parts of a drivetrain that its simulator lacks.

    python -m benchmarks.drivetrain_forms [--version NAME] [--seeds N] [--parts PART ...]

Drives of robots with one part more than the simulator under diagnosis, each on a soil of its own
(:mod:`benchmarks.drivetrain_form_drives`), are searched with the shipped gates up to the first name. Answers are kept
under the version of the library that gave them, so that another checkout's can stand beside them: ``before`` is the
library without the form that the part's name has now. Half a minute to two minutes for each search. Writes
``benchmarks/results/drivetrain_forms.json`` and ``.png``; a run goes on after the answers that the file holds.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.drivetrain_form_drives import PARTS, ROBOT, SOIL, Part, drives_of, robot_with
from ddagr_gym.diagnosis.gates.threshold_files import shipped_thresholds
from ddagr_gym.diagnosis.gates.thresholds import Thresholds
from ddagr_gym.diagnosis.preprocessing.session import prepare
from ddagr_gym.diagnosis.result.conclusion import accept
from ddagr_gym.diagnosis.result.drivetrain_names import ENCODERS
from ddagr_gym.diagnosis.search.scanned_model import ScannedModel
from ddagr_gym.diagnosis.search.starting_models import starting_models
from ddagr_gym.diagnosis.search.stepwise import search
from ddagr_gym.diagnosis.setting import Setting
from ddagr_gym.files import write_json
from ddagr_gym.presets import get_soil
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

RESULT = Path(__file__).resolve().parent / "results" / "drivetrain_forms.json"
SEEDS = 1
WINDOW = 6.0
"""Length of the windows of the shipped gates [s]."""
VERSIONS = ("before", "after")
"""Of the library: without the forms that parts of a drivetrain have now, and with them."""
COLOURS = (palette.GREY, palette.BLUE)


def answer_of(part: Part, seed: int, gates: Thresholds) -> dict[str, Any]:
    """Names, sizes and what is left of the wheel speeds, for one set of drives."""
    began = time.process_time()
    setting = Setting().with_windows(WINDOW)
    session = prepare(drives_of(part, seed), robot_with(part.nominal), get_soil(SOIL), gates, setting)
    start = starting_models(session)
    found = accept(search(start.session, start, enough=lambda model: bool(model.names)), start.session.gates)
    chosen, limits = found.chosen, start.session.gates.misfit
    return {
        "names": list(chosen.names),
        "sizes": [effect.as_mapping()["parameters"] for effect in chosen.fitted.point.effects],
        "left": {"nominal": _left(found.nominal, limits), "corrected": _left(chosen, limits)},
        "seconds": round(time.process_time() - began, 1),
    }


def _left(model: ScannedModel, limits: Mapping[str, float]) -> float:
    """Larger misfit of the two encoders over its limit."""
    return float(max(model.misfit[name] / limits[name] for name in ENCODERS))


def summary_of(answers: dict[str, Any]) -> dict[str, Any]:
    """By library and part: drives with a right name and with nothing else, and medians of what is left."""
    summary: dict[str, Any] = {}
    for library, parts in answers.items():
        for name, found in parts.items():
            right = [set(item["names"]) & set(PARTS[name].names) for item in found.values()]
            alone = [set(item["names"]) <= set(PARTS[name].names) for item in found.values()]
            summary.setdefault(library, {})[name] = {
                "drives": len(found),
                "right": sum(map(bool, right)),
                "right_and_nothing_else": sum(bool(a and b) for a, b in zip(right, alone, strict=True)),
                "left": float(np.median([item["left"]["corrected"] for item in found.values()])),
                "left_of_nominal": float(np.median([item["left"]["nominal"] for item in found.values()])),
            }
    return summary


def draw(summary: dict[str, Any], path: Path) -> None:
    """Misfit of the encoders by part: of the nominal simulator, and corrected by each library."""
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(8.0, 3.6), layout="constrained")
        axis = figure.subplots()
        names = [name for name in PARTS if any(name in parts for parts in summary.values())]
        for k, (library, parts) in enumerate(summary.items()):
            rows = [names.index(name) + 0.3 * (k - 0.5) for name in parts]
            axis.barh(rows, [parts[name]["left"] for name in parts], 0.26, color=COLOURS[k], label=library)
            if k == 0:
                axis.plot([parts[name]["left_of_nominal"] for name in parts], rows, "k|", label="nothing corrected")
        axis.axvline(1.0, color="black", linewidth=0.8)
        axis.set(xscale="log", xlabel="misfit of the encoders over its limit [-]", yticks=range(len(names)))
        axis.set_yticklabels(names)
        axis.invert_yaxis()
        axis.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
        write_atomically(path, lambda part: figure.savefig(part, format="png", dpi=120))


def main(words: list[str] | None = None) -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--version", choices=VERSIONS, default="after", help="whose answers these are")
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--parts", nargs="+", choices=list(PARTS), default=list(PARTS))
    parser.add_argument("--output", type=Path, default=RESULT)
    given = parser.parse_args(words)
    answers = json.loads(given.output.read_text())["answers"] if given.output.exists() else {}
    gates = shipped_thresholds(ROBOT)
    if gates is None:
        raise RuntimeError(f"the package ships no gates for {ROBOT}")
    own = answers.setdefault(given.version, {})
    for name in given.parts:
        for seed in (str(seed) for seed in range(given.seeds)):
            if seed in own.setdefault(name, {}):
                continue
            own[name][seed] = found = answer_of(PARTS[name], int(seed), gates)
            print(name, seed, found["names"], found["sizes"], found["left"], found["seconds"], flush=True)
            write_json(given.output, {"summary": summary_of(answers), "answers": answers})
    write_json(given.output, {"summary": summary_of(answers), "answers": answers})
    draw(summary_of(answers), given.output.with_suffix(".png"))


if __name__ == "__main__":
    main()
