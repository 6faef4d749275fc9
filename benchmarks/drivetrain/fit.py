"""One fit over several drives: the robot's parameters shared, those of the load by drive."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, least_squares

from benchmarks.drivetrain.model import residuals
from benchmarks.drivetrain.parameters import ALL, OWN, USED, starting_values
from benchmarks.drivetrain.stretches import Stretch

Array = NDArray[np.float64]
Drives = Mapping[str, list[Stretch]]
Values = dict[str, float]

SCALE = 0.3
"""Residual from which the loss turns from square to absolute [rad/s]: the median of good fits."""
WORST = 50.0
"""Residual that stands for one that is not finite or larger [rad/s]; no wheel here turns faster than 17."""
STEPS = 40
"""Steps of the solver at most; fits of the study end after 10 to 25."""
TOLERANCE = 2e-4
"""Relative change of cost and parameters at which a fit ends: 0.3 of a cost of 1400, below what a start elsewhere
changes."""
NUDGE = 1e-3
"""Relative step of the derivatives, of parameters or their logarithms; predictions are smooth on it."""
MOST_STEPS = 10_000
"""Above the number of steps of any drive; tells the steps of drives apart."""
SPREAD = 0.3
"""Standard deviation of further starts in the logarithms (ours)."""


@dataclass(frozen=True)
class Entry:
    """A fitted number: a parameter, of one drive or (None) of all."""

    name: str
    drive: str | None


@dataclass(frozen=True)
class Fit:
    """A fit and what it predicts.

    Attributes:
        values: parameters by drive.
        residuals: of all readings (n,) by drive [rad/s].
        fitted: which readings (n,) the fit has seen, by drive.
        cost: robust cost over these.
        deviations: standard deviation of the fitted numbers, of logarithms where these were fitted; residuals are
            taken as independent between steps only.
    """

    values: Mapping[str, Values]
    residuals: Mapping[str, Array]
    fitted: Mapping[str, NDArray[np.bool_]]
    cost: float
    deviations: Mapping[Entry, float]


@dataclass(frozen=True)
class Problem:
    """What is fitted to what.

    Attributes:
        drives: stretches by drive.
        shared: parameters of all drives together.
        own: parameters of each drive.
        fixed: further parameters that the model has, by drive.
        windup: of ANTI_WINDUP.
        parity: 0 or 1, of the steps that are fitted; None for all.
    """

    drives: Drives
    shared: Sequence[str] = USED
    own: Sequence[str] = OWN
    fixed: Mapping[str, Values] | None = None
    windup: str = "within_limit"
    parity: int | None = 0

    def entries(self) -> list[Entry]:
        """The fitted numbers."""
        mine = [Entry(name, drive) for name in self.own for drive in self.drives]
        return [Entry(name, None) for name in self.shared] + mine

    def values(self, x: Array) -> dict[str, Values]:
        """Parameters by drive for the fitted numbers."""
        found = {drive: dict((self.fixed or {}).get(drive, {})) for drive in self.drives}
        for entry, number in zip(self.entries(), x, strict=True):
            value = float(np.exp(number)) if ALL[entry.name].positive else float(number)
            for drive in self.drives if entry.drive is None else (entry.drive,):
                found[drive][entry.name] = value
        return found

    def start(self, given: Mapping[str, Values]) -> Array:
        """Fitted numbers at the values given by drive, else at the defaults."""
        chosen = starting_values([*self.shared, *self.own])
        numbers = []
        for entry in self.entries():
            drive = entry.drive or next(iter(self.drives))
            value = given.get(drive, {}).get(entry.name, chosen[entry.name])
            numbers.append(np.log(value) if ALL[entry.name].positive else value)
        return np.array(numbers)

    def seen(self) -> dict[str, NDArray[np.bool_]]:
        """Readings (n,) that are fitted, by drive."""
        steps = {drive: np.concatenate([s.step for s in stretches]) for drive, stretches in self.drives.items()}
        return {d: np.ones(len(s), bool) if self.parity is None else s % 2 == self.parity for d, s in steps.items()}


def fit_drives(problem: Problem, start: Mapping[str, Values] | None = None, starts: int = 1, seed: int = 0) -> Fit:
    """Best fit from one or several starts.

    Args:
        problem: what is fitted.
        start: values from which to start, by drive; defaults where absent.
        starts: number of starts; those after the first are scattered about it.
        seed: of their scatter.
    """
    seen = problem.seen()
    counts = {drive: len(rows) for drive, rows in seen.items()}
    used = np.concatenate(list(seen.values()))
    rng = np.random.default_rng(seed)
    first = problem.start(start or {})
    evaluate, slopes = _functions(problem, counts, used)
    found: list[OptimizeResult] = []
    for number in range(starts):
        x = first + (SPREAD * rng.standard_normal(len(first)) * _widths(problem) if number else 0.0)
        found.append(
            least_squares(
                lambda x: evaluate(x)[used], x, jac=slopes, loss="soft_l1", f_scale=SCALE, max_nfev=STEPS,
                ftol=TOLERANCE, xtol=TOLERANCE,
            )
        )  # fmt: skip
    best = min(found, key=lambda result: result.cost)
    edges = np.cumsum([0, *counts.values()])
    parts = {d: evaluate(best.x)[a:b] for d, a, b in zip(counts, edges, edges[1:], strict=False)}
    return Fit(problem.values(best.x), parts, seen, float(best.cost), _deviations(problem, best, used))


def _widths(problem: Problem) -> Array:
    """Starts of limited numbers scatter less: a delay twice as long finds no way back."""
    return np.array([0.3 if e.name in ("delay", "top_speed") or not ALL[e.name].positive else 1.0
                     for e in problem.entries()])  # fmt: skip


def _functions(
    problem: Problem, counts: Mapping[str, int], used: NDArray[np.bool_]
) -> tuple[Callable[[Array], Array], Callable[[Array], Array]]:
    """Residuals of all readings, and derivatives of the fitted ones; a drive's own numbers touch its rows only."""
    edges = np.cumsum([0, *counts.values()])
    rows = {drive: slice(a, b) for drive, a, b in zip(counts, edges, edges[1:], strict=False)}

    def of(values: Mapping[str, Values], drive: str) -> Array:
        found = residuals(values[drive], problem.drives[drive], problem.windup)
        return np.clip(np.nan_to_num(found, nan=WORST, posinf=WORST, neginf=-WORST), -WORST, WORST)

    def evaluate(x: Array) -> Array:
        values = problem.values(x)
        return np.concatenate([of(values, drive) for drive in problem.drives])

    def slopes(x: Array) -> Array:
        base = evaluate(x)
        matrix = np.zeros((len(base), len(x)))
        for column, entry in enumerate(problem.entries()):
            step = NUDGE * max(abs(x[column]), SPREAD)
            moved = x.copy()
            moved[column] += step
            values = problem.values(moved)
            for drive in problem.drives if entry.drive is None else (entry.drive,):
                matrix[rows[drive], column] = (of(values, drive) - base[rows[drive]]) / step
        return matrix[used]

    return evaluate, slopes


def _deviations(problem: Problem, best: OptimizeResult, used: NDArray[np.bool_]) -> dict[Entry, float]:
    """Sandwich estimate with steps as clusters: readings of one step share its timing and its patch of ground."""
    step = np.concatenate(
        [
            10_000 * k + np.concatenate([s.step for s in stretches])
            for k, stretches in enumerate(problem.drives.values())
        ]
    )[used]
    # least_squares scales derivatives by (1 + z)^(-3/4), z = (r / scale)^2; the loss's slope is r (1 + z)^(-1/2)
    weighted = best.jac
    information = np.linalg.pinv(weighted.T @ weighted, rcond=1e-10)
    weight = (1.0 + (best.fun / SCALE) ** 2) ** 0.25
    clusters = np.unique(step, return_inverse=True)[1]
    scores = np.zeros((clusters.max() + 1, weighted.shape[1]))
    np.add.at(scores, clusters, weighted * (best.fun * weight)[:, None])
    covariance = information @ (scores.T @ scores) @ information
    return dict(zip(problem.entries(), np.sqrt(np.maximum(np.diag(covariance), 0.0)).tolist(), strict=True))
