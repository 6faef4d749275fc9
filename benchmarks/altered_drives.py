"""Real drives into which a known change was written: does the diagnosis name it, and how large does it find it?

    python -m benchmarks.altered_drives [--output benchmarks/results/altered_drives.json] [--limit N] [--parts DIR]

The open drives of ``shared/recordings`` are ordinary. A copy of each is altered in one thing that goes wrong with
recordings (a clock that is late, a scaled encoder, a turned IMU, a gyro with another sensitivity or sign) and goes
through ``ddagr diagnose --names-only`` with the options of ``answers/run_diagnoses.py`` for real drives. The changes
are arithmetic on the columns of the file and share no code with the effects or the diagnosis. Their sizes are those
that a field engineer meets; they were fixed before the first run and are not tuned to what is found. The last two rows
are gross errors, added when it was known which sizes the diagnosis says it can show in these drives.

Read the figures with three things in mind.

- The controls, in which nothing was changed, are no evidence against false alarms: the bank of Warthog drives that
  ships with the package was made from pieces of these same three drives (``answers/README.md``).
- The drives have delays, biases and a ground of their own, which are not known. Where the control names the effect
  that was written, its size there is added to the truth; where it does not, the size that was written is the truth.
- A diagnosis states the least size that it can show. Cases are scored all together, and those alone whose size
  reaches what the control of their drive states.

Copies lie in a temporary folder while they are diagnosed. Finished cases are kept in the folder of parts with their
options and commit, under a hash of the altered file and of the bank; the same command goes on from there. A part is
not made anew when the diagnosis itself was changed: then remove the folder.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.altered_changes import CHANGES, CONTROL, DRIVES, STEPS, Change, packed, read_table
from benchmarks.altered_figure import draw
from benchmarks.answers.run_diagnoses import (
    CHECKOUT,
    UNKNOWN_GROUND,
    Case,
    InterruptedRunError,
    diagnose,
    shared,
)
from benchmarks.concealed_truth import is_detectable, sizes
from benchmarks.score_concealed import figure_line, in_set, mean, names_of, right, share
from ddagr_gym.physics.effects.registry import effect_kind
from ddagr_gym.recordings.checks.run import check_recording
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.recordings.load import load_recording

RESULT = Path(__file__).resolve().parent / "results" / "altered_drives.json"
ROBOT = "warthog"
OPTIONS = ("--names-only",)

REAL_BANK = CHECKOUT / "ddagr_gym" / "data" / "null_bank_warthog.json"
"""Thresholds from ordinary Warthog drives."""

WINDOWS = ("--stride", "8")
"""One window in four of drives of ten minutes is enough."""

LIMIT = 1800.0
"""Of one run [s]."""


def altered_files(folder: Path, to: Path, limit: int | None) -> Iterator[tuple[str, Change, Path]]:
    """Write the altered drives, all drives of a change after each other.

    Args:
        folder: of the open drives.
        to: where.
        limit: on how many; None for all.
    """
    for number, (change, drive) in enumerate((change, drive) for change in CHANGES for drive in DRIVES):
        if limit is not None and number >= limit:
            return
        content = packed(change.write(read_table(folder / f"{drive}.csv.gz")))
        digest = hashlib.sha256(content + REAL_BANK.read_bytes()).hexdigest()[:12]
        path = to / f"{drive}_{change.name}_{digest}.csv.gz"
        path.write_bytes(content)
        yield drive, change, path


def answer_of(path: Path, parts: Path, threads: int) -> dict[str, Any]:
    """What the diagnosis says of a file, and what its checks suspect; from its part where that is there.

    Args:
        path: of the altered drive.
        parts: folder of finished answers.
        threads: of the simulator.
    """
    arguments = (str(path), "--robot", ROBOT, *UNKNOWN_GROUND, *WINDOWS, "--thresholds", str(REAL_BANK))
    answer = diagnose(Case(path.name.split(".", 1)[0], arguments, OPTIONS), parts, threads, LIMIT)
    report = check_recording(load_recording(path, None, ROBOT), np.random.default_rng(0))
    return {**answer, "suspects": sorted({name for finding in report.suspicious for name in finding.suspects})}


def scored(drive: str, change: Change, answer: Mapping[str, Any], control: Mapping[str, Any]) -> dict[str, Any]:
    """Entry of one case.

    Args:
        drive: name.
        change: that was written.
        answer: of the altered drive.
        control: answer of the drive as it is.
    """
    label = {"verdict": [change.effect]}
    truth = with_own(change, control)
    return {
        "drive": drive,
        "change": change.name,
        "effect": change.effect,
        "written": dict(change.truth),
        "truth": truth,
        "detectable": detectable(change, control),
        "verdict": answer["verdict"],
        "right": right(label, answer),
        "named": change.effect in answer["verdict"],
        "in_set": change.effect in answer["verdict"] or in_set(label, answer),
        "suspected_by_checks": change.effect in answer["suspects"],
        "suspects_of_checks": answer["suspects"],
        "found": sizes(answer),
        "equivalence": [finding["equivalence_set"] for finding in answer["findings"]],
        "covered": covered(change.effect, truth, answer),
        "complete": answer["complete"],
        "seconds": answer["seconds"],
        "commit": answer["commit"],
        "options": answer["options"],
        **({"failure": answer["failure"]} if "failure" in answer else {}),
    }


def with_own(change: Change, control: Mapping[str, Any]) -> dict[str, float]:
    """Sizes that are to be found: those that were written, and beyond neutral what the control names of its own."""
    own = sizes(control).get(change.effect, {}) if change.effect in control["verdict"] else {}
    return {
        name: value + (own[name]["value"] - _neutral(change.effect, name) if name in own else 0.0)
        for name, value in change.truth.items()
    }


def _neutral(effect: str, name: str) -> float:
    return float(effect_kind(effect).parameter(name).metadata["neutral"])


def detectable(change: Change, control: Mapping[str, Any]) -> bool | None:
    """Whether one of the sizes reaches what the control says it can show; always without a size, None for nothing."""
    if change is CONTROL:
        return None
    return is_detectable(change.effect, change.truth, control.get("detectable") or {})


def covered(effect: str, truth: Mapping[str, float], answer: Mapping[str, Any]) -> dict[str, bool]:
    """By field, whether the 90 % interval holds the truth; empty where the effect is not named."""
    found = sizes(answer).get(effect, {}) if effect in answer["verdict"] else {}
    stated = {name: found[name]["interval"] for name in truth if name in found and found[name]["interval"]}
    return {name: low <= truth[name] <= high for name, (low, high) in stated.items()}


def figures(cases: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Shares with their intervals, and the cases that went wrong.

    Args:
        cases: entries of :func:`scored`.
    """
    controls = [case for case in cases if case["change"] == CONTROL.name]
    altered = [case for case in cases if case["change"] != CONTROL.name]
    shown = [case for case in altered if case["detectable"]]
    return {
        "controls_not_none": share([case["verdict"] != ["none"] for case in controls]),
        **{f"{test}_all": share([case[test] for case in altered]) for test in ("right", "named", "in_set")},
        **{f"{test}_detectable": share([case[test] for case in shown]) for test in ("right", "named", "in_set")},
        "noticed_all": share([case["verdict"] != ["none"] for case in altered]),
        "noticed_detectable": share([case["verdict"] != ["none"] for case in shown]),
        "suspected_by_checks_all": share([case["suspected_by_checks"] for case in altered]),
        "wrong_name_all": share([bool(names_of(case)) and not case["in_set"] for case in altered]),
        "sure_of_wrong_name_all": share(
            [bool(names_of(case)) and not case["in_set"] and case["complete"] for case in altered]
        ),
        "coverage": share([held for case in altered for held in case["covered"].values()]),
        "seconds": mean([float(case["seconds"]) for case in cases]),
        "failed_runs": share(["failure" in case for case in cases]),
        "failures": [dict(case) for case in cases if not case["right"]],
    }


