"""Real drives into which a known change was written: does the absolute question name it, and how large?

    python -m benchmarks.altered_drives [--drives NAME ...] [--changes NAME ...] [--parts DIR] [--output FILE]

The open drives of ``shared/recordings`` are ordinary. A copy of each is altered in one thing that goes wrong with
recordings (a clock that is late, a scaled encoder, a turned IMU, a gyro with another sensitivity or sign) and goes
through ``ddagr diagnose --names-only`` as a user's who has a data sheet of the robot and no calibration. The changes
are arithmetic on the columns of the file and share no code with the effects or the diagnosis. Their sizes are those
that a field engineer meets; they were fixed before the first run and are not tuned to what is found.

The drives have delays, biases and a mounting of their own, which the data sheet lacks: what is told of the unaltered
drive is no alarm. A change counts as named where its effect is, alone or in a set of at most three; where that is told
of the unaltered drive too, only if its size has moved by half of what was written, at least. Its own size then counts
as part of the truth. Another name is one that is neither told of the unaltered drive nor a part of the drivetrain.

Copies lie in a temporary folder while they are diagnosed. Finished cases are kept in the folder of parts, under a hash
of the altered file; the same command goes on from there, and several with different drives may share the folder. A part
is not made anew when the diagnosis itself was changed: then remove the folder.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.altered_changes import ABSOLUTE, CONTROL, DRIVES, ROBOT, Change, packed, read_table
from benchmarks.altered_figure import draw
from benchmarks.answers.run_diagnoses import UNKNOWN_GROUND, Case, InterruptedRunError, diagnose, shared
from benchmarks.concealed_truth import sizes
from benchmarks.score_concealed import figure_line, mean, names_of, share
from ddagr_gym.diagnosis.answer.drivetrain import PART_TITLES
from ddagr_gym.files import write_json
from ddagr_gym.physics.effects.registry import effect_kind
from ddagr_gym.recordings.checks.run import check_recording
from ddagr_gym.recordings.load import load_recording

RESULT = Path(__file__).resolve().parent / "results" / "altered_drives.json"
OPTIONS = ("--names-only",)

OF_PART = {"command_delay": {"delay": "command_delay"}}
"""What the fields of an effect are called where a part of the drivetrain has its name."""

MOVED = 0.5
"""Share of what was written by which a size that the unaltered drive has too must move, at least (ours)."""

LARGEST_SET = 3
"""Of names that stand for one finding where that counts as told."""

LIMIT = 3600.0
"""Of one run [s]."""


def altered_files(
    folder: Path, to: Path, drives: Sequence[str], changes: Sequence[str]
) -> Iterator[tuple[str, Change, Path]]:
    """Write the altered drives, the unaltered one of each first.

    Args:
        folder: of the open drives.
        to: where.
        drives: names of the drives.
        changes: names of the changes; the control is always among them.
    """
    for drive in drives:
        for change in (CONTROL, *(ABSOLUTE[name] for name in changes if name != CONTROL.name)):
            content = packed(change.write(read_table(folder / f"{drive}.csv.gz")))
            path = to / f"{drive}_{change.name}_{hashlib.sha256(content).hexdigest()[:12]}.csv.gz"
            path.write_bytes(content)
            yield drive, change, path


def answer_of(path: Path, parts: Path, threads: int) -> dict[str, Any]:
    """What the diagnosis says of a file, and what its checks suspect; from its part where that is there.

    Args:
        path: of the altered drive.
        parts: folder of finished answers.
        threads: of the simulator.
    """
    arguments = (str(path), "--robot", ROBOT, *UNKNOWN_GROUND)
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
    truth = with_own(change, control)
    return {
        "drive": drive,
        "change": change.name,
        "effect": change.effect,
        "written": dict(change.truth),
        "truth": truth,
        "verdict": answer["verdict"],
        "named": named(change, answer, control),
        "others": others(change, answer, control),
        "suspected_by_checks": change.effect in answer["suspects"],
        "suspects_of_checks": answer["suspects"],
        "found": sizes_of(change, answer),
        "covered": covered(change, truth, answer),
        "complete": answer["complete"],
        "explained": (answer.get("drivetrain") or {}).get("explained"),
        "seconds": answer["seconds"],
        "commit": answer["commit"],
        "options": answer["options"],
        **({"failure": answer["failure"]} if "failure" in answer else {}),
    }


def others(change: Change, answer: Mapping[str, Any], control: Mapping[str, Any]) -> list[str]:
    """Names that are neither the change nor told of the unaltered drive nor parts of the drivetrain."""
    expected = {told_as(change, answer), *control["verdict"], *PART_TITLES}
    return [name for name in names_of(answer) if name not in expected]


def told_as(change: Change, answer: Mapping[str, Any]) -> str | None:
    """Name under which an answer tells a change: its effect, else the first of a small set that holds it."""
    if change.effect in answer["verdict"]:
        return change.effect
    sets = {finding["name"]: finding.get("equivalence_set", ()) for finding in answer["findings"]}
    held = [name for name, names in sets.items() if change.effect in names and len(names) <= LARGEST_SET]
    return next((name for name in held if name in answer["verdict"]), None)


def sizes_of(change: Change, answer: Mapping[str, Any]) -> dict[str, Any]:
    """What an answer says of the fields of a change, with intervals; empty where it does not tell it."""
    told = sizes(answer).get(told_as(change, answer) or "", {})
    called = {name: OF_PART.get(change.effect, {}).get(name, name) for name in change.truth}
    return {
        name: told[name if name in told else other] for name, other in called.items() if name in told or other in told
    }


def with_own(change: Change, control: Mapping[str, Any]) -> dict[str, float]:
    """Sizes that are to be found: those that were written, and beyond neutral what the control names of its own."""
    own = sizes_of(change, control)
    return {
        name: value + (own[name]["value"] - neutral(change, name) if name in own else 0.0)
        for name, value in change.truth.items()
    }


def neutral(change: Change, name: str) -> float:
    """Value of a field of a change's effect at which nothing acts."""
    return float(effect_kind(change.effect).parameter(name).metadata["neutral"])


