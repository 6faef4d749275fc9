"""How fast the simulator is, as ratios against peers and references in one run.

    python -m benchmarks.speed [--quick] [--output FOLDER]      (or: ddagr benchmark)

Times are processor time of this process, candidates interleaved; medians with minimum and maximum. Absolute figures
hold for one machine only; quote the ratios.
"""

from __future__ import annotations

import argparse
import json
import platform
import resource
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

import ddagr_gym
from benchmarks.c_kernel import kernel_candidates
from benchmarks.peers import ant_step, skid_steer_steps
from benchmarks.timing import interleaved
from ddagr_gym.parameters import Numerics
from ddagr_gym.physics import equilibrium_sinkage, wheel_force
from ddagr_gym.presets import get_robot, get_soil

CONTROL_INTERVAL = 0.08
"""Simulated seconds of an environment step."""

STEADY = np.array([0.74, 0.03], np.float32)
"""Action of a steady row turn."""


def policy_like(rng: np.random.Generator, count: int) -> np.ndarray:
    """Actions of a policy that still explores: the steady turn with noise of 0.15."""
    return np.clip(STEADY + 0.15 * rng.standard_normal((count, 2)), -1, 1).astype(np.float32)


def _single(noisy: bool) -> Callable[[], object]:
    env = gymnasium.make("DDAGR-Turn-v0")
    env.reset(seed=0)
    rng = np.random.default_rng(0)

    def run() -> object:
        for _ in range(50):
            action = policy_like(rng, 1)[0] if noisy else STEADY
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()
        return env

    return run


