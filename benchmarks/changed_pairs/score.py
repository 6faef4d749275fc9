"""Figures over the answers on a set of pairs, in the terms of :mod:`benchmarks.score_concealed`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from benchmarks.changed_pairs.plan import HIDDEN
from benchmarks.concealed_names import any_right
from benchmarks.concealed_truth import Case, covered, detectable, misses, sizes, true_sizes
from benchmarks.score_concealed import NULLS, confident, in_set, mean, median, names_of, right, share
from ddagr_gym.physics.effects.registry import effect_kind

TARGETS: dict[str, tuple[float, float]] = {
    "false_alarms": (0.0, 0.05),
    "false_alarms_structural": (0.0, 0.05),
    "right_name": (0.85, 1.0),
    "in_set": (0.95, 1.0),
    "right_name_hidden": (0.7, 1.0),
    "both_of_double": (0.75, 1.0),
    "interval_holds": (0.8, 0.97),
    "time_inside": (0.8, 1.0),
    "sure_and_wrong": (0.0, 0.03),
}
"""Least and largest value aimed at."""

CHANGED = ("single", "beginning")
TWICE = 2.0
"""Multiples of the least detectable size from which a hidden effect is to be named."""


def sure_and_wrong(label: Mapping[str, Any], answer: Mapping[str, Any]) -> bool:
    """Whether a complete answer names something, and a name has none of the truth in its set.

    Args:
        label: of the pair.
        answer: to it.
    """
    return confident(answer) and not all(any_right(label, item["equivalence_set"]) for item in answer["findings"])


def multiple(label: Mapping[str, Any], answer: Mapping[str, Any]) -> float | None:
    """Largest size of a single effect over what the answer says can be told; None where that means something else.

    Args:
        label: of a pair with one effect.
        answer: to it.
    """
    (effect,) = label["effects"]
    limits = answer["detectable"].get(effect["name"], {})
    kind = effect_kind(effect["name"])
    if not kind.differentiable:
        return None
    found = [
        abs(value - float(kind.parameter(field).metadata["neutral"])) / float(least)
        for field, value in true_sizes(effect).items()
        if (least := limits.get(field)) is not None
    ]
    return max(found) if found else None


def _hidden(case: Case) -> bool:
    """Whether it is a hidden effect of at least twice what can be told, or of a size that has no such multiple."""
    _, label, answer = case
    if label["verdict"][0] not in HIDDEN:
        return False
    found = multiple(label, answer)
    return found is None or found >= TWICE


def _time(case: Case) -> bool | None:
    """Whether the interval of the time at which the named effect begins holds it; None where it is not named."""
    _, label, answer = case
    for finding in answer["findings"]:
        if finding["name"] in label["verdict"]:
            onset = finding.get("onset") or {}
            held = onset.get("interval")
            return bool(held and held[0] <= label["begins"] <= held[1])
    return None


def score(labels: Mapping[str, Any], answers: Mapping[str, Any]) -> dict[str, Any]:
    """All figures, and the pairs that went wrong.

    Args:
        labels: by pair.
        answers: by pair; pairs without an answer do not count.
    """
    cases: list[Case] = [(name, labels[name], answers[name]) for name in sorted(answers)]

    def of(*kinds: str) -> list[Case]:
        return [case for case in cases if case[1]["kind"] in kinds]

    def over(chosen: Sequence[Case], test: Callable[[Any, Any], bool]) -> dict[str, Any]:
        return share([test(label, answer) for _, label, answer in chosen])

    seen = {name for name, label, answer in cases if detectable(label, answer)}
    singles = [case for case in of("single") if case[0] in seen]
    beginning = [case for case in of("beginning") if case[0] in seen]
    doubles = [case for case in of("double") if case[0] in seen]
    times = [held for case in beginning if (held := _time(case)) is not None]
    return {
        "false_alarms": over(of(*NULLS), lambda _, a: a["verdict"] != ["none"]),
        "false_alarms_structural": over(of("structural null"), lambda _, a: a["verdict"] != ["none"]),
        "right_name": over(singles, right),
        "in_set": over(singles, in_set),
        "right_name_hidden": over([case for case in of("single") if _hidden(case)], right),
        "right_name_all_singles": over(of("single"), right),
        "right_name_beginning": over(beginning, right),
        "both_of_double": over(doubles, right),
        "one_of_double": over(doubles, lambda label, a: any_right(label, names_of(a))),
        "interval_holds": share(covered([*of("single"), *of("double")])),
        "time_inside": share(times),
        "sure_and_wrong": over(cases, sure_and_wrong),
        "flagged_outside": over(of("outside"), lambda _, a: a["verdict"] != ["none"]),
        "set_size": mean([float(len(f["equivalence_set"])) for _, _, a in cases for f in a["findings"]]),
        "least_detectable": _least_detectable(cases),
        "seconds": median([float(answer["seconds"]) for _, _, answer in cases]),
        "by_effect": _by_effect(of(*CHANGED)),
        "failures": [_failure(case, case[0] in seen) for case in cases if not right(case[1], case[2])],
        "interval_misses": misses([*of("single"), *of("double")]),
    }


def _least_detectable(cases: Sequence[Case]) -> dict[str, Any]:
    """Least change of each hidden effect that would be found, by field: median where nothing was named."""
    quiet = [answer["detectable"] for _, _, answer in cases if not answer["findings"]]
    found: dict[str, list[float]] = {}
    for limits in quiet:
        for name in HIDDEN:
            for field, least in limits.get(name, {}).items():
                if least is not None:
                    found.setdefault(f"{name}.{field}", []).append(float(least))
    return {name: median(values) for name, values in sorted(found.items())}


def _by_effect(cases: Sequence[Case]) -> dict[str, Any]:
    """Of each effect that changed alone: names in the order of its size over what can be told."""
    found: dict[str, list[dict[str, Any]]] = {}
    for name, label, answer in cases:
        entry = {
            "pair": name,
            "variant": label["effects"][0]["variant"],
            "multiple": multiple(label, answer),
            "said": answer["verdict"],
            "right": right(label, answer),
            "in_set": in_set(label, answer),
        }
        found.setdefault(label["verdict"][0], []).append(entry)
    return {name: sorted(items, key=lambda item: item["multiple"] or 0.0) for name, items in sorted(found.items())}


def _failure(case: Case, seen: bool) -> dict[str, Any]:
    """What is listed of a pair that went wrong."""
    name, label, answer = case
    return {
        "pair": name,
        "kind": label["kind"],
        "label": label["verdict"],
        "begins": label["begins"],
        "true_sizes": {effect["name"]: effect["parameters"] for effect in label["effects"]},
        "forms": [f"{effect['name']}: {effect['variant']} ({effect['tag']})" for effect in label["effects"]],
        "detectable": seen,
        "structure": label["structure"],
        "said": answer["verdict"],
        "complete": answer["complete"],
        "found_sizes": sizes(answer),
        "equivalence": [finding["equivalence_set"] for finding in answer["findings"]],
    }
