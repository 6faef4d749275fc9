"""Changes written into real drives, and what ``ddagr diagnose --calibration`` says of them.

    python -m benchmarks.what_changed CALIBRATION [--drives ...] [--changes ...] [--parts FOLDER] [--summary]

``CALIBRATION`` is the folder that ``ddagr calibrate`` wrote of the six ordinary drives of a Warthog
(:data:`benchmarks.real_drives.__main__.DRIVES`), imported or not. Each drive is compared with the others alone: with
the robot and the soil as calibrated without it (one Gauss-Newton step from the joint fit), and with the scatter of the
other five. The ground is given as known where another ordinary drive was on it.

Changes are arithmetic on the columns of the files (:mod:`benchmarks.altered_changes`) and share no code with effects or
diagnosis. One of them is no effect of the library: exchanged encoders, which are seen in the values and named.
Written are the answers and a picture (``benchmarks/results/what_changed.json``, ``.png``); a run goes on after the
cases in the folder of parts.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.altered_changes import ALL, ROBOT, Change, Table, packed, read_table
from benchmarks.real_drives.__main__ import DRIVES, recordings_folder
from benchmarks.score_concealed import names_of, share
from ddagr_gym.calibration.ordinary_robot import load_ordinary_robot
from ddagr_gym.diagnosis.answer.verdict import NONE, Diagnosis
from ddagr_gym.diagnosis.change.ordinary import OrdinaryRobot
from ddagr_gym.diagnosis.change.run import what_changed
from ddagr_gym.errors import InputError
from ddagr_gym.files import write_json
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.recordings.load import load_recording
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

RESULT = Path(__file__).resolve().parent / "results" / "what_changed.json"
REVERSED = "concealed/warthog_4"
"""Whose gyro turns the wrong way; it is turned before anything is written into the drive."""


MOST_IN_SET = 3
"""Names of a set that still is an answer."""

WHOLE = sys.maxsize
"""Steps of a drive that are kept."""


@dataclass(frozen=True)
class Drive:
    """An ordinary drive.

    Attributes:
        name: below ``shared/recordings``.
        ground: that it was on; "" where no other ordinary drive was on it.
    """

    name: str
    ground: str

    @property
    def file(self) -> str:
        """Name of its file, by which a calibration knows it."""
        return f"{Path(self.name).name}.csv.gz"

    @property
    def table(self) -> Table:
        """Columns of its file."""
        table = read_table(recordings_folder() / f"{self.name}.csv.gz", WHOLE)
        return ALL["gyro_reversed"].write(table) if self.name == REVERSED else table

    def with_change(self, change: Change) -> Recording:
        """The drive with a change, read from a file as a user's."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / self.file
            path.write_bytes(packed(change.write(self.table)))
            return load_recording(path, DRIVES[self.name][1], ROBOT)


def drives() -> dict[str, Drive]:
    """Ordinary drives by name."""
    grounds = [ground for ground, _ in DRIVES.values()]
    return {
        name: Drive(name, ground if grounds.count(ground) > 1 else "") for name, (ground, _) in DRIVES.items()
    }  # fmt: skip


def answer(drive: Drive, change: Change, ordinary: OrdinaryRobot, threads: int) -> dict[str, Any]:
    """What is said of a drive with a change, as JSON has it.

    Args:
        drive: ordinary but for the change.
        change: that was written.
        ordinary: the robot calibrated with all drives.
        threads: of the simulator.
    """
    entry: dict[str, Any] = {"drive": drive.name, "change": change.name, "truth": change.effect}
    try:
        outcome = what_changed([drive.with_change(change)], ordinary.without(drive.file), drive.ground, threads=threads)
    except InputError as error:
        return {**entry, "refused": str(error)}
    return {**entry, "ground": drive.ground, **_said(outcome.diagnosis, change)}


