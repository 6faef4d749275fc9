"""Interleaved timing: candidates take turns, so that a drift of the machine meets all of them."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Timing:
    """Processor seconds of one call, over the rounds."""

    median: float
    low: float
    high: float

    def as_mapping(self) -> dict[str, float]:
        """For JSON."""
        return {"median": self.median, "min": self.low, "max": self.high}


def interleaved(
    candidates: Mapping[str, Callable[[], object]], rounds: int, clock: Callable[[], float] = time.process_time
) -> dict[str, Timing]:
    """Time every candidate once in each round, after one call that is not counted.

    Args:
        candidates: by name.
        rounds: counted calls of each.
        clock: processor time of this process by default, so that other work on the machine counts less.
    """
    times: dict[str, list[float]] = {name: [] for name in candidates}
    for call in candidates.values():
        call()
    for _ in range(rounds):
        for name, call in candidates.items():
            start = clock()
            call()
            times[name].append(clock() - start)
    return {name: Timing(statistics.median(t), min(t), max(t)) for name, t in times.items()}
