"""How short a real drive, and how small a delay, ``ddagr diagnose --calibration`` can be asked about.

    python -m benchmarks.change_limits CALIBRATION [--parts FOLDER] [--summary]

``CALIBRATION`` and the six ordinary drives of a Warthog are those of :mod:`benchmarks.what_changed`, and each drive is
again compared with the others alone. Asked are

* pieces of 90 s of every drive as it is: whatever is named, or called unknown, is a false alarm;
* drives whose sensors were written late against the commands, by 0.1 to 0.3 s, with their ground known and not.

Written are the answers and a picture (``benchmarks/results/change_limits.json``, ``.png``); a run goes on after the
cases in the folder of parts.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.altered_changes import CONTROL, Change, Table, late_sensors, numbers
from benchmarks.score_concealed import share
from benchmarks.what_changed import RESULT as CHANGES_RESULT
from benchmarks.what_changed import (
    Drive,
    answer,
    drives,
    is_right,
    is_sure_and_wrong,
    parser_of,
    run,
)
from ddagr_gym.diagnosis.change.ordinary import OrdinaryRobot
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

Array = NDArray[np.float64]

RESULT = CHANGES_RESULT.with_name("change_limits.json")
COMMAND = "python -m benchmarks.change_limits"
PIECE = 90.0
"""Length of a piece [s]."""
STEP = 6.0
"""Length of a step of a drive in steps [s]."""
KNOWN, UNKNOWN = "known", "unknown"
DELAYS = {KNOWN: (0.1, 0.15, 0.2), UNKNOWN: (0.3,)}
"""Delays by what is said of the ground [s]; the aims are 0.15 and 0.3 s."""


@dataclass(frozen=True)
class Question:
    """What is asked of an ordinary drive.

    Attributes:
        drive: that the rows are of, with the ground that is said.
        change: written into them.
        piece: number of the piece; None for all of the drive.
    """

    drive: Drive
    change: Change
    piece: int | None = None

    @property
    def name(self) -> str:
        """Of the file of the answer."""
        part = "" if self.piece is None else f" piece {self.piece}"
        return f"{self.drive.name.replace('/', '_')} {self.change.name} {self.drive.ground or UNKNOWN}{part}"

    def answer(self, ordinary: OrdinaryRobot, threads: int) -> dict[str, Any]:
        """What is said, as JSON has it; arguments as of :func:`benchmarks.what_changed.answer`."""
        drive = self.drive if self.piece is None else Piece(self.drive.name, self.drive.ground, self.piece)
        return {**answer(drive, self.change, ordinary, threads), "piece": self.piece}


@dataclass(frozen=True)
class Piece(Drive):
    """A part of a drive of :data:`PIECE` s.

    Attributes:
        number: from 0.
    """

    number: int

    @property
    def table(self) -> Table:
        """Rows of the piece."""
        whole = super().table
        kept = np.flatnonzero(piece_numbers(whole) == self.number).tolist()
        return {name: [values[row] for row in kept] for name, values in whole.items()}


def piece_numbers(table: Table) -> Array:
    """Number of the piece that each row is in; -1 in what is left at the end. Steps are not cut."""
    place = numbers(table, "seq") * STEP if "seq" in table else numbers(table, "t")
    ends = place.max() + (STEP if "seq" in table else 0.0)
    number = np.floor(place / PIECE)
    return np.where((number + 1.0) * PIECE <= ends, number, -1.0)


def late_by(seconds: float) -> Change:
    """Sensors that are so late [s]."""
    return Change(
        f"sensors_late_{1000.0 * seconds:.0f}_ms", f"sensors {seconds:g} s late", "command_delay", {"delay": seconds},
        partial(late_sensors, seconds=seconds),
    )  # fmt: skip


def questions() -> Iterator[Question]:
    """Pieces first."""
    for drive in drives().values():
        for number in range(int(piece_numbers(drive.table).max()) + 1):
            yield Question(drive, CONTROL, number)
    for ground, delays in DELAYS.items():
        for drive in drives().values():
            if ground == KNOWN and not drive.ground:
                continue
            said = drive if ground == KNOWN else Drive(drive.name, "")
            yield from (Question(said, late_by(delay)) for delay in delays)


def figures(cases: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Shares with 95 % intervals, of what was answered."""
    answered = [case for case in cases if "refused" not in case]
    pieces = [case for case in answered if case["piece"] is not None]
    found: dict[str, Any] = {
        "false alarms in pieces": share([not is_right(case) for case in pieces]),
        "sure and wrong in pieces": share([is_sure_and_wrong(case) for case in pieces]),
    }
    for ground, delays in DELAYS.items():
        for delay in delays:
            late = [case for case in answered if case["change"] == late_by(delay).name and said_of(case) == ground]
            found[f"delay of {delay:g} s, ground {ground}"] = share([is_right(case) for case in late])
    return found


def said_of(case: Mapping[str, Any]) -> str:
    """Whether the ground was known."""
    return KNOWN if case["ground"] else UNKNOWN


def draw(found: Mapping[str, Any], path: Path) -> None:
    """Shares with their intervals."""
    from matplotlib.figure import Figure

    names = [name for name, entry in found.items() if entry["count"]][::-1]
    with house_style():
        figure = Figure(figsize=(7.5, 1.0 + 0.4 * len(names)), layout="constrained")
        panel = figure.subplots()
        for row, name in enumerate(names):
            value, (low, high) = found[name]["value"], found[name]["interval"]
            colour = palette.BLUE if name.startswith("delay") else palette.VERMILLION
            panel.plot([low, high], [row, row], color=colour, lw=2.0)
            panel.plot(value, row, "o", color=colour, ms=6)
        panel.set_yticks(range(len(names)), [f"{name} (of {found[name]['count']})" for name in names])
        panel.set(xlim=(-0.02, 1.02), xlabel="share with its 95 % interval (alarms: small is good; delays: large)")
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=120))


def main(arguments: Sequence[str] | None = None) -> int:
    """Ask, score, draw."""
    given = parser_of(__doc__, RESULT).parse_args(arguments)

    def asked(ordinary: OrdinaryRobot) -> Iterator[tuple[str, Callable[[], dict[str, Any]]]]:
        return ((question.name, partial(question.answer, ordinary, given.threads)) for question in questions())

    return run(given, COMMAND, asked, figures, lambda found, cases, path: draw(found, path))


if __name__ == "__main__":
    sys.exit(main())