def _said(diagnosis: Diagnosis, change: Change) -> dict[str, Any]:
    named = {finding.name: finding for finding in diagnosis.findings}
    least = diagnosis.detectable.get(change.effect, {})
    return {
        "verdict": list(diagnosis.verdict),
        "complete": diagnosis.complete,
        "sets": [sorted(finding.equivalence_set) for finding in diagnosis.findings],
        "sizes": {
            name: {key: [item.value, *(item.interval or (None, None))] for key, item in finding.parameters.items()}
            for name, finding in named.items()
        },
        "onsets": {
            name: {"kind": item.onset.kind, "value": item.onset.value, "interval": item.onset.interval}
            for name, item in named.items()
            if item.onset is not None
        },
        "least_detectable": {name: least.get(name) for name in change.truth},
        "checks": sorted({f"{doubt.finding}: {doubt.sentence}" for doubt in diagnosis.checks}),
        "seconds": round(diagnosis.seconds, 1),
    }


def is_right(case: Mapping[str, Any]) -> bool:
    """Whether the truth is the only name, or in a set of at most three; see the module for what is no effect."""
    truth = case["truth"]
    if truth == NONE:
        return bool(case.get("verdict") == [NONE])
    sets = case.get("sets", ())
    return len(sets) == 1 and truth in sets[0] and len(sets[0]) <= MOST_IN_SET


def is_sure_and_wrong(case: Mapping[str, Any]) -> bool:
    """Whether a complete answer names something and the truth is in none of its sets; of no change, any name."""
    sure = bool(case.get("complete")) and bool(names_of(case))
    return sure and not any(case["truth"] in found for found in case["sets"])


def coverage_of(case: Mapping[str, Any]) -> list[bool]:
    """Whether intervals of the named true effect hold what was written."""
    truth = ALL[case["change"]].truth
    found = case.get("sizes", {}).get(case["truth"], {})
    return [
        found[name][1] <= value <= found[name][2] for name, value in truth.items() if found.get(name, [None] * 3)[1:][0]
    ]


