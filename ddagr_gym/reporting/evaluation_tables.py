"""Tables and sentences of an evaluation's page, as text; nothing is drawn here."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ddagr_gym.evaluation.report_data import (
    Evaluation,
    Row,
    arm_name,
    badness,
    best_arm,
    display_name,
    replay_name,
    size_of,
)
from ddagr_gym.evaluation.summary import BASELINES

NONE = "–"
FAILED = "failed"

ESTIMATOR = (
    ("estimator_speed_rms", "speed, r.m.s. [mm/s]", 1e3),
    ("estimator_yaw_rate_rms", "yaw rate, r.m.s. [mrad/s]", 1e3),
    ("estimator_slip_rms", "slip, r.m.s. [%]", 100.0),
    ("estimator_radius", "turn radius [%]", 100.0),
    ("estimator_prediction_1s", "position, 1 s ahead [mm]", 1e3),
    ("estimator_prediction_5s", "position, 5 s ahead [mm]", 1e3),
    ("estimator_dead_reckoning", "dead reckoning [% of the path]", 100.0),
    ("estimator_innovation", "innovation squared [-]", 1.0),
)
"""Key of the summary less ``_median``, words with the unit, factor to that unit."""

COST = (
    ("slip_energy", "slip energy [J]", 1.0),
    ("headland_depth", "headland depth [m]", 1.0),
    ("duration", "duration [s]", 1.0),
    ("wheel_speed_variation", "wheel speed variation [rad/s²]", 1.0),
    ("radial_error_rms", "radial error, r.m.s. [mm]", 1e3),
    ("exit_lateral_error", "exit, lateral [mm]", 1e3),
    ("exit_heading_error", "exit, heading [°]", 180.0 / np.pi),
)
"""Likewise; sizes."""

_ENDINGS = {
    0: "time was up",
    1: "reached the row and did not fit it",
    2: "bogged down",
    3: "left the headland",
    4: "time was up",
}
_CASES = 5
"""Worst turns that are shown of the headline and of the best arm; of the others, one (ours)."""


def percent(value: float | None, digits: int = 1) -> str:
    """A share in percent; a failure where it is infinite."""
    return FAILED if value is None else f"{100.0 * value:.{digits}f} %"


def with_span(metric: Mapping[str, Any] | None, digits: int = 1) -> dict[str, str]:
    """Value and interval of a share, as texts."""
    if metric is None:
        return {"value": NONE, "span": ""}
    span = metric["interval"]
    ends = "" if span is None else _span([FAILED if e is None else f"{100.0 * e:.{digits}f}" for e in span])
    return {"value": percent(metric["value"], digits), "span": ends}


def _span(ends: Sequence[str]) -> str:
    """Ends of an interval; a dash between them only where none is negative."""
    return (" to " if any(end.startswith("-") for end in ends) else "–").join(ends)


def sentence(evaluation: Evaluation) -> str:
    """The answer: which controller, how far off, how sure."""
    best = best_arm(evaluation)
    if best is None:
        return f"No scenario of set {evaluation.judged} can be made, not even by an upper bound."
    found = evaluation.metrics(best.name, evaluation.judged)
    radius, worst, share = (found[key] for key in ("radius_error_median", "radius_error_p95", "success_rate"))
    return (
        f"{display_name(best.name)} turns closest: half of its turns are within {percent(radius['value'])} of the "
        f"radius, 95 % within {_words(worst['value'])}, and {percent(share['value'])} end with every wheel in its "
        "furrow."
    )


def _words(value: float | None) -> str:
    return "no bound (some fail)" if value is None else percent(value)


def doubts(evaluation: Evaluation) -> str:
    """How sure the answer is: the best deployable arm against the strongest other one, paired."""
    best = best_arm(evaluation)
    if best is None:
        return ""
    found = evaluation.metrics(best.name, evaluation.judged)
    compared = {name: found.get(f"improvement_over_{name}") for name in BASELINES}
    parts, open_ones = [], []
    for baseline, item in compared.items():
        if item is not None:
            text = with_span(item, 0)
            parts.append(f"closer than {baseline} in {text['value']} of scenarios ({text['span']})")
            if item["interval"][0] <= 0.5 <= item["interval"][1]:
                open_ones.append(baseline)
    if not parts:
        return ""
    undecided = f" Whether it is better than {' or '.join(open_ones)} is open: 50 % lies inside." if open_ones else ""
    return f"Paired, it is {' and '.join(parts)}.{undecided}"


def answer_rows(evaluation: Evaluation, deployable: bool) -> list[dict[str, Any]]:
    """The first table: one row an arm on the judged set."""
    best = best_arm(evaluation)
    rows = []
    for arm in evaluation.arms:
        found = evaluation.metrics(arm.name, evaluation.judged)
        if arm.deployable != deployable or arm.ablation or not found:
            continue
        rows.append(
            {
                "name": display_name(arm.name),
                "title": arm.title,
                "best": best is not None and arm.name == best.name,
                "runs": found["runs"],
                "cells": _answer_cells(found),
            }
        )
    return rows


def _answer_cells(found: Mapping[str, Any]) -> list[dict[str, str]]:
    keys = ("radius_error_median", "radius_error_p95", "radius_error_signed_median", "success_rate", "practice_rate")
    cells = [with_span(found.get(key)) for key in keys]
    return cells + [with_span(found.get(f"improvement_over_{name}"), 0) for name in BASELINES]


def set_matrix(evaluation: Evaluation, key: str) -> list[dict[str, Any]]:
    """One metric of every arm on every set, value and interval."""
    return [
        {
            "name": display_name(arm.name),
            "bound": not arm.deployable,
            "cells": [with_span(evaluation.metrics(arm.name, item.name).get(key)) for item in evaluation.sets],
        }
        for arm in evaluation.arms
    ]


def size_rows(evaluation: Evaluation, sizes: Sequence[tuple[str, str, float]]) -> list[dict[str, Any]]:
    """Medians of sizes on the judged set: one row an arm."""
    rows = []
    for arm in evaluation.arms:
        found = evaluation.metrics(arm.name, evaluation.judged)
        if "success_rate" in found:
            cells = [_size(found.get(f"{key}_median"), factor) for key, _, factor in sizes]
            rows.append({"name": display_name(arm.name), "bound": not arm.deployable, "cells": cells})
    return rows


def _size(metric: Mapping[str, Any] | None, factor: float) -> dict[str, str]:
    if metric is None:
        return {"value": NONE, "span": ""}
    ends = [FAILED if end is None else f"{factor * end:.3g}" for end in metric["interval"]]
    value = FAILED if metric["value"] is None else f"{factor * metric['value']:.3g}"
    return {"value": value, "span": _span(ends)}


def why_failed(row: Row) -> str:
    """Why an episode did not succeed, in words."""
    if row["ending"] == 1 and row["exit_lateral_error"] is not None:
        return _ENDINGS[1]
    return _ENDINGS.get(int(row["ending"]), "never reached the row")


def failure_rows(evaluation: Evaluation) -> list[dict[str, Any]]:
    """Failures on feasible scenarios by arm and set: how many of how many, and why."""
    rows = []
    for arm in evaluation.arms:
        for item in evaluation.sets:
            mine = evaluation.rows_of(arm.name, item.name)
            failed = [row for row in mine if not row["success"]]
            if failed:
                causes = Counter(why_failed(row) for row in failed).most_common()
                text = "; ".join(f"{count} {cause}" for cause, count in causes)
                rows.append(
                    {
                        "arm": display_name(arm.name),
                        "set": item.name,
                        "count": f"{len(failed)} of {len(mine)}",
                        "why": text,
                        "stalls": sum(bool(row["bank_stalls"] or row["robot_stalls"]) for row in failed),
                    }
                )
    return rows


def worst_rows(evaluation: Evaluation) -> list[dict[str, str]]:
    """The worst feasible episode of every arm, then further ones of the best deployable arm and of the headline."""
    feasible = [row for row in evaluation.rows if row["feasible"]]
    chosen: list[Row] = []
    best = best_arm(evaluation)
    closer = {evaluation.headline, best.name if best else ""}
    for arm in evaluation.arms:
        mine = sorted((row for row in feasible if arm_name(row) == arm.name), key=badness, reverse=True)
        chosen += mine[: _CASES if arm.name in closer else 1]
    return [_case(row) for row in chosen]


def _case(row: Row) -> dict[str, str]:
    lateral, heading = row["exit_lateral_error"], row["exit_heading_error"]
    return {
        "arm": display_name(arm_name(row)),
        "scenario": f"{row['set']} {row['number']}",
        "error": "undefined" if row["radius_error"] is None else f"{100.0 * row['radius_error']:+.1f} %",
        "exit": NONE if lateral is None else f"{1e3 * lateral:+.0f} mm, {np.degrees(heading):+.1f}°",
        "end": "fits" if row["success"] else why_failed(row),
        "command": replay_command(row),
    }


def replay_command(row: Row) -> str:
    """Command line that drives an episode again."""
    return f"ddagr evaluate --replay {shlex.quote(replay_name(row))}"


def claim_rows(evaluation: Evaluation) -> list[dict[str, str]]:
    """Every claim on every set that was driven."""
    return [
        {
            "claim": item["name"],
            "arm": display_name(item["arm"]),
            "set": item["set_name"],
            "measured": _number(item, "measured"),
            "bound": f"{item['relation']} {_number(item, 'bound')}",
            "verdict": item["verdict"],
        }
        for item in evaluation.claims
        if item["verdict"] != "not driven"
    ]


def _number(item: Mapping[str, Any], key: str) -> str:
    return FAILED if item[key] is None else f"{item[key]:.3g}"


def claims_sentence(evaluation: Evaluation) -> str:
    """How many claims held."""
    count = Counter(item["verdict"] for item in evaluation.claims)
    text = f"{count['held']} held, {count['not held']} did not"
    return text + (f", {count['not driven']} were not driven" if count["not driven"] else "") + "."


def learned_rows(evaluation: Evaluation) -> list[dict[str, Any]]:
    """Ablations: every learned arm on the judged set, and how often it is closer than the headline."""
    rows = []
    for arm in (arm for arm in evaluation.arms if arm.learned):
        found = evaluation.metrics(arm.name, evaluation.judged)
        headline = arm.name == evaluation.headline
        if "radius_error_median" in found:
            versus = evaluation.over_headline.get(arm.name)
            rows.append(_learned_row(display_name(arm.name), headline, arm.title, found, versus))
        if headline:
            rows += [_learned_row(name, False, "", part, None) for name, part in evaluation.headline_alone.items()]
    return rows


def _learned_row(
    name: str, headline: bool, title: str, found: Mapping[str, Any], versus: Mapping[str, Any] | None
) -> dict[str, Any]:
    cells = [with_span(found[key]) for key in ("radius_error_median", "radius_error_p95", "success_rate")]
    cells.append(with_span(versus, 0))
    return {"name": name, "headline": headline, "title": title, "runs": found["runs"], "cells": cells}


def transfer_rows(evaluation: Evaluation, here: str = "S1", there: str = "T") -> list[dict[str, Any]]:
    """The same scenarios on the simulator's law and on another: median |e_R| and success, by arm."""
    rows = []
    for arm in evaluation.arms:
        numbers = {row["number"] for row in evaluation.rows_of(arm.name, there, feasible=False)}
        if numbers:
            pair = [
                _plain([row for row in evaluation.rows_of(arm.name, name) if row["number"] in numbers])
                for name in (here, there)
            ]
            rows.append({"name": display_name(arm.name), "cells": [*pair[0], *pair[1]]})
    return rows


