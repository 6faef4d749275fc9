"""From episodes to the table that answers: which controller, how far off, how sure."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.evaluation.campaign import absolute_errors
from ddagr_gym.evaluation.statistics import (
    bootstrap,
    interquartile_mean,
    paired_probability_of_improvement,
    wilson_interval,
)

Rows = Sequence[dict[str, Any]]
_SEED = 0


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _interval(values: Sequence[float], statistic: Callable[[NDArray[np.float64]], float]) -> dict[str, float | None]:
    """Estimate with 95 % bootstrap interval over scenarios; failures are infinite and come out as None."""
    scores = np.asarray(values, dtype=float)[None, :]
    if scores.shape[1] < 2:
        estimate = float(statistic(scores))
        return {"value": _finite(estimate), "low": None, "high": None}
    found = bootstrap(scores, statistic, np.random.default_rng(_SEED), resampling="crossed", resamples=1000)
    return {"value": _finite(found.estimate), "low": _finite(found.low), "high": _finite(found.high)}


def _quantile(level: float) -> Callable[[NDArray[np.float64]], float]:
    # an order statistic, so that a few infinite scores make no NaN
    return lambda scores: float(np.quantile(scores, level, method="inverted_cdf"))


def _share(rows: Rows, key: str) -> dict[str, float | None]:
    found = wilson_interval(sum(bool(row[key]) for row in rows), len(rows))
    return {"value": found.estimate, "low": found.low, "high": found.high}


def summarise(rows: Rows) -> dict[str, Any]:
    """Summary of one controller on one set; infeasible scenarios are counted apart.

    Returns:
        ``radius_error_median``, ``radius_error_p95``, ``radius_error_iqm`` of |e_R|, ``radius_error_signed_median``,
        ``success_rate``, ``practice_rate``, each {value, low, high} (95 %), and plain medians of the costs.
    """
    feasible = [row for row in rows if row["feasible"]]
    errors = absolute_errors(feasible)
    signed = [row["radius_error"] for row in feasible if row["radius_error"] is not None]
    summary: dict[str, Any] = {
        "episodes": len(feasible),
        "infeasible": len(rows) - len(feasible),
        "undefined_radius": sum(not math.isfinite(error) for error in errors),
        "inconsistent_radius": sum(not row["radius_consistent"] for row in feasible),
    }
    if not feasible:
        return summary
    summary["radius_error_median"] = _interval(errors, _quantile(0.5))
    summary["radius_error_p95"] = _interval(errors, _quantile(0.95))
    summary["radius_error_iqm"] = _interval(errors, interquartile_mean)
    if signed:
        summary["radius_error_signed_median"] = _interval(signed, _quantile(0.5))
    summary["success_rate"] = _share(feasible, "success")
    summary["practice_rate"] = _share(feasible, "within_practice")
    for key in ("headland_depth", "duration", "slip_energy", "wheel_speed_variation", "radial_error_rms"):
        known = [row[key] for row in feasible if row[key] is not None]
        summary[f"{key}_median"] = float(np.median(known)) if known else None
    return summary


def summaries(rows: Rows) -> dict[str, dict[str, Any]]:
    """``{controller: {set: summary}}``."""
    result: dict[str, dict[str, Any]] = {}
    for controller in dict.fromkeys(row["controller"] for row in rows):
        mine = [row for row in rows if row["controller"] == controller]
        result[controller] = {
            name: summarise([row for row in mine if row["set"] == name])
            for name in dict.fromkeys(r["set"] for r in mine)
        }
    return result


def improvement(rows: Rows, candidate: str, baseline: str, set_name: str) -> dict[str, float | None] | None:
    """Probability that ``candidate`` has the smaller |e_R| on feasible scenarios of a set; None without common ones."""
    pairs = []
    for controller in (candidate, baseline):
        chosen = [r for r in rows if r["controller"] == controller and r["set"] == set_name and r["feasible"]]
        pairs.append(dict(zip([r["number"] for r in chosen], absolute_errors(chosen), strict=True)))
    common = sorted(set(pairs[0]) & set(pairs[1]))
    if not common:
        return None
    found = paired_probability_of_improvement([pairs[0][n] for n in common], [pairs[1][n] for n in common])
    return {"value": found.estimate, "low": found.low, "high": found.high}
