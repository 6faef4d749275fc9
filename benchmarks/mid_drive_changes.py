"""When effects begin and end: simulated drives in which one does so in mid-drive, and some in which it is constant.

    python -m benchmarks.mid_drive_changes [--summary]

Drives of 60 s of the concealed benchmark's simulator (:mod:`benchmarks.mid_drive_drives`), each on a field of its own
and with one of its structural differences: five effects, in four drives each beginning or ending at a time between 15
and 45 s, and in four drives each constant. Asked is when the effect that is there changed: it is fitted beside robot
and soil in windows of 2 s and judged as a diagnosis does (:mod:`ddagr_gym.diagnosis.mid_drive.onsets`). Whether it is
named is another question, of benchmarks that search the whole library. Drives that hardly show the effect, those in
which it gains less than 8 over the noise where it is present, are counted apart.

Written are the answers and a picture (``benchmarks/results/mid_drive_changes.json``, ``.png``); a run goes on after the
drives that the file holds. Ten minutes of one core.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.concealed.cases import STRUCTURES
from benchmarks.mid_drive_drives import ALWAYS, BEGINS, ENDS, Switched, recording_of
from ddagr_gym.diagnosis.mid_drive.onsets import THRESHOLD, onsets_of, spells_of
from ddagr_gym.diagnosis.search.gains import gains
from ddagr_gym.diagnosis.search.initial_guess import first_guess
from ddagr_gym.diagnosis.search.scan import scan
from ddagr_gym.diagnosis.setting import Setting, make_problem
from ddagr_gym.diagnosis.wording import title
from ddagr_gym.files import write_json
from ddagr_gym.identification.gauss_newton import fit
from ddagr_gym.identification.misfit import dispersion_of
from ddagr_gym.physics.effects.registry import effect_kinds
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

RESULT = Path(__file__).resolve().parent / "results" / "mid_drive_changes.json"
SEED = 1000
DRIVES = 4
"""Of each effect and kind."""
SHOWN = 8.0
"""Gain over the noise from which a drive shows its effect."""

EFFECTS = (
    ("gyro_bias", "constant", 5.0),
    ("command_delay", "constant", 4.0),
    ("motor_lag", "slower loop", 4.0),
    ("wheel_radius_mismatch", "banks", 5.0),
    ("towed_drag", "hitch", 8.0),
)
"""Name, form and size in the least that is meaningful."""


def drives() -> list[Switched]:
    """All drives in their order, kinds and effects in turn."""
    structures = list(STRUCTURES)
    found = []
    for number in range(2 * DRIVES):
        for place, (effect, variant, multiple) in enumerate(EFFECTS):
            seed = SEED + 100 * place + number
            moment = float(np.random.default_rng(seed).uniform(15.0, 45.0))
            kind = ALWAYS if number % 2 else (BEGINS, ENDS)[number // 2 % 2]
            found.append(Switched(seed, effect, variant, multiple, kind, moment, structures[seed % len(structures)]))
    return found


def answer(item: Switched) -> dict[str, Any]:
    """What is said of a drive, as JSON has it."""
    began = time.monotonic()
    recording = recording_of(item, get_robot("ddagr"))
    problem = make_problem(get_robot("ddagr"), get_soil("thesis_a1"), [recording], Setting())
    nominal = fit(problem, iterations=4)
    terms = scan(problem, nominal, {item.effect: effect_kinds()[item.effect]})
    best = gains(terms)[0]
    guess = first_guess(terms.candidates[best.candidate], best.multiples)
    fitted = fit(problem, replace(nominal.point, effects=(guess,)), reuse=nominal, iterations=5)
    spells = spells_of(problem, fitted)
    parts = problem.during(spells)
    final = fit(parts, fitted.point, iterations=4) if spells else fitted
    onset = onsets_of(parts, final).get(item.effect)
    size = final.point.effects[0]
    return {
        "drive": item.name,
        "effect": item.effect,
        "structure": item.structure,
        "truth": item.kind,
        "time": None if item.kind == ALWAYS else item.time,
        "gain": (nominal.cost - final.cost) / dispersion_of(parts, final),
        "said": ALWAYS if onset is None else onset.kind,
        "value": None if onset is None else onset.value,
        "interval": None if onset is None or onset.interval is None else list(onset.interval),
        "evidence": 0.0 if onset is None else onset.evidence,
        "size": {name: getattr(size, name) for name in size.size_names()},
        "seconds": round(time.monotonic() - began, 1),
    }


def summary(answers: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Shares over the drives that show their effect."""
    shown = [item for item in answers if item["gain"] >= SHOWN]
    changed = [item for item in shown if item["truth"] != ALWAYS]
    constant = [item for item in shown if item["truth"] == ALWAYS]
    timed = [item for item in changed if item["interval"] is not None]
    inside = [item for item in timed if item["interval"][0] <= item["time"] <= item["interval"][1]]
    widths = [item["interval"][1] - item["interval"][0] for item in timed]
    return {
        "threshold": THRESHOLD,
        "beginning_or_ending": len(changed),
        "found": len(timed),
        "right_kind": sum(item["said"] == item["truth"] for item in changed),
        "inside": len(inside),
        "median_width": float(np.median(widths)) if widths else None,
        "constant": len(constant),
        "false": sum(item["said"] != ALWAYS for item in constant),
        "hardly_shown": len(answers) - len(shown),
        "false_of_all_constant": sum(item["said"] != ALWAYS for item in answers if item["truth"] == ALWAYS),
    }