def _plain(rows: Sequence[Row]) -> list[str]:
    if not rows:
        return [NONE, NONE, NONE]
    sizes = [size_of(row) for row in rows]
    median, high = (float(np.quantile(sizes, level, method="inverted_cdf")) for level in (0.5, 0.95))
    share = sum(bool(row["success"]) for row in rows) / len(rows)
    return [percent(v if np.isfinite(v) else None) for v in (median, high)] + [percent(share)]


def infeasible_rows(evaluation: Evaluation) -> list[dict[str, str]]:
    """Scenarios that no upper bound makes, with their soils."""
    return [
        {name: value if isinstance(value, str) else f"{value:.4g}" for name, value in item.items()}
        for item in evaluation.infeasible
    ]


def infeasible_sentence(evaluation: Evaluation) -> str:
    """How many scenarios are left out, and how often one was made all the same."""
    total = sum(item.driven for item in evaluation.sets)
    if not evaluation.infeasible:
        return f"All {total} scenarios can be made: an upper bound that sees the true state makes each."
    made = []
    for arm in evaluation.arms:
        found = [evaluation.metrics(arm.name, item.name) for item in evaluation.sets]
        tried = sum(m.get("infeasible", 0) * m.get("runs", 0) for m in found)
        if tried:
            made.append((sum(m["infeasible_but_made"] for m in found if m) / tried, display_name(arm.name)))
    share, name = max(made)
    luckier = f"; {name} makes {percent(share, 0)} of those that it drove all the same" if share > 0.0 else ""
    return (
        f"{len(evaluation.infeasible)} of {total} scenarios are left out: no upper bound, which sees the true state, "
        f"makes them{luckier}."
    )


def radius_note(evaluation: Evaluation) -> str:
    """How many radii are undefined, and how far two ways of measuring one differ, over all arms and sets."""
    found = [evaluation.metrics(arm.name, item.name) for arm in evaluation.arms for item in evaluation.sets]
    undefined = sum(m.get("undefined_radius", 0) for m in found)
    gaps = [row["radius_disagreement"] for row in evaluation.rows if row["success"] and row["radius_disagreement"]]
    text = f"Of {len(evaluation.rows)} episodes, {undefined} have no radius (they count as worst)."
    if not gaps:
        return text
    median, high = (percent(float(np.quantile(gaps, level, method="inverted_cdf"))) for level in (0.5, 0.95))
    return (
        f"{text} On uneven soil a path is no exact circle: arc length over course change gives a radius that differs "
        f"from the fitted one by {median} in half of the successful turns and by more than {high} in one of twenty."
    )
