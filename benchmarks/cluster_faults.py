"""What faults cost a run of tasks on a Ray cluster of two nodes on this machine.

    python -m benchmarks.cluster_faults
    python -m benchmarks.cluster_faults --faults "node killed" --output faults.json

Every fault strikes a run of tasks with a store of results, on nodes of one processor each; then the same run is given
again where it had ended. Asked is whether all results are those of one process to the bit, whether what was stored was
begun once, and how many tasks were begun again. Tasks note when they begin. ``benchmarks/results/cluster_faults.json``
and ``.png`` have the figures.
"""

from __future__ import annotations

import argparse
import errno
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks import node_work
from ddagr_gym.extras import need
from ddagr_gym.files import write_json
from ddagr_gym.progress import Progress
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style
from ddagr_gym.tasks import Ended, Limits, ResultStore, Task, TaskRunner

RESULT = Path(__file__).resolve().parent / "results" / "cluster_faults.json"
STRUCK = 3
"""Number of the task that a fault is in."""
ROOM = 700
"""Bytes of results that the full disk takes: those of four tasks."""


@dataclass(frozen=True)
class Run:
    """One run that a fault strikes.

    Attributes:
        folder: of the store and of the tasks' marks.
        count: tasks.
        seconds: of a task.
    """

    folder: Path
    count: int
    seconds: float

    def tasks(self, odd: Callable[..., Any] = node_work.case) -> list[Task]:
        """Tasks, of which the one of number :data:`STRUCK` calls another function."""
        functions = {STRUCK: odd}
        return [
            Task(f"case {n}", functions.get(n, node_work.case), (str(self.folder), n, self.seconds), key=f"case_{n}")
            for n in range(self.count)
        ]

    def store(self) -> ResultStore:
        """Store of the results."""
        return ResultStore(self.folder / "store")

    def stored(self) -> set[int]:
        """Numbers of the tasks whose results are there."""
        return {n for n in range(self.count) if self.store().has(f"case_{n}")}

    def begun(self) -> Counter[int]:
        """How often each task was begun."""
        return Counter(self._marks(node_work.BEGUN))

    def running(self) -> int:
        """Tasks that have begun and not ended."""
        return len(self._marks(node_work.BEGUN)) - len(self._marks(node_work.ENDED))

    def _marks(self, name: str) -> list[int]:
        file = self.folder / name
        return [int(line) for line in file.read_text().split()] if file.is_file() else []


class FullDisk(ResultStore):
    """Store on a disk with little room."""

    def put(self, key: str, value: Any) -> Any:
        """Keep a result, or fail as the system does."""
        used = sum(path.stat().st_size for path in self.folder.iterdir())
        if used + len(json.dumps(value)) > ROOM:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(self.folder))
        return super().put(key, value)


class TwoNodes:
    """A Ray cluster of two nodes of one processor each on this machine."""

    def __init__(self) -> None:
        need("ray")
        from ray.cluster_utils import Cluster

        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
        self._options = {"num_cpus": 1, "object_store_memory": 80 * 2**20, "include_dashboard": False}
        self._cluster = Cluster(initialize_head=True, head_node_args=self._options)
        self._second = self._cluster.add_node(**self._options)
        self.address: str = self._cluster.address

    def kill_second(self) -> None:
        """End all processes of the second node at once, as a machine does that loses its power."""
        # a worker whose node's process alone is gone still ends its task
        (node,) = (found.process.pid for found in self._second.all_processes["raylet"])
        listed = subprocess.run(["ps", "-o", "pid=", "--ppid", str(node)], capture_output=True, text=True, check=True)
        for number in [node, *map(int, listed.stdout.split())]:
            with suppress(ProcessLookupError):
                os.kill(number, signal.SIGKILL)
        self._cluster.remove_node(self._second, allow_graceful=False)

    def restore(self) -> None:
        """Start a second node again."""
        self._second = self._cluster.add_node(**self._options)

    def shutdown(self) -> None:
        """End both."""
        self._cluster.shutdown()


@contextmanager
def two_nodes() -> Iterator[TwoNodes]:
    """Cluster for a block."""
    nodes = TwoNodes()
    try:
        yield nodes
    finally:
        nodes.shutdown()


def finish(
    run: Run, nodes: TwoNodes, tasks: Sequence[Task], store: ResultStore | None = None, limits: Limits | None = None
) -> list[Ended]:
    """Run tasks on the cluster; what became of each."""
    with TaskRunner(cluster=nodes.address, limits=limits) as runner:
        return list(runner.run(tasks, store or run.store()))


def wait_until(true: Callable[[], bool], seconds: float = 120.0) -> None:
    """Wait for a condition; TimeoutError after so long [s]."""
    end = time.monotonic() + seconds
    while not true():
        if time.monotonic() > end:
            raise TimeoutError(f"what was waited for did not come in {seconds:g} s")
        time.sleep(0.02)


def worker_killed(run: Run, nodes: TwoNodes) -> list[Ended]:
    """A worker is killed within a task."""
    return finish(run, nodes, run.tasks(node_work.kills_its_worker_once))


def node_killed(run: Run, nodes: TwoNodes) -> list[Ended]:
    """The second node is killed when three tasks have ended and both nodes run one."""
    ended = []
    with TaskRunner(cluster=nodes.address) as runner:
        for item in runner.run(run.tasks(), run.store()):
            ended.append(item)
            if len(ended) == STRUCK:
                wait_until(lambda: run.running() == 2)
                nodes.kill_second()
    nodes.restore()
    return ended