def draw(answers: Sequence[dict[str, Any]], path: Path) -> None:
    """Intervals of the times around the truth, and the evidence of constant drives."""
    from matplotlib.figure import Figure

    changed = [item for item in reversed(answers) if item["truth"] != ALWAYS]
    constant = [item for item in reversed(answers) if item["truth"] == ALWAYS]
    with house_style():
        figure = Figure(figsize=(11.0, 0.9 + 0.26 * max(len(changed), len(constant))), layout="constrained")
        left, right = figure.subplots(1, 2)
        for place, item in enumerate(changed):
            _draw_time(left, place, item)
        left.axvline(0.0, color=palette.INK, lw=0.9)
        left.set_yticks(range(len(changed)), [_label(item) for item in changed], fontsize=7)
        left.set_xlabel("time said less true time [s] (bar: 90 % interval)")
        for place, item in enumerate(constant):
            wrong = item["said"] != ALWAYS
            right.barh(place, item["evidence"], 0.6, color=palette.VERMILLION if wrong else palette.BLUE)
        right.axvline(THRESHOLD, color=palette.INK, lw=0.9)
        right.set_yticks(range(len(constant)), [_label(item) for item in constant], fontsize=7)
        right.set_xlabel("constant: evidence of a change (line: threshold)")
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=110))


def _draw_time(axis: Any, place: int, item: dict[str, Any]) -> None:
    if item["interval"] is None:
        axis.text(0.3, place, f"said to be {item['said']}", va="center", fontsize=7, color=palette.VERMILLION)
        return
    low, high = (end - item["time"] for end in item["interval"])
    axis.plot([low, high], [place, place], lw=4.0, alpha=0.6, solid_capstyle="butt",
              color=palette.BLUE if low <= 0.0 <= high else palette.VERMILLION)  # fmt: skip
    axis.plot(item["value"] - item["time"], place, "o", ms=4, color=palette.INK)


def _label(item: dict[str, Any]) -> str:
    weak = "" if item["gain"] >= SHOWN else " (hardly shown)"
    return f"{title(item['effect'])}, {item['truth']}, {item['structure'] or 'plain'}{weak}"


def main(arguments: Sequence[str] | None = None) -> None:
    """Drive, ask and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--summary", action="store_true", help="only figures and picture of the drives in the file")
    given = parser.parse_args(arguments)
    answers: list[dict[str, Any]] = json.loads(RESULT.read_text())["drives"] if RESULT.exists() else []
    for item in drives()[len(answers) :] if not given.summary else []:
        answers.append(answer(item))
        _write(answers)
        print(item.name, answers[-1]["said"], answers[-1]["interval"], f"{answers[-1]['seconds']:.0f} s", flush=True)
    _write(answers)
    draw(answers, RESULT.with_suffix(".png"))


def _write(answers: Sequence[dict[str, Any]]) -> None:
    command = "python -m benchmarks.mid_drive_changes"
    write_json(RESULT, {"command": command, "summary": summary(answers), "drives": list(answers)})


if __name__ == "__main__":
    main()