def named(change: Change, answer: Mapping[str, Any], control: Mapping[str, Any]) -> bool:
    """Whether the change is told: its effect, with a size that moved where the unaltered drive has one too."""
    if change is CONTROL:
        return not others(change, answer, control)
    found, own = sizes_of(change, answer), sizes_of(change, control)
    if told_as(change, answer) is None or not own:
        return told_as(change, answer) is not None
    return any(
        abs(found[name]["value"] - own[name]["value"]) >= MOVED * abs(value - neutral(change, name))
        for name, value in change.truth.items()
        if name in found and name in own and value != neutral(change, name)
    )


def covered(change: Change, truth: Mapping[str, float], answer: Mapping[str, Any]) -> dict[str, bool]:
    """By field, whether the 90 % interval holds the truth; empty where the effect is not named or none is stated."""
    stated = {name: item["interval"] for name, item in sizes_of(change, answer).items() if item["interval"]}
    return {name: low <= truth[name] <= high for name, (low, high) in stated.items()}


def figures(cases: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Shares with their intervals, and the cases that went wrong.

    Args:
        cases: entries of :func:`scored`.
    """
    altered = [case for case in cases if case["change"] != CONTROL.name]
    return {
        "named": share([case["named"] for case in altered]),
        "named_or_suspected": share([case["named"] or case["suspected_by_checks"] for case in altered]),
        "suspected_by_checks": share([case["suspected_by_checks"] for case in altered]),
        "other_name": share([bool(case["others"]) for case in altered]),
        "sure_of_other_name": share([bool(case["others"]) and case["complete"] for case in altered]),
        "coverage": share([held for case in altered for held in case["covered"].values()]),
        "seconds": mean([float(case["seconds"]) for case in cases]),
        "failed_runs": share(["failure" in case for case in cases]),
        "missed": [f"{case['drive']} {case['change']}" for case in altered if not case["named"]],
    }


def measured(folder: Path, parts: Path, given: argparse.Namespace) -> list[dict[str, Any]]:
    """Diagnose and score the cases.

    Args:
        folder: of the open drives.
        parts: of finished answers.
        given: drives, changes and threads.
    """
    controls: dict[str, dict[str, Any]] = {}
    cases = []
    with tempfile.TemporaryDirectory() as place:
        for drive, change, path in altered_files(folder, Path(place), given.drives, given.changes):
            answer = answer_of(path, parts, given.threads)
            control = controls.setdefault(drive, answer)
            cases.append(scored(drive, change, answer, control))
            said = answer["verdict"] or answer["failure"]
            print(f"{len(cases)} {drive}, {change.words}: {said} ({answer['seconds']:.0f} s)", flush=True)
    return cases


def main(arguments: Sequence[str] | None = None) -> int:
    """Diagnose the altered drives, write the result and its picture; 2 without the drives, 130 when interrupted."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, default=RESULT, help="JSON; the picture has the same name")
    parser.add_argument("--parts", type=Path, help="folder of finished cases; beside the output if absent")
    parser.add_argument("--drives", nargs="+", choices=DRIVES, default=list(DRIVES), metavar="NAME")
    parser.add_argument("--changes", nargs="+", choices=list(ABSOLUTE), default=list(ABSOLUTE), metavar="NAME")
    parser.add_argument("--threads", type=int, default=1, help="of the simulator")
    given = parser.parse_args(arguments)
    if given.threads < 1:
        parser.error("--threads must be at least 1")
    folder = Path(os.environ.get("DDAGR_RECORDINGS") or shared() / "recordings") / "open"
    if not all((folder / f"{drive}.csv.gz").is_file() for drive in given.drives):
        print(f"no open drives in {folder}: set DDAGR_SHARED or DDAGR_RECORDINGS", file=sys.stderr)
        return 2
    parts = given.parts or given.output.with_suffix(".parts")
    parts.mkdir(parents=True, exist_ok=True)
    try:
        cases = measured(folder, parts, given)
    except (InterruptedRunError, KeyboardInterrupt):
        print(f"interrupted; the same command goes on from {parts}", file=sys.stderr)
        return 130
    result = {**figures(cases), "cases": cases}
    write_json(given.output, result)
    draw(cases, given.output.with_suffix(".png"))
    for name, entry in result.items():
        if isinstance(entry, dict) and entry.get("value") is not None:
            print(figure_line(name, entry))
    return 0


if __name__ == "__main__":
    sys.exit(main())
