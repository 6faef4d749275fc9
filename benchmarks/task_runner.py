"""Tasks a second through the runner, and its share of the time.

    python -m benchmarks.task_runner
    python -m benchmarks.task_runner --engines local ray --workers 1 2

A task sleeps, so that the processors are free for the runner and the figures do not depend on the machine's other work
more than they must. Overhead is the wall time over that of workers that are never idle, less one; starting the workers
is apart. Some tasks are run first, so that every worker is there. ``lost`` runs the runner alone, on an engine that
ends every task at once and loses one in a hundred: what a million tasks cost the driver.
``benchmarks/results/task_runner.json`` and ``.png`` have the figures.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import platform
import resource
import sys
import time
from collections import deque
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ddagr_gym.files import write_json
from ddagr_gym.progress import Progress
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style
from ddagr_gym.tasks import Limits, Task, TaskRunner, results_of
from ddagr_gym.tasks.engine import ThisProcess
from ddagr_gym.tasks.task import Failure, Outcome

RESULT = Path(__file__).resolve().parent / "results" / "task_runner.json"
LENGTHS = {0.05: 100, 1.0: 8, 30.0: 1}
"""Tasks for each worker, by their length [s]."""
LOST = 0.01


def nap(seconds: float) -> float:
    time.sleep(seconds)
    return seconds


class LosesSome(ThisProcess):
    """Engine that ends every task at once, and loses a share of them.

    Args:
        share: of the attempts.
        slots: tasks at once.
        seed: of the losses.
    """

    def __init__(self, share: float, slots: int, seed: int = 0) -> None:
        super().__init__(Limits())
        self.slots, self._share, self._rng = slots, share, np.random.default_rng(seed)
        self.lost = 0
        self._numbers: deque[tuple[int, Task]] = deque()

    def begin(self, number: int, task: Task) -> None:
        """Take a task."""
        self._numbers.append((number, task))

    def ended(self, seconds: float) -> list[tuple[int, Outcome]]:
        """All that were taken."""
        lost = self._rng.random(len(self._numbers)) < self._share
        self.lost += int(lost.sum())
        gone = Outcome(failure=Failure("lost", "the node is gone"))
        found = [
            (number, gone if away else Outcome(task.arguments[0]))
            for (number, task), away in zip(self._numbers, lost, strict=True)
        ]
        self._numbers.clear()
        return found


def measured(engine: str, workers: int, seconds: float, count: int) -> dict[str, Any]:
    """Figures of tasks of one length.

    Args:
        engine: "local" or "ray".
        workers: processes.
        seconds: of a task.
        count: tasks for each worker.
    """
    began = time.perf_counter()
    # a limit of time, so that one worker is a process as well
    with TaskRunner(workers, cluster="local" if engine == "ray" else "", limits=Limits(seconds=600.0)) as runner:
        results_of([Task(f"first {n}", nap, (0.5,)) for n in range(4 * workers)], runner)
        started = time.perf_counter()
        results_of([Task(f"{n}", nap, (seconds,)) for n in range(count * workers)], runner)
        wall = time.perf_counter() - started
    return {
        "engine": engine,
        "workers": workers,
        "task_seconds": seconds,
        "tasks": count * workers,
        "tasks_per_second": count * workers / wall,
        "overhead": wall / (seconds * count) - 1.0,
        "start_seconds": started - began - 2.0,
    }


def lost_tasks(count: int, slots: int = 64) -> dict[str, Any]:
    """Cost to the driver of many tasks of which some are lost.

    Args:
        count: tasks.
        slots: at once.
    """
    engine = LosesSome(LOST, slots)
    before, began = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.perf_counter()
    done = failed = 0
    with TaskRunner(engine=engine, limits=Limits(attempts=5)) as runner:
        for ended in runner.run(_many(count)):
            done += ended.value is not None
            failed += ended.failure is not None
    return {
        "tasks": count,
        "lost_attempts": engine.lost,
        "done": done,
        "failed": failed,
        "seconds": time.perf_counter() - began,
        "further_memory_MiB": (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024.0,
    }


def _many(count: int) -> Iterator[Task]:
    for number in range(count):
        yield Task(f"{number}", nap, (number,))


def draw(rows: Sequence[dict[str, Any]], path: Path) -> None:
    """Overhead by length of a task, a line an engine and number of workers, as PNG."""
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(6.4, 3.6), layout="constrained")
        axes = figure.subplots()
        colours = {"local": palette.BLUE, "ray": palette.GREY}
        groups = sorted({(row["engine"], row["workers"]) for row in rows})
        lengths = sorted({row["task_seconds"] for row in rows})
        for place, (engine, workers) in enumerate(groups):
            mine = {row["task_seconds"]: row for row in rows if (row["engine"], row["workers"]) == (engine, workers)}
            at = np.arange(len(lengths)) + 0.8 * ((place + 0.5) / len(groups) - 0.5)
            heights = [100.0 * mine[length]["overhead"] for length in lengths]
            label = f"{engine}, {workers} worker{'s' if workers > 1 else ''}"
            bars = axes.bar(at, heights, 0.7 / len(groups), color=colours[engine], alpha=1.0 / workers, label=label)
            axes.bar_label(bars, fmt="%.1f", fontsize=8)
        axes.axhline(5.0, color=palette.GREY, linewidth=0.8, linestyle=":", label="5 %")
        axes.set_xticks(np.arange(len(lengths)), [f"{length:g} s" for length in lengths])
        axes.set_xlabel("length of a task")
        axes.set_ylabel("time over that of busy workers [%]")
        figure.legend(loc="outside upper right", ncols=2)
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=120))


def main(words: Sequence[str] | None = None) -> int:
    """Command line; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--engines", nargs="+", choices=("local", "ray"), default=None)
    parser.add_argument("--workers", nargs="+", type=int, default=[1, 2, 4])
    parser.add_argument("--lost", type=int, default=1_000_000, help="tasks of the simulation with losses")
    parser.add_argument("--output", type=Path, default=RESULT)
    options = parser.parse_args(words)
    engines = options.engines or ["local", *(["ray"] if importlib.util.find_spec("ray") else [])]
    runs = [(e, w, s, n) for e in engines for w in options.workers for s, n in LENGTHS.items()]
    rows = []
    with Progress(len(runs), "running tasks") as progress:
        for run in runs:
            rows.append(measured(*run))
            progress.advance()
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    machine = {"processors": os.cpu_count(), "load": load, "python": platform.python_version()}
    write_json(options.output, {"machine": machine, "throughput": rows, "lost": lost_tasks(options.lost)})
    draw(rows, options.output.with_suffix(".png"))
    for row in rows:
        print(
            f"{row['engine']:6s} {row['workers']} workers, {row['task_seconds']:g} s: "
            f"{row['tasks_per_second']:.1f} a second, overhead {100 * row['overhead']:.1f} %"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