def task_raises(run: Run, nodes: TwoNodes) -> list[Ended]:
    """A task raises."""
    return finish(run, nodes, run.tasks(node_work.raises))


def task_over_memory(run: Run, nodes: TwoNodes) -> list[Ended]:
    """A task asks for twice the memory that it may have."""
    return finish(run, nodes, run.tasks(node_work.takes_memory), limits=Limits(memory=2**32))


def full_disk(run: Run, nodes: TwoNodes) -> list[Ended]:
    """The disk of the store is full after four results."""
    try:
        finish(run, nodes, run.tasks(), FullDisk(run.store().folder))
    except OSError as error:
        if error.errno != errno.ENOSPC:
            raise
    return []


def driver_killed(run: Run, nodes: TwoNodes) -> list[Ended]:
    """The process that gives the tasks is killed when three results are stored."""
    words = [nodes.address, str(run.folder), str(run.count), str(run.seconds)]
    driver = subprocess.Popen(
        [sys.executable, "-m", "benchmarks.cluster_faults", "--as-driver", *words],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    )  # fmt: skip
    wait_until(lambda: len(run.stored()) >= STRUCK or driver.poll() is not None)
    driver.send_signal(signal.SIGKILL)
    driver.wait()
    # what was in flight ends on its node or is ended by Ray
    time.sleep(2.0 * run.seconds + 1.0)
    return []


FAULTS: dict[str, Callable[[Run, TwoNodes], list[Ended]]] = {
    "worker killed": worker_killed,
    "node killed": node_killed,
    "driver killed": driver_killed,
    "task raises": task_raises,
    "task over its memory": task_over_memory,
    "full disk at the store": full_disk,
}


def struck(fault: str, nodes: TwoNodes, folder: Path, count: int = 12, seconds: float = 1.0) -> dict[str, Any]:
    """Figures of a run that a fault strikes, and of the same run given again.

    Args:
        fault: of :data:`FAULTS`.
        nodes: the cluster.
        folder: empty.
        count: tasks.
        seconds: of a task.
    """
    run = Run(folder, count, seconds)
    began = time.perf_counter()
    failed = [item for item in FAULTS[fault](run, nodes) if item.failure is not None]
    before, begun_before = run.stored(), run.begun()
    again = finish(run, nodes, run.tasks())
    took, begun = time.perf_counter() - began, run.begun()
    expected = alone(count, folder / "alone")
    values = {item.task.name: item.value for item in again}
    return {
        "fault": fault,
        "tasks": count,
        "named": [f"{item.task.name}: {item.failure.kind}" for item in failed if item.failure is not None],
        "stored_before": len(before),
        "taken_from_store": sum(item.stored for item in again),
        "stored_and_begun_again": sum(begun[n] > begun_before[n] for n in before),
        "begun_again": sum(times > 1 for times in begun.values()),
        "equal_to_one_process": values == expected,
        "seconds": took,
    }


def alone(count: int, folder: Path) -> dict[str, list[float]]:
    """Results of one process, by name of the task."""
    folder.mkdir()
    with TaskRunner(1) as runner:
        return {item.task.name: item.value for item in runner.run(Run(folder, count, 0.0).tasks())}


def draw(rows: Sequence[dict[str, Any]], path: Path) -> None:
    """Tasks by fault: taken from the store, done once, begun again; as PNG."""
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(6.4, 3.2), layout="constrained")
        axes = figure.subplots()
        names = [row["fault"] for row in rows][::-1]
        series = {
            "all tasks": ([row["tasks"] for row in rows], palette.GREY),
            "stored when the run was given again": ([row["stored_before"] for row in rows], palette.BLUE),
            "begun more than once": ([row["begun_again"] for row in rows], palette.ORANGE),
        }
        for place, (label, (values, colour)) in enumerate(series.items()):
            at = [k + 0.27 * (1 - place) for k in range(len(names))]
            bars = axes.barh(at, values[::-1], 0.24, color=colour, label=label)
            axes.bar_label(bars, fontsize=8, padding=2)
        axes.set_yticks(range(len(names)), names)
        axes.set_xlabel("tasks")
        figure.legend(loc="outside upper center", ncols=3, fontsize=8)
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=120))


def _as_driver(words: Sequence[str]) -> int:
    address, folder, count, seconds = words
    run = Run(Path(folder), int(count), float(seconds))
    with TaskRunner(cluster=address) as runner:
        for _ in runner.run(run.tasks(), run.store()):
            pass
    return 0


def main(words: Sequence[str] | None = None) -> int:
    """Command line; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--faults", nargs="+", choices=list(FAULTS), default=list(FAULTS))
    parser.add_argument("--tasks", type=int, default=12)
    parser.add_argument("--seconds", type=float, default=1.0, help="of a task")
    parser.add_argument("--output", type=Path, default=RESULT)
    parser.add_argument("--as-driver", nargs=4, help=argparse.SUPPRESS)
    options = parser.parse_args(words)
    if options.as_driver:
        return _as_driver(options.as_driver)
    rows = []
    with two_nodes() as nodes, Progress(len(options.faults), "faults") as progress:
        for fault in options.faults:
            with tempfile.TemporaryDirectory() as folder:
                rows.append(struck(fault, nodes, Path(folder), options.tasks, options.seconds))
            progress.advance()
    write_json(options.output, {"nodes": 2, "processors": 1, "task_seconds": options.seconds, "faults": rows})
    draw(rows, options.output.with_suffix(".png"))
    for row in rows:
        print(row)
    return 0


if __name__ == "__main__":
    sys.exit(main())
