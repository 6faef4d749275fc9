"""From episodes to the tables that answer: which controller, how far off, how sure.

A summary is ``{arm: {set: {metric: {"value": number, "interval": [low, high]}}}}``; an arm is a controller, or all
training seeds of one policy. Intervals are of 95 %. None stands for a value that a failure makes infinite, and for an
interval that nothing was left to draw from. Counts are plain integers. Failures count as worst, never as absent;
scenarios that no upper bound makes are left out of the metrics and counted apart.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.evaluation.policy_seeds import same_seed
from ddagr_gym.evaluation.report_data import arm_name, size_of
from ddagr_gym.evaluation.statistics import (
    Interval,
    Resampling,
    bootstrap,
    interquartile_mean,
    median_interval,
    paired_probability_of_improvement,
    performance_profile,
    probability_of_improvement,
    wilson_interval,
)

Rows = Sequence[dict[str, Any]]
Array = NDArray[np.float64]
Value = dict[str, Any]

BASELINES = ("B1", "B4")
"""Arms against which every other one is compared (theory: control, section 3)."""

PROFILE_THRESHOLDS = tuple(round(0.005 * k, 3) for k in range(41))
"""|e_R| at which performance profiles are given: 0 to 20 %."""

_RESAMPLES = 1000
"""Of the bootstrap (ours: 25 of them lie beyond each end of a 95 % interval)."""

_SEED = 0
"""Of the bootstrap: the same episodes give the same intervals."""

_LOST_WITH_THE_TURN = (
    "exit_lateral_error",
    "exit_heading_error",
    "fit_residual",
    "radius_disagreement",
    "radial_error_rms",
    "radial_error_maximum",
)
"""Sizes whose median is given; undefined means that the turn failed, which is the worst value."""

_KNOWN_OR_NOT = (
    "headland_depth",
    "duration",
    "slip_energy",
    "wheel_speed_variation",
    "estimator_speed_rms",
    "estimator_yaw_rate_rms",
    "estimator_slip_rms",
    "estimator_radius",
    "estimator_prediction_1s",
    "estimator_prediction_5s",
    "estimator_dead_reckoning",
    "estimator_innovation",
)
"""Sizes whose median is given over the episodes that have them."""


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _as_value(found: Interval) -> Value:
    return {"value": _finite(found.estimate), "interval": [_finite(found.low), _finite(found.high)]}


def _interval(scores: Array, statistic: Callable[[Array], float], resampling: Resampling = "crossed") -> Value:
    """Estimate with its bootstrap interval over scenarios, and over runs where there are several."""
    if scores.size < 2:
        return {"value": _finite(float(statistic(scores))), "interval": None}
    rng = np.random.default_rng(_SEED)
    return _as_value(bootstrap(scores, statistic, rng, resampling=resampling, resamples=_RESAMPLES))


def _quantile(level: float) -> Callable[[Array], float]:
    # an order statistic, so that a few infinite scores make no NaN
    return lambda scores: float(np.quantile(scores, level, method="inverted_cdf"))


class _Table:
    """Rows of one arm on one set as matrices (runs, scenarios)."""

    def __init__(self, rows: Rows) -> None:
        by_run: dict[Any, dict[int, dict[str, Any]]] = {}
        for row in rows:
            other = by_run.setdefault(row.get("run", 0), {}).setdefault(row["number"], row)
            if other["controller"] != row["controller"]:
                raise same_seed(other["controller"], row["controller"], arm_name(row), row.get("run", 0))
        self.numbers = sorted(set.intersection(*(set(run) for run in by_run.values())))
        dropped = sum(len(run) for run in by_run.values()) - len(by_run) * len(self.numbers)
        if dropped:
            raise InputError(
                f"{rows[0].get('arm', rows[0]['controller'])!r} lacks {dropped} episodes of set {rows[0]['set']!r} in "
                "some of its runs: evaluate all of its seeds on the same scenarios."
            )
        self._runs = [[by_run[run][number] for number in self.numbers] for run in sorted(by_run)]

    @property
    def runs(self) -> int:
        return len(self._runs)

    @property
    def rows(self) -> list[dict[str, Any]]:
        return [row for run in self._runs for row in run]

    def errors(self) -> Array:
        return np.array([[size_of(row) for row in run] for run in self._runs])

    def sizes(self, key: str) -> Array:
        """|value|, infinite where it is undefined."""
        return np.array([[math.inf if row.get(key) is None else abs(row[key]) for row in run] for run in self._runs])

    def share(self, key: str) -> Value:
        """Share of true values; Wilson's interval counts a scenario once, however many seeds drive it (ours)."""
        count = sum(bool(row[key]) for row in self.rows)
        return _as_value(wilson_interval(count / self.runs, len(self.numbers)))


