"""What the tasks of ``benchmarks.cluster_faults`` do; workers import it by name."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import numpy as np

BEGUN = "begun.txt"
"""Line for each begin of a task, in the folder of marks."""
ENDED = "ended.txt"
"""Line for each end that a task reached."""


def case(folder: str, number: int, seconds: float) -> list[float]:
    """Eight numbers by a seed, whose last bits depend on the order of operations.

    Args:
        folder: of marks.
        number: seed.
        seconds: that the task takes at least.
    """
    _mark(folder, BEGUN, number)
    time.sleep(seconds)
    drawn = np.random.default_rng(number).standard_normal((120, 120))
    found = [float(x) for x in np.linalg.solve(drawn @ drawn.T + np.eye(120), drawn[0])[:8]]
    _mark(folder, ENDED, number)
    return found


def _mark(folder: str, name: str, number: int) -> None:
    with (Path(folder) / name).open("a") as file:
        file.write(f"{number}\n")


def kills_its_worker_once(folder: str, number: int, seconds: float) -> list[float]:
    """:func:`case`, whose worker is killed in the first attempt."""
    mark = Path(folder) / f"killed_{number}"
    if not mark.exists():
        mark.touch()
        _mark(folder, BEGUN, number)
        os.kill(os.getpid(), signal.SIGKILL)
    return case(folder, number, seconds)


def raises(folder: str, number: int, seconds: float) -> list[float]:
    """A task that fails."""
    raise ZeroDivisionError("a wheel of radius 0")


def takes_memory(folder: str, number: int, seconds: float) -> list[float]:
    """A task of 8 GiB."""
    return [float(np.ones(2**30).sum())]
