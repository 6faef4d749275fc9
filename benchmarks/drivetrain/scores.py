"""Scores of predictions on readings that a fit has not seen, and tables of what is left."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.drivetrain.fit import SCALE, Drives, Fit
from benchmarks.drivetrain.model import STEP, run
from benchmarks.drivetrain.parameters import ANTI_WINDUP, parameter_vector
from benchmarks.drivetrain.stretches import Stretch

Array = NDArray[np.float64]

TIME_EDGES = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2, 1.5, 2.0, 3.0, 4.0, 5.0, 6.2)
"""Of the time since a change of command [s]."""
LOAD_EDGES = (-22.0, -14.0, -10.0, -6.0, -3.0, -1.0, 1.0, 3.0, 6.0, 10.0, 14.0, 22.0)
"""Of the excess of a bank over the other in its own sense of rotation [rad/s]: the outer bank of a turn is driven."""
SPEED_EDGES = (0.0, 1.0, 2.0, 4.0, 6.0, 8.0, 10.0, 11.0, 12.0, 13.0, 14.0)
"""Of a bank's speed [rad/s]."""
SETTLED = 2.0
"""Time since a change of command from which residuals are looked at against load and speed [s]."""
FEWEST = 15
"""Readings that a bin needs."""


def rms(values: Array) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))


def size(values: Array) -> dict[str, float]:
    """R.m.s. and median of the magnitude, as JSON."""
    return {"rms": rms(values), "median": float(np.median(np.abs(values))), "readings": len(values)}


def loss(values: Array) -> Array:
    """The loss (n,) that fits minimise."""
    return SCALE**2 * (np.sqrt(1.0 + (values / SCALE) ** 2) - 1.0)


def joined(stretches: Sequence[Stretch], name: str) -> Array:
    """One field of all stretches (n,)."""
    return np.concatenate([getattr(s, name) for s in stretches])


def held_out(folds: Sequence[Fit]) -> dict[str, Array]:
    """Residuals of all readings (n,) by drive, each from the fold that has not seen it."""
    first, second = folds
    return {d: np.where(first.fitted[d], second.residuals[d], first.residuals[d]) for d in first.values}


def by_step(step: NDArray[np.int64], values: Array) -> Array:
    """Sums (k,) of values (n,) over the readings of each step."""
    return np.bincount(np.unique(step, return_inverse=True)[1], values)


def summed(values: Array) -> tuple[float, float]:
    """Sum of values (k,) that are independent of each other, and its standard deviation."""
    return float(values.sum()), float(np.sqrt(len(values)) * np.std(values))


def compare(drives: Drives, base: Mapping[str, Array], other: Mapping[str, Array]) -> dict[str, Any]:
    """What a changed model does to the held-out loss: its change summed over steps, in standard deviations too.

    Args:
        drives: stretches by drive.
        base: held-out residuals by drive of the model of the study.
        other: of the changed model.
    """
    changes = []
    for drive, stretches in drives.items():
        changes.append(by_step(joined(stretches, "step"), loss(other[drive]) - loss(base[drive])))
    change, deviation = summed(np.concatenate(changes))
    return {
        "loss_change": change,
        "deviation": deviation,
        "drives": {drive: size(found) for drive, found in other.items()},
    }


def _bins(where: Array, edges: Sequence[float], values: Array) -> list[dict[str, float]]:
    rows = []
    for low, high in itertools.pairwise(edges):
        mine = values[(where >= low) & (where < high)]
        if len(mine) >= FEWEST:
            quarter = np.percentile(mine, [25, 50, 75])
            rows.append({"low": low, "high": high, "rms": rms(mine), "median": float(quarter[1]),
                         "quartiles": [float(quarter[0]), float(quarter[2])], "readings": len(mine)})  # fmt: skip
    return rows


def residual_tables(
    stretches: list[Stretch], left: Array, values: Mapping[str, float], windup: str
) -> dict[str, list[dict[str, float]]]:
    """Residuals against time since a change of command, load and speed; signed so that + is faster than the model.

    Args:
        stretches: of one drive.
        left: held-out residuals (n,).
        values: parameters that give the speeds by which readings are sorted.
        windup: of ANTI_WINDUP.
    """
    p = parameter_vector(values)
    speeds = np.concatenate([_speeds(p, s, ANTI_WINDUP[windup]) for s in stretches])
    sense = np.sign(speeds[:, 0])
    since = joined(stretches, "since")
    late = since > SETTLED
    return {
        "since_change": _bins(since, TIME_EDGES, left),
        "excess_over_other": _bins((sense * (speeds[:, 0] - speeds[:, 1]))[late], LOAD_EDGES, (sense * left)[late]),
        "speed": _bins(np.abs(speeds[late, 0]), SPEED_EDGES, (sense * left)[late]),
    }


def _speeds(p: Array, stretch: Stretch, windup: int) -> Array:
    """Speeds (n, 2) of the model at the readings: of the bank that is read, and of the other."""
    motion = run(p, stretch, windup)
    rows = np.round(stretch.time / STEP).astype(int)
    return np.stack([motion[rows, stretch.bank], motion[rows, 1 - stretch.bank]], axis=1)


def shares_of_square(table: Sequence[Mapping[str, float]], low: float, high: float) -> float:
    """Share of the squared residual in bins within (low, high)."""
    power = [row["rms"] ** 2 * row["readings"] for row in table]
    inside = [p for p, row in zip(power, table, strict=True) if row["low"] >= low and row["high"] <= high]
    return sum(inside) / sum(power)
