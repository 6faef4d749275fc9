"""What 100,000 recordings and 1e9 environment steps would take on 100 nodes, from measured figures.

    python -m benchmarks.large_campaigns
    python -m benchmarks.large_campaigns --nodes 20 --processors 64 --price 0.03 --folder my_diagnosis

Figures of ``task_runner.json``, ``diagnosis_speed.json`` and ``long_drives.json``; episodes of an evaluation and parts
of its dataset are measured anew. The runner itself runs a million tasks on a cluster whose time is simulated and which
loses one attempt in a hundred: its retries are the real ones. ``benchmarks/results/large_campaigns.json`` and ``.png``
have the figures.
"""

from __future__ import annotations

import argparse
import heapq
import json
import sys
import tempfile
import time
import tracemalloc
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.task_runner import LOST, nap
from ddagr_gym.evaluation.campaign import drive_scenarios, episode_row
from ddagr_gym.evaluation.dataset import EpisodeDataset
from ddagr_gym.evaluation.scenarios import load_scenarios
from ddagr_gym.files import write_json
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style
from ddagr_gym.tasks import Limits, Task, TaskRunner
from ddagr_gym.tasks.engine import ThisProcess
from ddagr_gym.tasks.task import Failure, Outcome

RESULTS = Path(__file__).resolve().parent / "results"
RESULT = RESULTS / "large_campaigns.json"
RECORDINGS, STEPS = 100_000, 1_000_000_000
PER_TASK = 50
"""Episodes of a task, as in an evaluation."""
FOLDER = 3_753_588
"""Size of what ``ddagr diagnose`` wrote of three drives of 60 s: page, figures, evidence [bytes] (measured)."""


class SimulatedCluster(ThisProcess):
    """Engine in simulated time: processors that run tasks in the order given, and a driver that sends one by one.

    Args:
        processors: of the cluster.
        sending: time of the driver for a task [s].
        seconds: of a task; a lost attempt ends after a uniform share of it.
        seed: of the losses.
    """

    def __init__(self, processors: int, sending: float, seconds: float, seed: int = 0) -> None:
        super().__init__(Limits())
        self.slots, self._sending, self._seconds = processors, sending, seconds
        self._rng = np.random.default_rng(seed)
        self._free = [0.0] * processors
        self._ends: list[tuple[float, int, bool]] = []
        self.clock, self.lost = 0.0, 0

    def begin(self, number: int, task: Task) -> None:
        """Send a task to the processor that is free first."""
        self.clock += self._sending
        lost = bool(self._rng.random() < LOST)
        self.lost += lost
        end = max(heapq.heappop(self._free), self.clock) + self._seconds * (self._rng.random() if lost else 1.0)
        heapq.heappush(self._free, end)
        heapq.heappush(self._ends, (end, number, lost))

    def ended(self, seconds: float) -> list[tuple[int, Outcome]]:
        """Tasks that have ended by now; the next one where none has."""
        self.clock = max(self.clock, self._ends[0][0])
        found = []
        while self._ends and self._ends[0][0] <= self.clock:
            _, number, lost = heapq.heappop(self._ends)
            found.append((number, Outcome(failure=Failure("lost", "node lost")) if lost else Outcome(1)))
        return found


def simulate(count: int, processors: int, sending: float, seconds: float) -> dict[str, Any]:
    """The runner with many tasks on a simulated cluster.

    Args:
        count: tasks.
        processors: of the cluster.
        sending: time of the driver for a task [s].
        seconds: of a task.
    """
    engine, began = SimulatedCluster(processors, sending, seconds), time.process_time()
    done = failed = 0
    with TaskRunner(engine=engine) as runner:
        for ended in runner.run(Task(str(number), nap, (seconds,)) for number in range(count)):
            done += ended.failure is None
            failed += ended.failure is not None
    ideal = count * seconds / processors
    return {
        "tasks": count,
        "task_seconds": seconds,
        "processors": processors,
        "lost_attempts": engine.lost,
        "done": done,
        "failed": failed,
        "simulated_hours": engine.clock / 3600.0,
        "time_over_ideal": engine.clock / ideal,
        "driver_cpu_seconds": time.process_time() - began,
    }


