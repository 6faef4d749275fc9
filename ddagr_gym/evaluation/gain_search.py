"""Search of a box for the gains that drive best: successive halving, the same for every controller.

Candidates are points of the box, logarithmic along each axis: the first half a Sobol sequence, then two rounds around
the best so far. All are driven on the first scenarios, the best of them on more, the last few on all (successive
halving), and with them the values that were chosen by hand: a search that finds nothing better keeps those. The
objective, lower is better::

    median |e_R| + 95th percentile of |e_R| / 4 + share of turns that do not succeed

with an undefined radius counted as 1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

Outcome = tuple[float | None, bool]
"""e_R, None where it is undefined, and success of an episode."""

Wanted = tuple[dict[str, float], int]
"""An episode: values, and number of a scenario."""

Drive = Callable[[Sequence[Wanted]], Sequence[Outcome]]
"""Drives episodes, which do not depend on each other, and gives their outcomes in their order."""

_SPREADS = (0.15, 0.06)
"""Standard deviations of the two rounds of refinement, shares of the box."""


@dataclass(frozen=True)
class SearchBox:
    """What is searched.

    Attributes:
        axes: (name, low, high) each, low above 0.
        start: values chosen by hand before any search, in the order of the axes.
    """

    axes: tuple[tuple[str, float, float], ...]
    start: tuple[float, ...]

    def values(self, point: Array) -> dict[str, float]:
        """Values at a point of the unit cube, to four digits."""
        return {
            name: float(f"{low * (high / low) ** float(share):.4g}")
            for (name, low, high), share in zip(self.axes, point, strict=True)
        }

    def by_hand(self) -> dict[str, float]:
        """Values chosen by hand, by name."""
        return dict(zip((name for name, _, _ in self.axes), self.start, strict=True))


def objective(outcomes: Sequence[Outcome]) -> float:
    """The module's objective of (e_R or None, success) of each episode."""
    errors = np.array([1.0 if error is None else min(abs(error), 1.0) for error, _ in outcomes])
    failures = float(np.mean([not success for _, success in outcomes]))
    return float(np.median(errors) + 0.25 * np.quantile(errors, 0.95, method="inverted_cdf") + failures)


def search_box(
    box: SearchBox,
    drive: Drive,
    stages: Sequence[tuple[int, int]],
    seed: int = 0,
) -> dict[str, Any]:
    """Best values of a box, and the record of the search.

    Args:
        box: to search.
        drive: all episodes of a stage at once; what was driven in an earlier one is not asked for again.
        stages: (candidates, scenarios); fewer candidates and more scenarios in a later one.
        seed: of the candidates.
    """
    search = _Search(box, drive)
    count, scenarios = stages[0]
    candidates, scores = search.explore(count, scenarios, seed)
    first_score, driven = min(scores), scenarios
    for count, scenarios in stages[1:]:
        best = np.argsort(scores, kind="stable")[:count]
        candidates = [candidates[i] for i in best]
        scores = search.scores(candidates, driven, scenarios)
        driven = scenarios
    scores += search.scores([box.by_hand()], 0, driven)
    candidates.append(box.by_hand())
    order = np.argsort(scores, kind="stable")
    return {
        "best": candidates[order[0]],
        "objective": scores[order[0]],
        "objective_by_hand": scores[-1],
        "objective_on_the_first_scenarios": first_score,
        "finalists": [{"values": candidates[i], "objective": scores[i]} for i in order],
    }


def episodes_of(stages: Sequence[tuple[int, int]]) -> int:
    """Episodes that a search drives."""
    last, total = 0, stages[-1][1]
    for count, scenarios in stages:
        total += count * (scenarios - last)
        last = scenarios
    return total


class _Search:
    """Outcomes so far."""

    def __init__(self, box: SearchBox, drive: Drive) -> None:
        self._box, self._drive = box, drive
        self._driven: dict[tuple[str, int], Outcome] = {}

    def scores(self, candidates: Sequence[dict[str, float]], first: int, last: int) -> list[float]:
        """Objective of candidates on the scenarios up to ``last``, of which those before ``first`` are driven."""
        wanted = [(values, number) for values in candidates for number in range(first, last)]
        for (values, number), outcome in zip(wanted, self._drive(wanted), strict=True):
            self._driven[repr(values), number] = outcome
        return [objective([self._driven[repr(values), n] for n in range(last)]) for values in candidates]

    def explore(self, count: int, scenarios: int, seed: int) -> tuple[list[dict[str, float]], list[float]]:
        """Candidates of the first stage and their objective."""
        from scipy.stats import qmc

        size, half = len(self._box.axes), count // 2
        points = [qmc.Sobol(size, rng=np.random.default_rng(seed)).random(half)]
        candidates = [self._box.values(point) for point in points[0]]
        scores = self.scores(candidates, 0, scenarios)
        rng = np.random.default_rng([seed, 1])
        for spread, share in zip(_SPREADS, (count - half - (count - half) // 2, (count - half) // 2), strict=True):
            middle = np.concatenate(points)[int(np.argmin(scores))]
            points.append(np.clip(middle + spread * rng.standard_normal((share, size)), 0.0, 1.0))
            added = [self._box.values(point) for point in points[-1]]
            scores += self.scores(added, 0, scenarios)
            candidates += added
        return candidates, scores
