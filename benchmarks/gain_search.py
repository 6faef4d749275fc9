"""Search for the gains of the ladder's closed loops: the same budget, scenarios and objective for every controller.

Candidates are points of a box, logarithmic along each axis: the first half a Sobol sequence, then two rounds around the
best so far. All are driven on the first scenarios of the validation set, the best of them on more, the last few on all
of the search's (successive halving), and with them the gains that were chosen by hand: a search that finds nothing
better keeps those. The objective, lower is better::

    median |e_R| + 95th percentile of |e_R| / 4 + share of turns that do not succeed

with an undefined radius counted as 1. B6 is searched on other plants than the nominal one, development scenarios of
:mod:`benchmarks.row_turn_plants` with a seed of their own, all others on set V. Scenarios S0 to S8 and T are never
touched.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.row_turn_plants import scenario
from ddagr_gym.control.pid import PidGains
from ddagr_gym.envs.settings import Episode, TurnSettings
from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.evaluation.campaign import scenario_settings
from ddagr_gym.evaluation.controllers import EKF_CONTROLLERS, LadderGains, LoopSettings, find_controller, ladder_gains
from ddagr_gym.evaluation.metrics import turn_metrics
from ddagr_gym.evaluation.runs import drive_turn
from ddagr_gym.evaluation.scenarios import load_scenarios
from ddagr_gym.files import atomic_path

Array = NDArray[np.float64]

VALIDATION_SET = "V"

PLANT_SEED = 78_002
"""Of the development plants of a search; those of ``benchmarks/results/row_turn_plants.json`` have another."""

STAGES = ((64, 8), (16, 24), (4, 40))
"""Candidates that are driven on so many scenarios; with the hand-chosen gains 872 episodes for each controller."""

_SPREADS = (0.15, 0.06)
"""Standard deviations of the two rounds of refinement, shares of the box."""


_TRACKER = ("course", "ahead", "side_slip", "aligning")  # axes of B6 that are fields of LadderGains


@dataclass(frozen=True)
class SearchSpace:
    """Box of one controller.

    Attributes:
        axes: (name, low, high) each, low above 0.
        start: values chosen by hand before any search, in the order of the axes.
        apply: (gains, values by name) -> gains with these values.
        plants: names of :data:`benchmarks.row_turn_plants.PLANTS` that are driven in turn, instead of set V.
    """

    axes: tuple[tuple[str, float, float], ...]
    start: tuple[float, ...]
    apply: Callable[[LadderGains, dict[str, float]], LadderGains]
    plants: tuple[str, ...] = ()

    def values(self, point: Array) -> dict[str, float]:
        """Values at a point of the unit cube, to four digits."""
        return {
            name: float(f"{low * (high / low) ** float(share):.4g}")
            for (name, low, high), share in zip(self.axes, point, strict=True)
        }


def _loop(field: str, limit: float) -> Callable[[LadderGains, dict[str, float]], LadderGains]:
    def apply(gains: LadderGains, values: dict[str, float]) -> LadderGains:
        pid = PidGains(values["proportional"], values["integral"], values.get("derivative", 0.0), limit)
        loop = LoopSettings(pid, values["lead_factor"])
        changed: dict[str, Any] = {field: loop}
        if "heading" in values:
            changed["true_path_heading"] = values["heading"]
        changed |= {f"path_tracker_{name}": values[name] for name in _TRACKER if name in values}
        return replace(gains, **changed)

    return apply


_LEAD = ("lead_factor", 0.3, 3.0)

SPACES = {
    "B2": SearchSpace(
        (("proportional", 0.05, 20.0), ("integral", 0.02, 20.0), ("derivative", 1e-3, 1.0), _LEAD),
        (2.0, 2.0, 0.0, 1.0),
        _loop("yaw_rate", 3.0),
    ),
    "B3": SearchSpace(
        (("proportional", 0.1, 30.0), ("integral", 0.01, 10.0), ("derivative", 1e-3, 3.0), _LEAD),
        (3.0, 0.5, 0.0, 1.0),
        _loop("radial", 2.0),
    ),
    "B4": SearchSpace(
        (("proportional", 0.02, 5.0), ("integral", 0.05, 20.0), ("derivative", 1e-4, 0.3), _LEAD),
        (0.3, 1.0, 0.0, 1.0),
        _loop("force_balance", 1.0),
    ),
    "B5": SearchSpace(
        (
            ("lateral", 1.0, 500.0),
            ("heading", 0.1, 50.0),
            ("speed", 0.5, 50.0),
            ("change", 0.002, 0.5),
            ("offset_rate", 0.01, 0.5),
        ),
        (20.0, 2.0, 5.0, 0.05, 0.1),
        lambda gains, values: replace(gains, predictive=replace(gains.predictive, **values)),  # type: ignore[arg-type]
    ),
    "B6": SearchSpace(
        (
            ("proportional", 20.0, 150.0),
            ("integral", 0.5, 50.0),
            ("course", 6.0, 30.0),
            ("lead_factor", 0.05, 1.0),
            ("ahead", 0.05, 0.4),
            ("side_slip", 0.3, 1.0),
            ("aligning", 0.1, 0.6),
        ),
        (73.0, 20.0, 18.0, 0.05, 0.2, 0.7, 0.3),
        _loop("path_tracker", 3.0),
        ("level", "slope_3", "late", "slope_5", "lateral_0.8", "slope_3", "weaker", "slope_5"),
    ),
    "true_curvature": SearchSpace(
        (("proportional", 0.02, 5.0), ("integral", 0.05, 40.0), ("derivative", 1e-4, 0.3), _LEAD),
        (0.5, 3.0, 0.0, 1.0),
        _loop("true_curvature", 2.0),
    ),
    "true_soil": SearchSpace(
        (("proportional", 0.02, 5.0), ("integral", 0.05, 40.0), ("derivative", 1e-4, 0.3), _LEAD),
        (0.5, 3.0, 0.0, 1.0),
        _loop("true_soil", 2.0),
    ),
    "true_path": SearchSpace(
        (("proportional", 1.0, 100.0), ("integral", 0.05, 50.0), ("heading", 0.5, 20.0), _LEAD),
        (10.0, 2.0, 4.0, 1.0),
        _loop("true_path", 3.0),
    ),
}
"""Controllers that have something to search for; B0 has nothing, B1 is calibrated on the nominal soil."""


def objective(outcomes: Sequence[tuple[float | None, bool]]) -> float:
    """The module's objective of (e_R or None, success) of each episode."""
    errors = np.array([1.0 if error is None else min(abs(error), 1.0) for error, _ in outcomes])
    failures = float(np.mean([not success for _, success in outcomes]))
    return float(np.median(errors) + 0.25 * np.quantile(errors, 0.95, method="inverted_cdf") + failures)


