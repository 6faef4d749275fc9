"""Races on a busy machine: contestants take turns, each repeat gives one rate, medians and quartiles are reported.

Rates of one thread are per second of CPU time, so that waiting for a core that others hold does not count; on an idle
machine that is wall time. Rates of several threads are per second of wall time, and are held against one thread by the
same clock. How much of the wall time was computed is reported beside: far below the number of threads, the machine was
busy with other things and the rates of several threads say little.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Contestant:
    """Something to time.

    Attributes:
        name: in tables and results.
        run: does a chunk of work and returns its amount.
        threads: that it uses.
        prepare: called before each turn, outside of its time.
    """

    name: str
    run: Callable[[], float]
    threads: int = 1
    prepare: Callable[[], object] = lambda: None


@dataclass(frozen=True)
class Rates:
    """Amounts per second, one per repeat.

    Attributes:
        per_cpu_second: (repeats,).
        per_wall_second: (repeats,).
        threads: of the contestant.
    """

    per_cpu_second: np.ndarray
    per_wall_second: np.ndarray
    threads: int = 1

    @property
    def values(self) -> np.ndarray:
        """(repeats,) by the clock that counts, see the module."""
        return self.per_cpu_second if self.threads == 1 else self.per_wall_second

    @property
    def median(self) -> float:
        """Median of :attr:`values`."""
        return float(np.median(self.values))

    def summary(self) -> dict[str, Any]:
        """For the results: median, quartiles, range, repeats, and CPU time over wall time."""
        return {
            **spread(self.values),
            "range": [round(float(self.values.min()), 3), round(float(self.values.max()), 3)],
            "repeats": int(self.values.size),
            "cpu_over_wall": round(float(np.median(self.per_wall_second / self.per_cpu_second)), 3),
        }


def race(contestants: Sequence[Contestant], repeats: int) -> dict[str, Rates]:
    """Let the contestants take turns, each repeat from another starting place; first one turn that does not count.

    Args:
        contestants: with different names.
        repeats: turns of each that count.
    """
    for contestant in contestants:
        turn(contestant)
    turns: dict[str, list[tuple[float, float]]] = {contestant.name: [] for contestant in contestants}
    for repeat in range(repeats):
        first = repeat % len(contestants)
        for contestant in (*contestants[first:], *contestants[:first]):
            turns[contestant.name].append(turn(contestant))
    return {c.name: Rates(*np.array(turns[c.name]).T, threads=c.threads) for c in contestants}


def turn(contestant: Contestant) -> tuple[float, float]:
    """Amounts per second of processor time and of wall time, of one turn."""
    contestant.prepare()
    wall, cpu = time.perf_counter(), time.process_time()
    amount = contestant.run()
    return amount / (time.process_time() - cpu), amount / (time.perf_counter() - wall)


def ratio(rates: dict[str, Rates], name: str, to: str, *, clock: str = "") -> dict[str, Any]:
    """Ratio of two contestants' rates, paired by repeat: median and quartiles.

    Args:
        rates: of a race.
        name: numerator.
        to: denominator.
        clock: "cpu", "wall", or by default the one that counts for each.
    """
    clocks = {"": "values", "cpu": "per_cpu_second", "wall": "per_wall_second"}
    first, second = (getattr(rates[n], clocks[clock]) for n in (name, to))
    return {"of": name, "to": to, **spread(first / second)}


def spread(values: np.ndarray) -> dict[str, Any]:
    """Median and quartiles, for the results."""
    low, median, high = np.percentile(values, [25, 50, 75])
    return {"median": round(float(median), 3), "quartiles": [round(float(low), 3), round(float(high), 3)]}