def sending_time() -> dict[str, float]:
    """Time of the driver for a task by engine [s]: what tasks of 0.05 s took beyond their own time, the dearest row."""
    rows = json.loads((RESULTS / "task_runner.json").read_text())["throughput"]
    short = [row for row in rows if row["task_seconds"] == 0.05]
    cost: dict[str, float] = {}
    for row in short:
        mine = row["overhead"] * row["task_seconds"] / row["workers"]
        cost[row["engine"]] = max(cost.get(row["engine"], 0.0), mine)
    return cost


def measured_episodes(count: int = 20, controller: str = "B4", set_name: str = "S1") -> dict[str, Any]:
    """Processor time and steps of episodes as an evaluation drives them, and its rows."""
    scenarios = load_scenarios(set_name)[:count]
    drive_scenarios(controller, scenarios[:2])
    began = time.process_time()
    runs = drive_scenarios(controller, scenarios)
    rows = [episode_row(controller, item, run) for item, run in zip(scenarios, runs, strict=True)]
    seconds = time.process_time() - began
    steps = sum(row["duration"] for row in rows) / 0.08
    return {"episodes": count, "steps": steps, "cpu_seconds": seconds, "rows": rows}


def measured_store(rows: Sequence[dict[str, Any]], parts: int = 100) -> dict[str, float]:
    """Size and times of a dataset with parts of 50 rows: those given, with other numbers and digits."""
    rng = np.random.default_rng(0)

    def varied(number: int) -> dict[str, Any]:
        row = rows[number % len(rows)] | {"number": number, "made_of": "0" * 12}
        return {key: value * (1.0 + 1e-6 * rng.random()) if isinstance(value, float) else value
                for key, value in row.items()}  # fmt: skip

    with tempfile.TemporaryDirectory() as folder:
        store = EpisodeDataset(Path(folder) / "episodes")
        drawn = [[varied(PER_TASK * part + k) for k in range(PER_TASK)] for part in range(parts)]
        began = time.process_time()
        for part in drawn:
            store.append(part)
        written = time.process_time()
        tracemalloc.start()
        read = store.read()
        memory = tracemalloc.get_traced_memory()[0]
        tracemalloc.stop()
        size = sum(path.stat().st_size for path in store.parts())
    return {
        "bytes_per_row": size / len(read),
        "write_seconds_per_part": (written - began) / parts,
        "python_bytes_per_row": memory / len(read),
    }


def room_of_diagnoses(folder: int, processors: int) -> dict[str, float]:
    """Disk for the folders of all recordings, and memory of a node that diagnoses one on each processor.

    Args:
        folder: size of one folder [bytes].
        processors: of a node.
    """
    drives = json.loads((RESULTS / "long_drives.json").read_text())["drives"]
    memory = max(drive["gibibytes"] for drive in drives)
    return {
        "bytes_per_folder": folder,
        "store_GiB": RECORDINGS * folder / 2**30,
        "memory_GiB_each": memory,
        "memory_GiB_per_node": processors * memory,
    }


