"""Time and memory of ``ddagr diagnose`` on drives of 10, 20, 40 and 120 minutes.

    python -m benchmarks.long_drives FOLDER [--minutes 10 20 40 120] [--threads 2] [--output FILE]

The drives are joined from two ordinary ones of a Warthog on sand (10 min each, in ``shared/recordings``), one after the
other; longer ones repeat them. Each is diagnosed by the command in a process of its own, page included, without a
calibration. FOLDER gets drives and pages; a length that has been run is not run again. Writes ``long_drives.json`` and
``long_drives.png``: seconds of the clock and of the processors, largest resident memory, and the ratio of each to the
first length. Nothing else should run.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle, islice
from pathlib import Path
from typing import Any

from benchmarks.altered_changes import Table, packed, read_table
from benchmarks.real_drives.__main__ import recordings_folder
from ddagr_gym.files import make_folder, write_bytes, write_json
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

RESULT = Path(__file__).resolve().parent / "results" / "long_drives.json"
DRIVES = ("open/warthog_sand", "concealed/warthog_5")
MINUTES_OF_ONE = 10
"""Of each of the drives."""

COMMAND = (
    "diagnose", "--robot", "warthog", "--map", "drive_steps", "--soil", "lete_sand_wong", "--soil-uncertainty", "4",
)  # fmt: skip
AIMS = {"seconds of 10 min": 120.0, "GiB of 120 min": 2.0}
WHOLE = sys.maxsize


@dataclass(frozen=True)
class Cost:
    """Of one diagnosis.

    Attributes:
        minutes: of the drive.
        seconds: of the clock.
        processor_seconds: of all threads and children.
        gibibytes: largest resident memory.
    """

    minutes: int
    seconds: float
    processor_seconds: float
    gibibytes: float


def joined(tables: Sequence[Table]) -> Table:
    """One drive of several in steps, whose numbers go on from one to the next."""
    whole: dict[str, list[str]] = {name: [] for name in tables[0]}
    for table in tables:
        steps = 1 + max((int(step) for step in whole["seq"]), default=-1)
        for name, column in table.items():
            whole[name] += [str(int(step) + steps) for step in column] if name == "seq" else list(column)
    return whole


def drive_of(minutes: int, folder: Path) -> Path:
    """File of a drive of so many minutes, written where it is not there."""
    path = folder / f"sand_{minutes}_min.csv.gz"
    if not path.is_file():
        tables = [read_table(recordings_folder() / f"{name}.csv.gz", WHOLE) for name in DRIVES]
        whole = joined(list(islice(cycle(tables), minutes // MINUTES_OF_ONE)))
        write_bytes(path, packed(whole))
    return path


def cost_of(minutes: int, folder: Path, threads: int) -> Cost:
    """Cost of the diagnosis of a drive, that of an earlier run where there is one.

    Raises:
        RuntimeError: the command failed.
    """
    kept = folder / f"{minutes}_min.json"
    if not kept.is_file():
        page = folder / f"{minutes}_min"
        write_json(kept, vars(_measured(minutes, [*COMMAND, str(drive_of(minutes, folder)), "-o", str(page)], threads)))
    return Cost(**json.loads(kept.read_text()))


def _measured(minutes: int, arguments: Sequence[str], threads: int) -> Cost:
    began = time.monotonic()
    command = [sys.executable, "-m", "ddagr_gym", *arguments, "--threads", str(threads), "--overwrite"]
    process = os.posix_spawn(sys.executable, command, os.environ)
    _, status, usage = os.wait4(process, 0)
    if os.waitstatus_to_exitcode(status) != 0:
        raise RuntimeError(f"{' '.join(command)}: exit code {os.waitstatus_to_exitcode(status)}.")
    seconds = time.monotonic() - began
    return Cost(minutes, seconds, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 2**20)


def draw(costs: Sequence[Cost], path: Path) -> None:
    """Time and memory by length, as PNG, all or nothing."""
    from matplotlib.figure import Figure

    minutes = [cost.minutes for cost in costs]
    with house_style():
        figure = Figure(figsize=(8.0, 3.2), layout="constrained")
        time_panel, memory_panel = figure.subplots(1, 2)
        time_panel.plot(minutes, [cost.seconds for cost in costs], "o-", color=palette.BLUE, label="clock")
        time_panel.plot(
            minutes, [cost.processor_seconds for cost in costs], "s--", color=palette.ORANGE, label="processors"
        )
        time_panel.set(ylabel="time of the diagnosis [s]", ylim=(0.0, None))
        time_panel.legend()
        memory_panel.plot(minutes, [cost.gibibytes for cost in costs], "o-", color=palette.BLUE)
        memory_panel.axhline(AIMS["GiB of 120 min"], color="black", linewidth=1.0, linestyle="--")
        memory_panel.set(ylabel="largest resident memory [GiB] (dashed: aim)", ylim=(0.0, None))
        for panel in (time_panel, memory_panel):
            panel.set_xlabel("length of the drive [min]")
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=120))


def result_of(costs: Sequence[Cost], threads: int) -> Mapping[str, Any]:
    """As it is written, with ratios to the shortest drive."""
    first = costs[0]
    rows = [
        {
            **vars(cost),
            "times_first": cost.seconds / first.seconds,
            "memory_times_first": cost.gibibytes / first.gibibytes,
        }
        for cost in costs
    ]
    return {"threads": threads, "aims": AIMS, "drives": rows}


def main(arguments: Sequence[str] | None = None) -> int:
    """Diagnose, measure, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="for drives and pages")
    parser.add_argument("--minutes", type=int, nargs="+", default=(10, 20, 40, 120))
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--output", type=Path, default=RESULT)
    given = parser.parse_args(arguments)
    wrong = [minutes for minutes in given.minutes if minutes <= 0 or minutes % MINUTES_OF_ONE]
    if wrong:
        parser.error(f"--minutes {wrong[0]}: give multiples of {MINUTES_OF_ONE}, the length of a drive")
    folder = make_folder(given.folder)
    costs = []
    for minutes in sorted(set(given.minutes)):
        costs.append(cost_of(minutes, folder, given.threads))
        print(f"{minutes} min: {costs[-1].seconds:.0f} s, {costs[-1].gibibytes:.2f} GiB", flush=True)
    write_json(given.output, result_of(costs, given.threads))
    draw(costs, given.output.with_suffix(".png"))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