def figures(cases: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Shares with 95 % intervals over the answers."""
    written = [case for case in cases if case["truth"] != NONE]
    return {
        "right or in a set of at most three": share([is_right(case) for case in written]),
        "ordinary drives with a name or unknown": share([not is_right(c) for c in cases if c["truth"] == NONE]),
        "sure and wrong": share([is_sure_and_wrong(case) for case in cases]),
        "intervals that hold the size": share([held for case in cases for held in coverage_of(case)]),
        "effect named, alone or among others": share([case["truth"] in case.get("verdict", ()) for case in written]),
    }


def draw(cases: Sequence[Mapping[str, Any]], path: Path) -> None:
    """What was said, as a table of changes by drives."""
    from matplotlib.figure import Figure

    names = [name for name in ALL if any(case["change"] == name for case in cases)]
    columns = [name for name in DRIVES if any(case["drive"] == name for case in cases)]
    with house_style():
        figure = Figure(figsize=(2.6 + 2.1 * len(columns), 1.2 + 0.5 * len(names)), layout="constrained")
        panel = figure.subplots()
        for case in cases:
            x, y = columns.index(case["drive"]), names.index(case["change"])
            colour = (
                palette.GREEN if is_right(case) else palette.VERMILLION if is_sure_and_wrong(case) else palette.PALE
            )
            panel.add_patch(_cell(x, y, colour))
            panel.text(x, y, _words(case), ha="center", va="center", fontsize=6.5)
        panel.set_xticks(range(len(columns)), [f"{DRIVES[name][0]}\n{Path(name).name}" for name in columns])
        panel.set_yticks(range(len(names)), [ALL[name].words for name in names])
        panel.set(xlim=(-0.5, len(columns) - 0.5), ylim=(len(names) - 0.5, -0.5))
        panel.grid(visible=False)
        panel.tick_params(length=0)
        panel.set_title("Right (green), sure and wrong (orange), neither (grey)")
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=120))


def _cell(x: float, y: float, colour: str) -> Any:
    from matplotlib.patches import Rectangle

    return Rectangle((x - 0.48, y - 0.46), 0.96, 0.92, color=colour, alpha=0.45, lw=0)


def _words(case: Mapping[str, Any]) -> str:
    if "refused" in case:
        return "refused"
    said = "\n".join(name.replace("_", " ") for name in case["verdict"])
    return said if case["complete"] else f"{said} …"


def parser_of(description: str | None, result: Path) -> argparse.ArgumentParser:
    """Options of a benchmark that asks about drives against a calibration.

    Args:
        description: of the command.
        result: file of its figures.
    """
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("calibration", type=Path, help="folder that `ddagr calibrate` wrote")
    parser.add_argument("--parts", type=Path, default=result.with_suffix(".parts"), help="folder of finished cases")
    parser.add_argument("--output", type=Path, default=result)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--summary", action="store_true", help="only the score of the cases that are finished")
    return parser


def answered(
    questions: Iterable[tuple[str, Callable[[], dict[str, Any]]]], folder: Path, ask: bool
) -> list[dict[str, Any]]:
    """Answers, each kept in a folder as it is made, so that a run goes on after those that are there.

    Args:
        questions: name of the answer's file, and what makes it.
        folder: of the answers.
        ask: whether missing ones are made; else they are left out.
    """
    found = []
    for name, make in questions:
        part = folder / f"{name}.json"
        if not part.exists() and ask:
            part.parent.mkdir(parents=True, exist_ok=True)
            write_json(part, make())
        if part.exists():
            found.append(json.loads(part.read_text()))
            print(name, found[-1].get("verdict", "refused"), found[-1].get("seconds", ""), flush=True)
    return found


def write_figures(path: Path, command: str, scored: Mapping[str, Any], cases: Sequence[Mapping[str, Any]]) -> None:
    """Write the figures of cases with these, and print them.

    Args:
        path: of the JSON file.
        command: that makes it.
        scored: figures by name.
        cases: answers.
    """
    write_json(path, {"command": command, "figures": scored, "cases": cases})
    for name, entry in scored.items():
        print(f"{name}: {entry['value']} {entry['interval']} of {entry['count']}")


def run(
    given: argparse.Namespace,
    command: str,
    questions: Callable[[OrdinaryRobot], Iterable[tuple[str, Callable[[], dict[str, Any]]]]],
    score: Callable[[Sequence[Mapping[str, Any]]], dict[str, Any]],
    picture: Callable[[dict[str, Any], Sequence[Mapping[str, Any]], Path], None],
) -> int:
    """Ask, score, draw; returns the exit code.

    Args:
        given: options of :func:`parser_of`.
        command: that does it.
        questions: about a calibrated robot, as of :func:`answered`.
        score: figures of answers.
        picture: draws figures and answers to a file.
    """
    try:
        ordinary = load_ordinary_robot(given.calibration)
    except InputError as error:
        print(f"{error}", file=sys.stderr)
        return 2
    cases = answered(questions(ordinary), given.parts / ordinary.digest[:12], not given.summary)
    found = score(cases)
    write_figures(given.output, command, found, cases)
    picture(found, cases, given.output.with_suffix(".png"))
    return 0


def run_changes(
    parser: argparse.ArgumentParser,
    arguments: Sequence[str] | None,
    command: str,
    changes: Sequence[str],
    ask: Callable[[Drive, str, OrdinaryRobot, int], dict[str, Any]],
    score: Callable[[Sequence[Mapping[str, Any]]], dict[str, Any]],
) -> int:
    """The same with changes of ordinary drives, of which the command line chooses.

    Args:
        parser: of :func:`parser_of`.
        arguments: of the command line.
        command: see :func:`run`.
        changes: names of :data:`ALL`.
        ask: what is said of a drive with a change, of a robot, on so many threads.
        score: see :func:`run`.
    """
    parser.add_argument("--drives", nargs="+", choices=tuple(DRIVES), default=tuple(DRIVES))
    parser.add_argument("--changes", nargs="+", choices=changes, default=changes)
    given = parser.parse_args(arguments)
    by_name = drives()

    def questions(ordinary: OrdinaryRobot) -> Iterable[tuple[str, Callable[[], dict[str, Any]]]]:
        return (
            (f"{drive.replace('/', '_')} {change}", partial(ask, by_name[drive], change, ordinary, given.threads))
            for change in given.changes
            for drive in given.drives
        )

    return run(given, command, questions, score, lambda found, cases, path: draw(cases, path))


def main(arguments: Sequence[str] | None = None) -> int:
    """Write, compare, score."""

    def ask(drive: Drive, name: str, ordinary: OrdinaryRobot, threads: int) -> dict[str, Any]:
        return answer(drive, ALL[name], ordinary, threads)

    parser = parser_of(__doc__, RESULT)
    return run_changes(parser, arguments, "python -m benchmarks.what_changed", tuple(ALL), ask, figures)


if __name__ == "__main__":
    sys.exit(main())