def measured(folder: Path, parts: Path, threads: int, limit: int | None) -> list[dict[str, Any]]:
    """Diagnose and score the cases.

    Args:
        folder: of the open drives.
        parts: of finished answers.
        threads: of the simulator.
        limit: on how many; None for all.
    """
    controls: dict[str, dict[str, Any]] = {}
    cases = []
    with tempfile.TemporaryDirectory() as place:
        for drive, change, path in altered_files(folder, Path(place), limit):
            answer = answer_of(path, parts, threads)
            control = controls.setdefault(drive, answer)
            cases.append(scored(drive, change, answer, control))
            said = answer["verdict"] or answer["failure"]
            print(f"{len(cases)} {drive}, {change.words}: {said} ({answer['seconds']:.0f} s)", flush=True)
    return cases


def main(arguments: Sequence[str] | None = None) -> int:
    """Diagnose the altered drives, write the result and its picture; 2 without the drives, 130 when interrupted."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, default=RESULT, help="JSON; the picture has the same name")
    parser.add_argument(
        "--parts", type=Path, default=None, help="folder of finished cases; beside the output if absent"
    )
    parser.add_argument(
        "--limit", type=int, default=None, help="the first cases only, the three controls before others"
    )
    parser.add_argument("--threads", type=int, default=1, help="of the simulator")
    given = parser.parse_args(arguments)
    if given.threads < 1 or (given.limit is not None and given.limit < 1):
        parser.error("--threads and --limit must be at least 1")
    folder = Path(os.environ.get("DDAGR_RECORDINGS") or shared() / "recordings") / "open"
    if not all((folder / f"{drive}.csv.gz").is_file() for drive in DRIVES):
        print(f"no open drives in {folder}: set DDAGR_SHARED or DDAGR_RECORDINGS", file=sys.stderr)
        return 2
    parts = given.parts or given.output.with_suffix(".parts")
    parts.mkdir(parents=True, exist_ok=True)
    try:
        cases = measured(folder, parts, given.threads, given.limit)
    except (InterruptedRunError, KeyboardInterrupt):
        print(f"interrupted; the same command goes on from {parts}", file=sys.stderr)
        return 130
    bank = hashlib.sha256(REAL_BANK.read_bytes()).hexdigest()
    result = {**figures(cases), "steps": STEPS, "bank_sha256": bank, "cases": cases}
    write_atomically(given.output, lambda to: to.write_text(json.dumps(result, indent=1, allow_nan=False) + "\n"))
    draw(cases, given.output.with_suffix(".png"))
    for name, entry in result.items():
        if isinstance(entry, dict) and entry.get("value") is not None:
            print(figure_line(name, entry))
    return 0


if __name__ == "__main__":
    sys.exit(main())
