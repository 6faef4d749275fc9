"""Speed of this checkout against that of another one, as ratios of CPU time taken in turns.

    python -m benchmarks.two_checkouts OTHER [--turns 21] [--output FILE]

OTHER is the folder of another checkout (``git worktree add OTHER COMMIT``); both run with this Python and its packages.
A process for each works on the same actions, one turn here, one turn there, so that what else the machine does falls on
both. Workloads: one environment, a batch of 64, and long drives by open-loop commands.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

CHECKOUT = Path(__file__).resolve().parents[1]
WORKLOADS = ("one environment", "batch of 64", "long drives")
STEPS, BATCH_STEPS, SAMPLES, DRIVES = 3000, 150, 12_000, 4


def work(name: str) -> Callable[[], None]:
    """One turn of a workload, which was run once before."""
    turns = {"one environment": _one_environment, "batch of 64": _batch, "long drives": _long_drives}
    turn = turns[name]()
    turn()
    return turn


def _actions(*shape: int) -> np.ndarray:
    """Arcs to both sides with noise, as of a policy late in training; (*shape, 2)."""
    noise = 0.15 * np.random.default_rng(0).standard_normal((*shape, 2))
    swing = 0.2 * np.sin(np.arange(shape[0]) / 40.0).reshape(-1, *(1,) * len(shape))
    return np.clip(0.5 + swing * np.array([1.0, -1.0]) + noise, -1.0, 1.0).astype(np.float32)


def _one_environment() -> Callable[[], None]:
    import gymnasium

    env, actions = gymnasium.make("ddagr_gym:DDAGR-Turn-v0"), _actions(STEPS)

    def turn() -> None:
        env.reset(seed=1)
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()

    return turn


def _batch() -> Callable[[], None]:
    import gymnasium

    env, actions = gymnasium.make_vec("ddagr_gym:DDAGR-Turn-v0", num_envs=64), _actions(BATCH_STEPS, 64)

    def turn() -> None:
        env.reset(seed=1)
        for action in actions:
            env.step(action)

    return turn


def _long_drives() -> Callable[[], None]:
    from ddagr_gym.parameters import Sensors
    from ddagr_gym.presets import get_robot, get_soil
    from ddagr_gym.simulator import Simulator

    simulator, swing = Simulator(DRIVES), np.sin(0.008 * np.arange(SAMPLES) / 3.0)
    commands = np.repeat(np.stack([2.0 + swing, 2.0 - swing], axis=1)[None], DRIVES, axis=0)

    def turn() -> None:
        for number in range(DRIVES):
            simulator.configure(number, get_robot("ddagr"), get_soil("thesis_a1"), Sensors())
        simulator.reset()
        simulator.step(commands)

    return turn


def serve() -> None:
    """Do a turn of the workload that each line of standard input names, and print its CPU time [s]."""
    ready: dict[str, Callable[[], None]] = {}
    for line in sys.stdin:
        name = line.strip()
        ready[name] = ready.get(name) or work(name)
        began = time.process_time()
        ready[name]()
        print(time.process_time() - began, flush=True)


class Side:
    """A process that works in one of the checkouts.

    Args:
        folder: of the checkout.
    """

    def __init__(self, folder: Path) -> None:
        # this file serves both sides: the other checkout may not have it
        command = [sys.executable, "-c", f"import runpy; runpy.run_path({str(Path(__file__))!r})['serve']()"]
        environment = {**os.environ, "PYTHONPATH": str(folder), "OMP_NUM_THREADS": "1"}
        self.process = subprocess.Popen(
            command, cwd=folder, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def seconds(self, name: str) -> float:
        """CPU time of a turn [s]."""
        pipes = self.process
        assert pipes.stdin is not None
        assert pipes.stdout is not None
        pipes.stdin.write(f"{name}\n")
        pipes.stdin.flush()
        return float(pipes.stdout.readline() or "nan")

    def close(self) -> None:
        """End the process."""
        self.process.communicate()


def ratios(here: Side, there: Side, name: str, turns: int) -> np.ndarray:
    """(turns,) CPU times here over there; who comes first changes from turn to turn."""
    found = []
    for number in range(turns + 1):
        sides = (here, there) if number % 2 else (there, here)
        taken = {side: side.seconds(name) for side in sides}
        found.append(taken[here] / taken[there])
    return np.array(found[1:])


def summary(values: np.ndarray) -> dict[str, Any]:
    """Median and quartiles."""
    low, median, high = np.quantile(values, [0.25, 0.5, 0.75])
    return {"median": float(median), "quartiles": [float(low), float(high)], "turns": len(values)}


def main() -> int:
    """Compare, print a line for each workload, and write them where asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("other", type=Path, help="folder of the other checkout")
    parser.add_argument("--turns", type=int, default=21)
    parser.add_argument("--output", type=Path, default=None)
    arguments = parser.parse_args()
    if not (arguments.other / "ddagr_gym").is_dir():
        parser.error(f"{arguments.other} has no folder ddagr_gym: give a checkout, as `git worktree add` makes one.")
    if arguments.turns < 1:
        parser.error(f"--turns is {arguments.turns}: give at least 1.")
    here, there = Side(CHECKOUT), Side(arguments.other.resolve())
    found = {}
    for name in WORKLOADS:
        found[name] = summary(ratios(here, there, name, arguments.turns))
        low, high = found[name]["quartiles"]
        print(f"{name}: {found[name]['median']:.3f} ({low:.3f} to {high:.3f}) of the other's CPU time", flush=True)
    here.close()
    there.close()
    if arguments.output is not None:
        from ddagr_gym.commands.output import write_text

        write_text(arguments.output, json.dumps(found, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