def _batch(count: int, threads: int, noisy: bool, numerics: Numerics | None = None) -> Callable[[], object]:
    env = gymnasium.make_vec("DDAGR-Turn-v0", num_envs=count, threads=threads, numerics=numerics or Numerics())
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    steady = np.tile(STEADY, (count, 1))

    def run() -> object:
        for _ in range(max(1, 400 // count)):
            env.step(policy_like(rng, count) if noisy else steady)
        return env

    return run


def environment_speed(rounds: int) -> dict[str, Any]:
    """Simulated seconds per processor second of one environment and of the native batch on one core."""
    candidates, steps = {}, {}
    for noisy in (False, True):
        label = "policy-like" if noisy else "steady turn"
        candidates[f"gym.make, {label}"], steps[f"gym.make, {label}"] = _single(noisy), 50
        for count in (4, 16, 64, 256):
            name = f"make_vec({count}), {label}"
            candidates[name], steps[name] = _batch(count, 1, noisy), count * max(1, 400 // count)
    found = interleaved(candidates, rounds)
    return {
        name: {"simulated_seconds_per_second": CONTROL_INTERVAL * steps[name] / t.median, "seconds": t.as_mapping()}
        for name, t in found.items()
    }


def thread_speed(rounds: int) -> dict[str, Any]:
    """Wall-clock gain of two threads on a batch of 256 (needs two idle cores to say anything)."""
    found = interleaved({"one": _batch(256, 1, True), "two": _batch(256, 2, True)}, rounds, time.perf_counter)
    return {"wall_seconds": {k: t.as_mapping() for k, t in found.items()}, "gain": found["one"].low / found["two"].low}


def peer_speed(rounds: int) -> dict[str, Any]:
    """Environment steps and simulated seconds per second beside MuJoCo's Ant-v5 and a rigid-ground skid-steer."""
    ant, rigid = ant_step(), skid_steer_steps()
    if ant is None or rigid is None:
        return {"skipped": "MuJoCo is not installed: pip install mujoco 'gymnasium[mujoco]'"}
    ours = _single(noisy=False)

    def many(call: Callable[[], object]) -> Callable[[], object]:
        return lambda: [call() for _ in range(50)]

    found = interleaved({"ours": ours, "Ant-v5": many(ant), "rigid skid-steer, 2 ms": many(rigid)}, rounds)
    simulated = {"ours": CONTROL_INTERVAL, "Ant-v5": 0.05, "rigid skid-steer, 2 ms": CONTROL_INTERVAL}
    return {
        name: {
            "steps_per_second": 50 / t.median,
            "simulated_seconds_per_second": 50 * simulated[name] / t.median,
            "seconds": t.as_mapping(),
        }
        for name, t in found.items()
    }


def kernel_speed(rounds: int) -> dict[str, Any]:
    """Our kernel against the same kernel in C, nanoseconds per node, at the default and a fine rule."""
    result = {}
    for label, nodes in (("default", (8, 7)), ("fine", (16, 16))):
        candidates, treated, difference = kernel_candidates(*nodes)
        found = interleaved(candidates, 20 * rounds)
        item: dict[str, Any] = {k: {"ns_per_node": 1e9 * t.low / treated} for k, t in found.items()}
        if "C" in found:
            item |= {"ours_over_C": found["ours"].low / found["C"].low, "largest_difference": difference}
        else:
            item["skipped"] = "no C compiler"
        result[label] = item
    return result


def accuracy_cost(rounds: int, count: int = 200) -> list[dict[str, Any]]:
    """Force error against the finest rule, and cost, over quadrature sizes; random wheels of turns on several soils."""
    rng = np.random.default_rng(1)
    wheel = get_robot("ddagr").wheels[0]
    low, high = np.array([0.05, -0.15, 0.3, -0.4]), np.array([0.4, 0.15, 1.6, 0.4])
    states = low + (high - low) * rng.uniform(size=(count, 4))
    cases = []
    for name in ("thesis_a1", "lete_sand_wong", "sandy_loam_lll_15", "upland_sandy_loam_wong_51"):
        soil = get_soil(name)
        sinkage, _ = equilibrium_sinkage(wheel, soil, *states.T, 412.0, numerics=Numerics.finest())
        cases.append((soil, sinkage, wheel_force(wheel, soil, *states.T, sinkage, numerics=Numerics.finest()).force))
    table = []
    for section, contact in ((8, 2), (8, 3), (8, 4), (8, 5), (8, 7), (8, 10), (16, 8), (16, 16)):
        numerics = Numerics(section_nodes=section, contact_nodes=contact)
        errors = []
        for soil, sinkage, reference in cases:
            force = wheel_force(wheel, soil, *states.T, sinkage, numerics=numerics).force
            errors.append(np.linalg.norm(force - reference, axis=1) / np.linalg.norm(reference, axis=1))
        pooled = np.concatenate(errors)
        timed = interleaved(
            {"x": partial(wheel_force, wheel, cases[0][0], *states.T, cases[0][1], numerics=numerics)}, rounds
        )
        table.append(
            {
                "section_nodes": section,
                "contact_nodes": contact,
                "nodes": 2 * section * contact,
                "force_error_median": float(np.median(pooled)),
                "force_error_p99": float(np.quantile(pooled, 0.99)),
                "microseconds_per_wheel": 1e6 * timed["x"].low / count,
            }
        )
    return table


def kernel_share(rounds: int) -> dict[str, float]:
    """Share of a batch step that grows with the quadrature nodes: what doubling them along the contact adds."""
    doubled = Numerics(contact_nodes=2 * Numerics().contact_nodes)
    found = interleaved({"default": _batch(64, 1, False), "doubled": _batch(64, 1, False, doubled)}, 3 * rounds)
    return {"share": found["doubled"].low / found["default"].low - 1.0}


def reset_memory(resets: int) -> dict[str, float]:
    """Growth of the resident set over many resets, after a warm-up [MB]."""
    env = gymnasium.make("DDAGR-Turn-v0")
    env.reset(seed=0)
    for _ in range(max(50, resets // 20)):
        env.reset()
    before = _resident()
    for _ in range(resets):
        env.reset()
        env.step(STEADY)
    return {"resets": resets, "growth_megabytes": _resident() - before}


def _resident() -> float:
    """Resident set of this process [MB]."""
    status = Path("/proc/self/status")
    if status.exists():
        line = next(row for row in status.read_text().splitlines() if row.startswith("VmRSS"))
        return float(line.split()[1]) / 1024.0
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def measure(quick: bool) -> dict[str, Any]:
    """All figures; ``quick`` for a look in a minute."""
    rounds, resets = (3, 300) if quick else (9, 10_000)
    result: dict[str, Any] = {
        "version": ddagr_gym.__version__,
        "machine": {"processor": platform.machine(), "python": platform.python_version()},
        "quick": quick,
    }
    for name, call in (
        ("environments", lambda: environment_speed(rounds)),
        ("threads", lambda: thread_speed(rounds)),
        ("peers", lambda: peer_speed(rounds)),
        ("kernel", lambda: kernel_speed(rounds)),
        ("accuracy", lambda: accuracy_cost(rounds)),
        ("kernel_share", lambda: kernel_share(rounds)),
        ("memory", lambda: reset_memory(resets)),
    ):
        print(f"measuring {name} ...", flush=True)
        result[name] = call()
    return result


def main(arguments: list[str] | None = None) -> None:
    """Measure, print, and write speed.json, speed.png and speed.svg."""
    from benchmarks.speed_report import print_tables, speed_figure

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer rounds and 300 resets instead of 10,000")
    parser.add_argument("--output", type=Path, default=Path("benchmarks/results"), help="folder to write")
    given = parser.parse_args(arguments)
    result = measure(given.quick)
    given.output.mkdir(parents=True, exist_ok=True)
    from ddagr_gym.files import atomic_path

    with atomic_path(given.output / "speed.json") as temporary:
        temporary.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    print_tables(result)
    speed_figure(result, given.output / "speed.png")
    print(f"\nspeed.json and speed.png are in {given.output.resolve()}")


if __name__ == "__main__":
    main()