def summarise(rows: Rows) -> dict[str, Any]:
    """Summary of one arm on one set.

    Returns:
        ``radius_error_median``, ``radius_error_p95``, ``radius_error_iqm`` of |e_R|, ``radius_error_signed_median``,
        ``success_rate``, ``practice_rate``, ``stall_rate``, ``<size>_median`` of exits (as sizes), costs and estimator
        errors; ``profile`` with thresholds, share, low and high; counts.
    """
    feasible = [row for row in rows if row["feasible"]]
    left_out = [row for row in rows if not row["feasible"]]
    summary: dict[str, Any] = {
        "episodes": len(feasible),
        "runs": len({row.get("run", 0) for row in rows}),
        "infeasible": len({row["number"] for row in left_out}),
        "infeasible_but_made": sum(bool(row["success"]) for row in left_out),
        "undefined_radius": sum(math.isinf(size_of(row)) for row in feasible),
        "inconsistent_radius": sum(not row["radius_consistent"] for row in feasible),
    }
    return summary | _metrics(_Table(feasible)) if feasible else summary


def _metrics(table: _Table) -> dict[str, Any]:
    errors, rows = table.errors(), table.rows
    resampling: Resampling = "stratified" if table.runs > 1 else "crossed"
    found: dict[str, Any] = {
        "radius_error_median": _interval(errors, _quantile(0.5)),
        "radius_error_p95": _interval(errors, _quantile(0.95)),
        "radius_error_iqm": _interval(errors, interquartile_mean, resampling),
    }
    signed = [row["radius_error"] for row in rows if math.isfinite(size_of(row))]
    if signed:
        found["radius_error_signed_median"] = _interval(np.array([signed]), _quantile(0.5))
    found["success_rate"] = table.share("success")
    found["practice_rate"] = table.share("within_practice")
    stalled = [{**row, "stalled": bool(row.get("bank_stalls") or row.get("robot_stalls"))} for row in rows]
    found["stall_rate"] = _Table(stalled).share("stalled")
    for key in _LOST_WITH_THE_TURN:
        found[f"{key}_median"] = _as_value(median_interval(_per_scenario(table.sizes(key))))
    for key in _KNOWN_OR_NOT:
        known = _per_scenario(table.sizes(key))
        known = known[np.isfinite(known)]
        found[f"{key}_median"] = _as_value(median_interval(known)) if known.size else None
    found["profile"] = _profile(errors)
    return found


def _per_scenario(sizes: Array) -> Array:
    """Median over runs of each scenario, so that scenarios stay independent of each other."""
    return np.asarray(np.quantile(sizes, 0.5, axis=0, method="inverted_cdf"))


def _profile(errors: Array) -> dict[str, list[float]] | None:
    if errors.size < 2:
        return None
    rng = np.random.default_rng(_SEED)
    found = performance_profile(errors, PROFILE_THRESHOLDS, rng, resampling="crossed", resamples=_RESAMPLES)
    return {name: getattr(found, name).tolist() for name in ("thresholds", "share", "low", "high")}


def summaries(rows: Rows, baselines: Sequence[str] = BASELINES) -> dict[str, dict[str, Any]]:
    """``{arm: {set: summary}}``, with ``improvement_over_`` each baseline where that was driven on the set too."""
    result: dict[str, dict[str, Any]] = {}
    for arm in dict.fromkeys(arm_name(row) for row in rows):
        mine = [row for row in rows if arm_name(row) == arm]
        result[arm] = {
            name: summarise([row for row in mine if row["set"] == name])
            for name in dict.fromkeys(row["set"] for row in mine)
        }
        for name, summary in result[arm].items():
            for baseline in baselines:
                found = improvement(rows, arm, baseline, name) if arm != baseline else None
                if found is not None:
                    summary[f"improvement_over_{baseline}"] = found
    return result


def improvement(rows: Rows, candidate: str, baseline: str, set_name: str) -> Value | None:
    """Probability that the arm ``candidate`` has the smaller |e_R| on a feasible scenario of a set, ties one half.

    Scenarios are paired: the same soil and the same noise. One run each: Wilson's interval; several: bootstrap over
    runs and scenarios. None where one of them has no such scenario.
    """
    chosen = {
        arm: [row for row in rows if arm_name(row) == arm and row["set"] == set_name and row["feasible"]]
        for arm in (candidate, baseline)
    }
    if not all(chosen.values()):
        return None
    first, second = _Table(chosen[candidate]), _Table(chosen[baseline])
    common = sorted(set(first.numbers) & set(second.numbers))
    if not common:
        return None
    scores = [table.errors()[:, [table.numbers.index(number) for number in common]] for table in (first, second)]
    if first.runs == second.runs == 1:
        return _as_value(paired_probability_of_improvement(scores[0][0], scores[1][0]))
    rng = np.random.default_rng(_SEED)
    return _as_value(probability_of_improvement(scores[0], scores[1], rng, resampling="crossed", resamples=_RESAMPLES))
