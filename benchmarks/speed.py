"""Speed of the simulator: ratios taken in one run, as a table, JSON and a figure.

    python -m benchmarks.speed [--quick] [--output FOLDER]        (also: ddagr benchmark)

Contestants take turns (:mod:`benchmarks.speeds.timing`) at three workloads (:mod:`benchmarks.speeds.workloads`). Peers
need ``pip install "gymnasium[mujoco]"``, the comparison with C a C compiler; where one is missing its part is left out
and the results say why. Absolute figures hold for one machine: quote the ratios.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numba
import numpy as np

from benchmarks.speeds import accuracy, environments, kernel_share, kernel_time, memory, peers, workloads
from benchmarks.speeds.figure import speed_figure
from benchmarks.speeds.free_cores import turns_beside_control
from benchmarks.speeds.tables import tables_of
from benchmarks.speeds.timing import Contestant, race, ratio, spread
from ddagr_gym.commands.output import make_folder, write_text
from ddagr_gym.errors import InputError
from ddagr_gym.version import __version__

RESULTS = Path(__file__).with_name("results")
OURS = "DDAGR-Turn-v0"
FIRST_STEPS = 40
"""Of an episode, in which none ends."""


@dataclass(frozen=True)
class Effort:
    """How much is measured.

    Attributes:
        repeats: turns of each contestant.
        steps: environment steps in a turn.
        batches: numbers of environments.
        shared_batches: those of which two threads are held against one between resets.
        evaluations: of the kernel in a turn.
        states: of wheels per soil for the force errors.
        samples: of a drive for the step errors and the kernel's share.
        resets: over which memory is watched.
    """

    repeats: int = 15
    steps: int = 1500
    batches: tuple[int, ...] = (1, 4, 16, 64, 256)
    shared_batches: tuple[int, ...] = (64, 256)
    evaluations: int = 40_000
    states: int = 100
    samples: int = 2000
    resets: int = 10_000

    @classmethod
    def quick(cls) -> Effort:
        """Half a minute; the figures scatter by some ten percent."""
        return cls(
            repeats=5,
            steps=300,
            batches=(1, 16, 64),
            shared_batches=(64,),
            evaluations=10_000,
            states=20,
            samples=600,
            resets=500,
        )


def measure(effort: Effort, report: Callable[[str], None]) -> dict[str, Any]:
    """All results, JSON-ready.

    Args:
        effort: how much is measured.
        report: takes the name of each part as it starts.
    """
    tables = workloads.action_tables()
    results: dict[str, Any] = {
        "version": __version__,
        "machine": machine(),
        "workloads": " ".join((workloads.__doc__ or "").split()),
        "units": "rates of one thread per CPU second, of two per wall second; steps of 80 ms, samples of 8 ms",
    }
    parts: dict[str, Callable[[], Any]] = {
        "steps_per_second": lambda: steps_per_second(tables, effort),
        "batch": lambda: {name: batch(actions, effort) for name, actions in tables.items()},
        "two_threads": lambda: two_threads(tables, effort),
        "kernel_share": lambda: {
            name: kernel_share.share(actions[:4], effort.samples, effort.repeats, effort.evaluations)
            for name, actions in tables.items()
        },
        "kernel_beside_c": lambda: kernel_time.against_c(effort.repeats, effort.evaluations),
        "quadrature": lambda: accuracy.quadrature(effort.states, effort.repeats, effort.evaluations),
        "time_step": lambda: accuracy.time_steps(tables, effort.samples, effort.repeats),
        "memory": lambda: memory.over_resets(effort.resets, warm_up=max(200, effort.resets // 10)),
    }
    for name, part in parts.items():
        report(name)
        results[name] = part()
    return results


def machine() -> dict[str, Any]:
    """What the figures were measured on."""
    names = Path("/proc/cpuinfo")
    lines = names.read_text(encoding="utf-8").splitlines() if names.exists() else []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return {
        "processor": models[0] if models else platform.machine(),
        "cores": os.cpu_count(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "numba": numba.__version__,
    }


def steps_per_second(tables: dict[str, np.ndarray], effort: Effort) -> dict[str, Any]:
    """One environment through ``gym.make`` at each workload, and the peers, one core each."""
    ours = {f"{OURS}, {name.replace('_', ' ')}": table for name, table in tables.items()}
    contestants = [environments.single(name, table, effort.steps) for name, table in ours.items()]
    seconds = dict.fromkeys(ours, environments.STEP_SECONDS)
    reason = peers.missing()
    if reason is None:
        for contestant, per_step in peers.contestants(tables["row_turn"], effort.steps):
            contestants.append(contestant)
            seconds[contestant.name] = per_step
    rates = race(contestants, effort.repeats)
    results: dict[str, Any] = {
        "rates": {name: found.summary() for name, found in rates.items()},
        "simulated_seconds_per_second": {name: round(seconds[name] * rates[name].median, 1) for name in rates},
        "ratios": [ratio(rates, next(iter(ours)), name) for name in rates if name not in ours],
    }
    if reason is not None:
        return results | {"skipped": reason}
    return results | {"rigid_skid_steer_at_1.0_and_0.5_rad_per_s": peers.turning_on_rigid_ground()}


def batch(actions: np.ndarray, effort: Effort) -> list[dict[str, Any]]:
    """Simulated seconds per second of the native batch, over numbers of environments, with one thread and two."""

    def contestant(count: int, threads: int) -> Contestant:
        steps = max(2, effort.steps // count)
        return environments.batch(f"{count} x {threads}", actions, steps, count, threads)

    rates = race([contestant(count, threads) for count in effort.batches for threads in (1, 2)], effort.repeats)
    return [
        {
            "environments": count,
            "one_thread": rates[f"{count} x 1"].summary(),
            "two_threads": rates[f"{count} x 2"].summary(),
            "gain_of_two": ratio(rates, f"{count} x 2", f"{count} x 1", clock="wall"),
            "cpu_seconds_of_one_over_two": ratio(rates, f"{count} x 2", f"{count} x 1", clock="cpu"),
        }
        for count in effort.batches
    ]


def two_threads(tables: dict[str, np.ndarray], effort: Effort) -> list[dict[str, Any]]:
    """Rate of two threads over that of one, by the wall clock, in stepping alone: resets are of one thread.

    Turns count while two threads that share nothing have two cores to themselves, see :mod:`.free_cores`.
    """
    found = []
    for workload, actions in tables.items():
        for count in effort.shared_batches:
            steps = max(2, min(FIRST_STEPS, 2 * effort.steps // count))
            one, two = (environments.between_resets(f"{n}", actions, steps, count, n) for n in (1, 2))
            turns = turns_beside_control(one, two, effort.repeats, 6 * effort.repeats)
            free = turns["gain"][turns["free"]]
            found.append(
                {
                    "workload": workload,
                    "environments": count,
                    "gain": spread(free) if free.size else None,
                    "turns": int(free.size),
                    "gain_of_all_turns": spread(turns["gain"]),
                    "all_turns": int(turns["gain"].size),
                    "second_core": spread(turns["second_core"]),
                }
            )
    return found


def main(arguments: list[str] | None = None) -> None:
    """Measure, print, and write speed.json and the figure."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="half a minute, rougher figures, 500 resets")
    parser.add_argument("--output", type=Path, default=RESULTS, help="folder for speed.json, speed.png, speed.svg")
    given = parser.parse_args(arguments)
    folder = make_folder(given.output)
    effort = Effort.quick() if given.quick else Effort()
    results = measure(effort, lambda part: print(f"measuring {part} ...", flush=True))
    write_text(folder / "speed.json", json.dumps(results, indent=1, allow_nan=False) + "\n")
    print(f"\n{tables_of(results)}\n\nwritten: {folder / 'speed.json'}")
    try:
        print("\n".join(f"written: {path}" for path in speed_figure(results, folder / "speed")))
    except InputError as error:
        print(f"no figure: {error}")


if __name__ == "__main__":
    main()