def size_of(folder: Path) -> int:
    """Bytes of the files of a folder.

    Args:
        folder: of a diagnosis.
    """
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def arithmetic(options: argparse.Namespace) -> dict[str, Any]:
    """Both campaigns on the cluster that the options name."""
    processors = options.nodes * options.processors
    sending = sending_time()
    driven = measured_episodes()
    store = measured_store(driven.pop("rows"))
    speed = json.loads((RESULTS / "diagnosis_speed.json").read_text())
    each = [sum(case["steps"].values()) * speed["threads"] for case in speed["cases"]]
    diagnoses = {
        "core_seconds_each": {"least": min(each), "mean": float(np.mean(each)), "most": max(each)},
        **_priced(RECORDINGS * float(np.mean(each)), processors, options.price),
        "tasks_per_second": processors / float(np.mean(each)),
        **room_of_diagnoses(size_of(options.folder) if options.folder else FOLDER, options.processors),
    }
    episodes = STEPS / (driven["steps"] / driven["episodes"])
    seconds = episodes * driven["cpu_seconds"] / driven["episodes"]
    task = PER_TASK * driven["cpu_seconds"] / driven["episodes"]
    evaluation = {
        "episodes": episodes,
        "tasks": episodes / PER_TASK,
        "task_seconds": task,
        **_priced(seconds, processors, options.price),
        "tasks_per_second": processors / task,
        "driver_hours_on_ray": episodes / PER_TASK * (sending["ray"] + store["write_seconds_per_part"]) / 3600.0,
        "store_GiB": episodes * store["bytes_per_row"] / 2**30,
        "rows_in_memory_GiB": episodes * store["python_bytes_per_row"] / 2**30,
    }
    return {
        "cluster": {"nodes": options.nodes, "processors": options.processors, "price_per_core_hour": options.price},
        "measured": {"sending_seconds": sending, "evaluation": driven, "store": store},
        "diagnoses": diagnoses,
        "evaluation": evaluation,
        "shortest_task_seconds_on_ray": processors * sending["ray"],
    }


def _priced(core_seconds: float, processors: int, price: float) -> dict[str, float]:
    hours = core_seconds / 3600.0
    return {"core_hours": hours, "hours": hours / processors, "cost": hours * price}


def draw(rows: Sequence[dict[str, Any]], shortest: float, path: Path) -> None:
    """Time over that of processors that never wait, by length of a task, as PNG."""
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(6.4, 3.4), layout="constrained")
        axes = figure.subplots()
        axes.plot([row["task_seconds"] for row in rows], [row["time_over_ideal"] for row in rows], "o-",
                  color=palette.BLUE)  # fmt: skip
        for row in rows:
            axes.annotate(f"{row['time_over_ideal']:.2f}", (row["task_seconds"], row["time_over_ideal"]),
                          xytext=(6, 6), textcoords="offset points", fontsize=8)  # fmt: skip
        axes.axvline(shortest, color=palette.GREY, linewidth=0.8, linestyle=":")
        axes.text(shortest, axes.get_ylim()[1], " driver sends as fast\n as processors take ", va="top", ha="right",
                  fontsize=8)  # fmt: skip
        axes.set_xscale("log")
        axes.set_yscale("log")
        lengths = [row["task_seconds"] for row in rows]
        axes.set_xticks(lengths, [f"{length:g}" for length in lengths], minor=False)
        axes.set_xticks([], minor=True)
        axes.set_yticks([1, 2, 5, 10, 20], ["1", "2", "5", "10", "20"])
        axes.set_yticks([], minor=True)
        axes.set_xlabel("length of a task [s]")
        axes.set_ylabel("time over that of busy processors")
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=120))


def simulations(options: argparse.Namespace, sending: float) -> Iterator[dict[str, Any]]:
    """The runner with tasks of each length."""
    for seconds in options.task_seconds:
        yield simulate(options.tasks, options.nodes * options.processors, sending, seconds)


def main(words: Sequence[str] | None = None) -> int:
    """Command line; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--nodes", type=int, default=100)
    parser.add_argument("--processors", type=int, default=32, help="of a node")
    parser.add_argument("--price", type=float, default=0.04, help="of a core hour, in any currency")
    parser.add_argument("--folder", type=Path, help="a diagnosis whose size counts, instead of the measured one")
    parser.add_argument("--tasks", type=int, default=1_000_000, help="of the simulation")
    parser.add_argument("--task-seconds", type=float, nargs="+", default=[1.0, 5.0, 20.0, 30.0, 60.0])
    parser.add_argument("--output", type=Path, default=RESULT)
    options = parser.parse_args(words)
    content = arithmetic(options)
    content["simulated"] = list(simulations(options, content["measured"]["sending_seconds"]["ray"]))
    write_json(options.output, content)
    draw(content["simulated"], content["shortest_task_seconds_on_ray"], options.output.with_suffix(".png"))
    print(json.dumps(content, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