class GainSearch:
    """Search of one controller, resumed from a journal of what has been driven.

    Args:
        controller: name in :data:`SPACES`.
        journal: JSON lines, appended as episodes end.
        seed: of the candidates.
        stages: see :data:`STAGES`; fewer scenarios and candidates in a later one.
        progress: called with the number of episodes as they end, those of the journal included.

    Raises:
        InputError: a controller without gains.
    """

    def __init__(
        self,
        controller: str,
        journal: Path,
        *,
        seed: int = 0,
        stages: Sequence[tuple[int, int]] = STAGES,
        progress: Callable[[int], None] = lambda episodes: None,
    ) -> None:
        if controller not in SPACES:
            raise unknown_name("controller with gains", controller, SPACES)
        self.controller, self.space, self.seed = controller, SPACES[controller], seed
        self.stages, self._progress, self._journal = tuple(stages), progress, journal
        self._scenarios = [] if self.space.plants else load_scenarios(VALIDATION_SET)[: self.stages[-1][1]]
        self._driven = self._read()

    def _read(self) -> dict[tuple[str, int], tuple[float | None, bool]]:
        driven = {}
        if self._journal.is_file():
            for line in self._journal.read_text(encoding="utf-8").splitlines():
                try:
                    item = json.loads(line)
                except json.JSONDecodeError:
                    break  # cut off by an interruption
                if item["controller"] == self.controller:
                    driven[item["values"], item["number"]] = (item["error"], item["success"])
        return driven

    def _scenario(self, number: int) -> tuple[TurnSettings, Episode, int]:
        plants = self.space.plants
        if plants:
            return scenario(plants[number % len(plants)], number, PLANT_SEED)
        found = self._scenarios[number]
        return scenario_settings(found, self.controller in EKF_CONTROLLERS), found.episode, found.seed

    def _drive(self, values: dict[str, float], number: int) -> tuple[float | None, bool]:
        key = json.dumps(values)
        if (key, number) not in self._driven:
            settings, episode, seed = self._scenario(number)
            gains = self.space.apply(ladder_gains(), values)
            run = drive_turn(find_controller(self.controller, episode.turn, gains), settings, seed, episode)
            error = turn_metrics(run.columns, run.episode.turn, run.episode.robot).turn.error
            self._driven[key, number] = (error, run.success)
            row = {"controller": self.controller, "values": key, "number": number, "error": error}
            with self._journal.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row | {"success": run.success}) + "\n")
        self._progress(1)
        return self._driven[key, number]

    def _scores(self, candidates: Sequence[dict[str, float]], first: int, last: int) -> list[float]:
        """Objective of candidates on the scenarios up to ``last``, of which those before ``first`` are driven."""
        for values in candidates:
            for number in range(first, last):
                self._drive(values, number)
        return [objective([self._driven[json.dumps(v), n] for n in range(last)]) for v in candidates]

    def run(self) -> dict[str, Any]:
        """Best values, and the record of the search."""
        count, scenarios = self.stages[0]
        candidates, scores = self._explore(count, scenarios)
        first_score = min(scores)
        driven = scenarios
        for count, scenarios in self.stages[1:]:
            best = np.argsort(scores, kind="stable")[:count]
            candidates = [candidates[i] for i in best]
            scores = self._scores(candidates, driven, scenarios)
            driven = scenarios
        start = dict(zip((name for name, _, _ in self.space.axes), self.space.start, strict=True))
        scores += self._scores([start], 0, driven)
        candidates.append(start)
        order = np.argsort(scores, kind="stable")
        return {
            "controller": self.controller,
            "seed": self.seed,
            "stages": [list(stage) for stage in self.stages],
            "axes": [list(axis) for axis in self.space.axes],
            "best": candidates[order[0]],
            "objective": scores[order[0]],
            "objective_by_hand": scores[-1],
            "objective_on_the_first_scenarios": first_score,
            "finalists": [{"values": candidates[i], "objective": scores[i]} for i in order],
        }

    def _explore(self, count: int, scenarios: int) -> tuple[list[dict[str, float]], list[float]]:
        """Candidates of the first stage and their objective."""
        from scipy.stats import qmc

        size, half = len(self.space.axes), count // 2
        points = [qmc.Sobol(size, rng=np.random.default_rng(self.seed)).random(half)]
        candidates = [self.space.values(point) for point in points[0]]
        scores = self._scores(candidates, 0, scenarios)
        rng = np.random.default_rng([self.seed, 1])
        for spread, share in zip(_SPREADS, (count - half - (count - half) // 2, (count - half) // 2), strict=True):
            middle = np.concatenate(points)[int(np.argmin(scores))]
            points.append(np.clip(middle + spread * rng.standard_normal((share, size)), 0.0, 1.0))
            added = [self.space.values(point) for point in points[-1]]
            scores += self._scores(added, 0, scenarios)
            candidates += added
        return candidates, scores


def episodes_of(stages: Sequence[tuple[int, int]]) -> int:
    """Episodes that a search of one controller drives."""
    last, total = 0, stages[-1][1]
    for count, scenarios in stages:
        total += count * (scenarios - last)
        last = scenarios
    return total


def write_gains(records: Sequence[dict[str, Any]], path: Path) -> LadderGains:
    """Write the present gains with what searches found in place, as YAML that :func:`ladder_gains` reads."""
    import yaml

    gains = ladder_gains()
    for record in records:
        gains = SPACES[record["controller"]].apply(gains, record["best"])
    head = (
        "# Gains of the controllers' loops; each output is a curvature [1/m] of at most `limit`. Found by\n"
        "# `ddagr tune-controllers` on the validation set, those of the path tracker on development plants; its\n"
        "# record is gain_search.json beside this file.\n"
    )
    with atomic_path(path) as temporary:
        temporary.write_text(head + yaml.safe_dump(asdict(gains), sort_keys=False), encoding="utf-8")
    return gains


def check_names(names: Sequence[str]) -> list[str]:
    """Names of controllers with gains, each once; InputError for others or none."""
    for name in names:
        if name not in SPACES:
            raise unknown_name("controller with gains", name, SPACES)
    if not names:
        raise InputError(f"no controller is named: give some of {', '.join(SPACES)}.")
    return list(dict.fromkeys(names))
