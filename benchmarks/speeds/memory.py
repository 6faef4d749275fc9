"""Resident memory over thousands of resets."""

from __future__ import annotations

import gc
import os
import time
from pathlib import Path

import gymnasium
import numpy as np

from benchmarks.speeds.environments import ENVIRONMENT

_STATUS = Path("/proc/self/statm")
FLAT = 1.0  # [MiB] of growth over all resets that still counts as flat


def resident() -> float:
    """Resident memory of this process [MiB]."""
    pages = int(_STATUS.read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def over_resets(resets: int, warm_up: int) -> dict[str, object]:
    """Resident memory after the warm-up and at ten points over ``resets`` further ones, each with two steps."""
    if not _STATUS.exists():
        return {"skipped": "this system has no /proc/self/statm."}
    env = gymnasium.make(ENVIRONMENT)
    env.reset(seed=0)
    action = np.array([0.3, 0.2], dtype=np.float32)
    levels, started = [], 0.0
    for k in range(warm_up + resets):
        if k == warm_up:
            started = time.process_time()
        if k >= warm_up and (k - warm_up) % max(1, resets // 10) == 0:
            gc.collect()
            levels.append(resident())
        env.reset()
        env.step(action)
        env.step(action)
    elapsed = time.process_time() - started
    gc.collect()
    levels.append(resident())
    growth = levels[-1] - levels[0]
    return {
        "resets": resets,
        "warm_up": warm_up,
        "resident_mebibytes": [round(level, 2) for level in levels],
        "growth_mebibytes": round(growth, 3),
        "flat": abs(growth) <= FLAT,
        "milliseconds_per_reset_and_two_steps": round(1e3 * elapsed / resets, 3),
    }
