"""Turns as one document: bounds, errors and their ratios with 95 % intervals over turns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.filter_study.summary import RESAMPLES
from benchmarks.velocity_bound.filters import ESTIMATORS
from benchmarks.velocity_bound.study import BOUNDS, CHECKED_NOISE
from benchmarks.velocity_bound.turn_model import MOTION
from ddagr_gym.control.timing import CONTROL_PERIOD
from ddagr_gym.evaluation.controllers import STANDING

Array = NDArray[np.float64]
Turn = Mapping[str, Any]

VELOCITIES = ("v_x", "v_y")
EXIT = {"along": ("mm", 1e3), "across": ("mm", 1e3), "heading": ("deg", np.degrees(1.0))}
"""Pose at the next row's start line: unit, and how many of it are 1 m or 1 rad."""
_EVERY = 5  # control instants from one to the next of a series: 0.4 s


def root_ratio(squares: Array, variances: Array | None, rng: np.random.Generator) -> dict[str, Any]:
    """Root of the mean of squares (N,) over that of variances (N,) of the same turns, with a bootstrap interval.

    Without variances the root alone. Turns on which a filter broke down have infinite squares and give None.
    """
    below = np.ones(len(squares)) if variances is None else variances
    drawn = rng.integers(len(squares), size=(RESAMPLES, len(squares)))
    found = np.sqrt(squares[drawn].mean(axis=1) / below[drawn].mean(axis=1))
    low, high = np.quantile(found, [0.025, 0.975], method="inverted_cdf")
    value = np.sqrt(squares.mean() / below.mean())
    return {"value": _rounded(value), "interval": [_rounded(low), _rounded(high)]}


def _rounded(value: Any) -> float | None:
    return float(f"{float(value):.4g}") if np.isfinite(value) else None


def _errors(rows: Sequence[Turn], key: str, rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, Array]]:
    """Figures and mean squares by name of one estimate or bound."""
    velocity, pose = (np.array([row[name] for row in rows], dtype=float) for name in ("velocity", key))
    velocity, pose = (np.where(np.isfinite(a), a, np.inf) for a in (velocity, pose))
    squares = {f"{name}_mm_s": 1e6 * velocity[:, i] for i, name in enumerate(VELOCITIES)}
    squares |= {f"exit_{name}_{unit}": size**2 * pose[:, i] for i, (name, (unit, size)) in enumerate(EXIT.items())}
    return {name: root_ratio(own, None, rng) for name, own in squares.items()}, squares


def summarise_plant(turns: Sequence[Turn]) -> dict[str, Any]:
    """Bounds, filters and their ratios to the bound of the task, series over time, and the smoother's check."""
    rng = np.random.default_rng(0)
    result: dict[str, Any] = {
        "turns": len(turns),
        "unknowns": [turn["unknowns"] for turn in turns],
        "variation_kept": _rounded(min(turn["kept"] for turn in turns)),
        "bounds": {},
        "filters": {},
    }
    own: dict[str, Array] = {}
    for name in BOUNDS:
        rows = [turn["bounds"][name] for turn in turns if name in turn["bounds"]]
        if rows:
            figures, squares = _errors(rows, "exit", rng)
            reckoned = _errors(rows, "reckoned", rng)[0]
            own = squares if name == "task" else own
            result["bounds"][name] = figures | {
                key.replace("exit", "reckoned"): value for key, value in reckoned.items() if key.startswith("exit")
            }
    for name in ESTIMATORS:
        figures, squares = _errors([turn["filters"][name] for turn in turns], "exit", rng)
        ratios = {key: root_ratio(squares[key], own[key], rng) for key in squares}
        result["filters"][name] = figures | {"over_bound": ratios}
    return result | {"series": _series(turns), "smoother": _check([t["smoother"] for t in turns if "smoother" in t])}


def _series(turns: Sequence[Turn]) -> dict[str, Any]:
    """Root mean squares of v_x and v_y over turns, as long as all of them last [mm/s]."""
    length = min(turn["exit"] for turn in turns) + 1
    rows = slice(0, length, _EVERY)
    heading = np.mean([turn["turning"][:length] for turn in turns], axis=0)[rows]
    found: dict[str, Any] = {
        "t": [round(CONTROL_PERIOD * (STANDING + 1 + k), 3) for k in range(0, length, _EVERY)],
        "heading_deg": np.round(np.degrees(heading), 1).tolist(),
    }
    for name in turns[0]["series"]:
        squares = np.array([turn["series"][name][:length] for turn in turns], dtype=float)
        roots = 1e3 * np.sqrt(squares.mean(axis=0))[rows]
        found[name] = {v: [_rounded(value) for value in roots[:, i]] for i, v in enumerate(VELOCITIES)}
    return found


def _check(rows: Sequence[Turn]) -> dict[str, Any]:
    """The smoother's errors over the bound from all readings: of each motion over the turn, and of it at the end."""
    if not rows:
        return {}
    rng = np.random.default_rng(1)
    found: dict[str, Any] = {}
    for noise in CHECKED_NOISE:
        given = [row for row in rows if noise in row]
        if not given:
            continue
        own = [row[noise] for row in given]
        table: dict[str, Any] = {
            "turns": len(given),
            "unknowns": _rounded(np.mean([item["unknowns"] for item in own])),
        }
        for i, name in enumerate(MOTION):
            for key, bound, title in (("square", "bound", name), ("square_at_end", "bound_at_end", f"{name}_at_end")):
                squares, variances = (
                    np.array([item[part][i] for item in items]) for items, part in ((own, key), (given, bound))
                )
                table[title] = root_ratio(squares, variances, rng)
        found[noise] = table
    return found


def table(result: Mapping[str, Any]) -> str:
    """Markdown: of every plant the bounds, and the filters with their ratio to the bound of the task."""
    lines = []
    head = "| | v_x, v_y [mm/s] | over the bound: v_x, v_y | exit along, across [mm], heading [deg] |"
    for plant, found in result["plants"].items():
        lines += [f"**{plant}**", "", head, "|---" * 4 + "|"]
        rows = {f"bound: {BOUNDS[name][0]}": own for name, own in found["bounds"].items()}
        rows |= {ESTIMATORS[name][0]: own for name, own in found["filters"].items()}
        for title, own in rows.items():
            ratios = own.get("over_bound", {})
            text = ", ".join(_with_interval(ratios[f"{name}_mm_s"]) for name in VELOCITIES) if ratios else ""
            velocity = ", ".join(_shown(own[f"{name}_mm_s"]["value"]) for name in VELOCITIES)
            pose = ", ".join(_shown(own[f"exit_{name}_{unit}"]["value"]) for name, (unit, _) in EXIT.items())
            lines.append(f"| {title} | {velocity} | {text} | {pose} |")
        lines.append("")
    return "\n".join(lines)


def _shown(value: float | None) -> str:
    return "broke down" if value is None else f"{value:.2g}" if value < 10.0 else f"{value:.0f}"


def _with_interval(found: Mapping[str, Any]) -> str:
    return f"{_shown(found['value'])} ({' to '.join(_shown(v) for v in found['interval'])})"
