"""Changes that begin in the middle of a real drive, and what ``ddagr diagnose --calibration`` says of them.

    python -m benchmarks.real_mid_drive CALIBRATION [--drives ...] [--changes ...] [--parts FOLDER] [--summary]

As :mod:`benchmarks.what_changed`, but what is written into a drive begins between a third and two thirds of it: a
mounting that slips, a gear that is worn, a clock that is set. Asked is what began and when. Written are the answers and
a picture (``benchmarks/results/real_mid_drive.json``, ``.png``); a run goes on after the cases in the folder of parts.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.altered_changes import CONTROL, Change, Table
from benchmarks.score_concealed import share
from benchmarks.what_changed import (
    ALL,
    Drive,
    answer,
    coverage_of,
    is_right,
    is_sure_and_wrong,
    parser_of,
    run_changes,
)
from ddagr_gym.diagnosis.answer.onset import BEGINS, STEPS
from ddagr_gym.diagnosis.change.ordinary import OrdinaryRobot
from ddagr_gym.recordings.schema import Recording

RESULT = Path(__file__).resolve().parent / "results" / "real_mid_drive.json"

CHANGES = (
    "late_poses", "late_sensors", "encoders_scaled", "encoder_scaled", "imu_turned", "imu_tilted", "gyro_scaled",
    "gyro_biased", "one_side_commanded",
)  # fmt: skip
"""Of :data:`benchmarks.what_changed.ALL`, those that can begin while a robot drives."""

EARLIEST, LATEST = 0.35, 0.65
"""Shares of a drive at which changes begin, the first of them earliest."""


def begins_at(change: str) -> float:
    """Share of the drive at which a change begins."""
    return EARLIEST + (LATEST - EARLIEST) * CHANGES.index(change) / (len(CHANGES) - 1)


def later(change: Change) -> Change:
    """A change that begins in the middle of the drive."""
    return replace(change, write=partial(_written_later, change=change, share=begins_at(change.name)))


def _written_later(table: Table, change: Change, share: float) -> Table:
    """Columns with a change in the rows from a share of the drive on."""
    first = round(share * len(table["t"]))
    altered = change.write(table)
    return {name: [*table[name][:first], *altered[name][first:]] for name in table}


def time_of(drive: Drive, change: Change) -> float:
    """When a change begins, by the first sample that it alters [s]."""
    return first_difference(drive.with_change(CONTROL), drive.with_change(change))


def first_difference(before: Recording, after: Recording) -> float:
    """Time of the first sample in which two recordings of the same rows differ [s].

    Raises:
        ValueError: they do not.
    """
    differs = np.zeros(len(before.t), dtype=bool)
    for name, values in before.channels.items():
        differs |= ~np.isclose(values, after.channels[name], rtol=1e-7, atol=1e-9, equal_nan=True)
    if not differs.any():
        raise ValueError("the change alters no sample")
    return float(before.t[np.argmax(differs)])


def ask(drive: Drive, name: str, ordinary: OrdinaryRobot, threads: int) -> dict[str, Any]:
    """What is said of a drive in which a change begins, and when it does.

    Args:
        drive: ordinary but for the change.
        name: of the change.
        ordinary: the robot calibrated with all drives.
        threads: of the simulator.
    """
    change = later(ALL[name])
    said = answer(drive, change, ordinary, threads)
    return said if "refused" in said else {**said, "begins": time_of(drive, change)}


def onset_of(case: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """How the size of the true effect goes with time, where it was named."""
    found: Mapping[str, Any] | None = case.get("onsets", {}).get(case["truth"])
    return found


def is_told_to_begin(case: Mapping[str, Any]) -> bool:
    """Whether the true effect is said to begin, or to become another one, at a time of the drive."""
    found = onset_of(case)
    return found is not None and found["kind"] in (BEGINS, STEPS)


def figures(cases: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Shares with 95 % intervals over the answers."""
    begun = [case for case in cases if is_told_to_begin(case)]
    intervals = [(onset_of(case) or {})["interval"] for case in begun]
    return {
        "right or in a set of at most three": share([is_right(case) for case in cases]),
        "sure and wrong": share([is_sure_and_wrong(case) for case in cases]),
        "effect named, alone or among others": share([case["truth"] in case.get("verdict", ()) for case in cases]),
        "said to begin in mid-drive": share([is_told_to_begin(case) for case in cases]),
        "time inside its interval": share(
            [low <= case["begins"] <= high for case, (low, high) in zip(begun, intervals, strict=True)]
        ),
        "intervals that hold the size": share([held for case in begun for held in coverage_of(case)]),
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """Write, compare, score."""
    parser = parser_of(__doc__, RESULT)
    return run_changes(parser, arguments, "python -m benchmarks.real_mid_drive", CHANGES, ask, figures)


if __name__ == "__main__":
    sys.exit(main())
