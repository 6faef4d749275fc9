"""Score answers of ``benchmarks/answers/run_diagnoses.py`` against the labels of a set of the project's own generator.

    python -m benchmarks.score_concealed --answers ANSWERS.json --labels LABELS.json --commitments COMMITMENTS.json

writes ``benchmarks/results/concealed.json`` and, beside it, a picture. With ``--commitments`` labels that are not the
ones committed to before the run are refused.

Every figure is ``{value, interval, count}``: shares with 95 % Wilson intervals, others with bootstrap intervals over
cases. ``power`` is the share of detectable singles that raise an alarm of any name at the gates' own level, 5 % false
alarms over the whole library; ``false_alarm_rate`` is what the nulls show of that level. An effect counts as detectable
where its true size is at least the least detectable one that the diagnosis of its own case states; a categorical one
always. For one whose size means something else in the library the size in the library's terms counts, which
:mod:`benchmarks.concealed_equivalents` measures (``--equivalents``). A run that failed has named nothing: a false alarm
on a null, a miss elsewhere. Every case that went wrong is listed. Parts of the drivetrain count as the effects that
they stand for, and some effects have a second right name (:mod:`benchmarks.concealed_names`).
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.concealed.catalogue import DRIVETRAIN
from benchmarks.concealed.commitments import commitment
from benchmarks.concealed_figure import draw
from benchmarks.concealed_names import accepted, all_held_possible, any_right, as_effects, rightly_named
from benchmarks.concealed_truth import Case, Sizes, covered, detectable, misses, size_errors, sizes
from ddagr_gym.errors import InputError
from ddagr_gym.evaluation.statistics import wilson_interval
from ddagr_gym.recordings.files import write_atomically

RESULT = Path(__file__).resolve().parent / "results" / "concealed.json"

TARGETS: dict[str, tuple[float, float]] = {
    "false_alarm_rate": (0.0, 0.05),
    "false_alarm_rate_structural": (0.0, 0.05),
    "top1": (0.8, 1.0),
    "in_set": (0.9, 1.0),
    "top1_doubles": (0.7, 1.0),
    "in_set_doubles": (0.7, 1.0),
    "confident_wrong": (0.0, 0.05),
    "coverage": (0.8, 0.97),
    "gain_share": (0.8, 1.0),
}
"""Least and largest value aimed at."""

NULLS = ("null", "structural null")


def share(hits: Sequence[bool]) -> dict[str, Any]:
    """Share of true values with its interval."""
    if not hits:
        return {"value": None, "interval": None, "count": 0}
    found = wilson_interval(sum(hits), len(hits))
    return {"value": sum(hits) / len(hits), "interval": [found.low, found.high], "count": len(hits)}


def mean(values: Sequence[float], seed: int = 0) -> dict[str, Any]:
    """Mean with a bootstrap interval."""
    return _bootstrapped(values, np.mean, seed)


def median(values: Sequence[float], seed: int = 0) -> dict[str, Any]:
    """Median with a bootstrap interval."""
    return _bootstrapped(values, np.median, seed)


def _bootstrapped(values: Sequence[float], statistic: Callable[..., Any], seed: int) -> dict[str, Any]:
    if not values:
        return {"value": None, "interval": None, "count": 0}
    rng = np.random.default_rng(seed)
    found = np.asarray(values)
    draws = statistic(rng.choice(found, (2000, len(found))), axis=1)
    low, high = np.quantile(draws, [0.025, 0.975])
    return {"value": float(statistic(found)), "interval": [float(low), float(high)], "count": len(found)}


def names_of(answer: Mapping[str, Any]) -> list[str]:
    """Named effects; none and unknown are no names."""
    return [name for name in answer["verdict"] if name not in ("none", "unknown")]


def right(label: Mapping[str, Any], answer: Mapping[str, Any]) -> bool:
    """Exactly the label's names, or such as are as right."""
    return rightly_named(label, answer["verdict"])


def in_set(label: Mapping[str, Any], answer: Mapping[str, Any]) -> bool:
    """Each of the label's effects stands in the equivalence set of some finding, and the verdict names something."""
    sets = [finding["equivalence_set"] for finding in answer["findings"]]
    return bool(names_of(answer)) and all_held_possible(label, sets)


def set_share(label: Mapping[str, Any], answer: Mapping[str, Any]) -> float:
    """Right name in the equivalence set, over the set's size: 1 for the right name alone, 0 where it is missing.

    Where a single effect has several findings their sets count as one: more names, whether within one set or in
    several, say less.

    Args:
        label: of a single.
        answer: to it.
    """
    if not in_set(label, answer):
        return 0.0
    held = {name for finding in answer["findings"] for name in finding["equivalence_set"]}
    return 1.0 / len(as_effects(held, accepted(label)))


def alarm(answer: Mapping[str, Any]) -> bool:
    """Says that something is missing, with or without a name; a run that failed says nothing."""
    return bool(answer["verdict"]) and answer["verdict"] != ["none"]


def confident(answer: Mapping[str, Any]) -> bool:
    """Names effects and says that nothing else is missing."""
    return bool(names_of(answer)) and bool(answer["complete"])


def gain_shares(cases: Sequence[Case], horizon: str = "5") -> list[float]:
    """Certified share of the explainable error that the named effects explain, by case.

    Of the motion where the ceiling gains anything there, else of the readings (what is wrong in a sensor moves no
    robot). Cases without certification are left out; where nothing was named the share is what the certificate says,
    nothing.
    """
    found = []
    for _, _, answer in cases:
        fit = answer.get("fit") or {}
        entries = [(fit.get(name) or {}).get(horizon) for name in ("gain_share", "gain_share_readings")]
        values = [float(entry["value"]) for entry in entries if entry is not None]
        if values and math.isfinite(values[0]):
            found.append(values[0])
    return found


def score(
    labels: Mapping[str, Any], answers: Mapping[str, Any], equivalents: Mapping[str, Sizes] | None = None
) -> dict[str, Any]:
    """All figures of a set, and the cases that went wrong.

    Args:
        labels: by case, as the generator writes them.
        answers: by case; cases without an answer do not count.
        equivalents: by case, sizes in the library's terms of effects whose own mean something else.
    """
    cases: list[Case] = [(name, labels[name], answers[name]) for name in sorted(answers)]

    def of(*kinds: str) -> list[Case]:
        return [case for case in cases if case[1]["kind"] in kinds]

    def over(chosen: Sequence[Case], test: Callable[[Any, Any], bool]) -> dict[str, Any]:
        return share([test(label, answer) for _, label, answer in chosen])

    visible = {name for name, label, answer in cases if detectable(label, answer, (equivalents or {}).get(name))}
    seen = [case for case in of("single") if case[0] in visible]
    doubles = [case for case in of("double") if case[0] in visible]
    named = of("single", "double")
    driven, driven_doubles = ([case for case in chosen if _of_drivetrain(case)] for chosen in (seen, doubles))
    certified = [case for case in cases if case[2].get("fit")]
    return {
        "false_alarm_rate": over(of(*NULLS), lambda _, a: a["verdict"] != ["none"]),
        "false_alarm_rate_structural": over(of("structural null"), lambda _, a: a["verdict"] != ["none"]),
        "named_on_nulls": over(of(*NULLS), lambda _, a: bool(names_of(a))),
        "top1": over(seen, right),
        "in_set": over(seen, in_set),
        "in_set_per_size": mean([set_share(label, answer) for _, label, answer in seen]),
        "power": over(seen, lambda _, a: alarm(a)),
        "power_all_singles": over(of("single"), lambda _, a: alarm(a)),
        "top1_all_singles": over(of("single"), right),
        "in_set_all_singles": over(of("single"), in_set),
        "top1_same_form": over([c for c in seen if c[1]["effects"][0]["tag"] == "same"], right),
        "top1_other_form": over([c for c in seen if c[1]["effects"][0]["tag"] != "same"], right),
        "top1_doubles": over(doubles, right),
        "in_set_doubles": over(doubles, in_set),
        "one_of_double": over(doubles, lambda label, a: any_right(label, names_of(a))),
        "top1_drivetrain": over(driven, right),
        "in_set_drivetrain": over(driven, in_set),
        "top1_doubles_drivetrain": over(driven_doubles, right),
        "unknown_outside": over(of("outside"), lambda _, a: a["verdict"] == ["unknown"]),
        "flagged_outside": over(of("outside"), lambda _, a: not a["complete"]),
        "confident_wrong": over(of(*NULLS, "outside"), lambda _, a: confident(a)),
        "confident_wrong_nulls": over(of(*NULLS), lambda _, a: confident(a)),
        "confident_wrong_outside": over(of("outside"), lambda _, a: confident(a)),
        "coverage": share(covered(named)),
        "size_error": median(size_errors(named)),
        "set_size": mean([float(len(f["equivalence_set"])) for _, _, a in named for f in a["findings"] if names_of(a)]),
        "gain_share": mean(gain_shares([*seen, *doubles])),
        "gain_share_rightly_named": mean(gain_shares([case for case in named if right(case[1], case[2])])),
        "seconds": mean([float(answer["seconds"]) for _, _, answer in cases]),
        "seconds_full": mean([float(answer["seconds"]) for _, _, answer in certified]),
        "failed_runs": over(cases, lambda _, a: "failure" in a),
        "failures": [_failure(case, case[0] in visible) for case in cases if not right(case[1], case[2])],
        "interval_misses": misses(named),
    }


def _of_drivetrain(case: Case) -> bool:
    """Whether an effect between command and wheel is among those of the case."""
    return not set(DRIVETRAIN).isdisjoint(case[1]["verdict"])


def _failure(case: Case, visible: bool) -> dict[str, Any]:
    """What is listed of a case that went wrong."""
    name, label, answer = case
    return {
        "case": name,
        "kind": label["kind"],
        "label": label["verdict"],
        "forms": [f"{effect['name']}: {effect['variant']} ({effect['tag']})" for effect in label["effects"]],
        "true_sizes": {effect["name"]: effect["parameters"] for effect in label["effects"]},
        "detectable": visible,
        "structure": label["structure"],
        "verdict": answer["verdict"],
        "complete": answer["complete"],
        "found_sizes": sizes(answer),
        "equivalence": [finding["equivalence_set"] for finding in answer["findings"]],
        **({"failure": answer["failure"]} if "failure" in answer else {}),
    }


def against_targets(figures: Mapping[str, Any], targets: Mapping[str, tuple[float, float]] = TARGETS) -> dict[str, Any]:
    """Least and largest value aimed at, and whether the figure lies between them; None where there is none.

    Args:
        figures: by name.
        targets: least and largest value of those that are aimed at.
    """
    found = {}
    for name, (low, high) in targets.items():
        value = figures[name]["value"]
        # half a count of rounding would turn a bound that is met exactly
        met = None if value is None else low - 1e-9 <= value <= high + 1e-9
        found[name] = {"least": low, "most": high, "met": met}
    return found


def check_commitments(opened: Mapping[str, Any], published: Mapping[str, Any]) -> None:
    """Refuse labels that are not the ones committed to.

    Args:
        opened: labels file of a sealed set, with salts.
        published: commitments from before the run.

    Raises:
        InputError: with the first case that differs.
    """
    for name in sorted(set(opened["cases"]) | set(published["cases"])):
        entry = opened["cases"].get(name, {})
        hashed = commitment(entry["salt"], entry["label"]) if {"salt", "label"} <= set(entry) else None
        if hashed is None or hashed != published["cases"].get(name, {}).get("label"):
            raise InputError(f"the label of {name} is not the one committed to: give the labels of that very set.")


def read_equivalents(path: Path, opened: Mapping[str, Any]) -> Mapping[str, Sizes]:
    """Sizes in the library's terms by case.

    Args:
        path: of :mod:`benchmarks.concealed_equivalents`.
        opened: labels file.

    Raises:
        InputError: they are of another set.
    """
    found = json.loads(path.read_text())
    if any(found.get(field) != opened.get(field) for field in ("set", "generator", "seed")):
        raise InputError(f"{path} holds equivalent sizes of another set: make them for the labels that are given.")
    return dict(found["cases"])


def about(opened: Mapping[str, Any], answers: Mapping[str, Any]) -> dict[str, Any]:
    """What was scored: the set, and the versions and options of the runs."""
    options = Counter(" ".join(answer.get("options", [])) or "all steps" for answer in answers.values())
    return {
        "set": opened.get("set"),
        "generator": opened.get("generator"),
        "cases": len(answers),
        "unanswered": sorted(set(opened["cases"]) - set(answers)),
        "commits": sorted({str(answer.get("commit")) for answer in answers.values()}),
        "versions": sorted({str(answer.get("version")) for answer in answers.values()}),
        "options": dict(options),
    }


def figure_line(name: str, entry: Mapping[str, Any]) -> str:
    """Name, value, interval and count of a figure."""
    low, high = entry["interval"]
    return f"{name:28s} {entry['value']:8.3f}  [{low:.3f}, {high:.3f}]  {entry['count']:4d}"


def _printed(result: Mapping[str, Any]) -> None:
    for name, entry in result.items():
        if isinstance(entry, dict) and entry.get("value") is not None:
            aim = result["targets"].get(name)
            goal = (
                "" if aim is None else f"  aim {aim['least']:g} to {aim['most']:g}: {'met' if aim['met'] else 'missed'}"
            )
            print(f"{figure_line(name, entry)}{goal}")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--answers", type=Path, required=True)
    parser.add_argument("--labels", type=Path, required=True)
    parser.add_argument("--commitments", type=Path, help="of a sealed set, published before the run")
    parser.add_argument("--equivalents", type=Path, help="sizes in the library's terms, of the same set")
    parser.add_argument("--output", type=Path, default=RESULT, help="JSON; the picture has the same name")
    return parser


def main(words: Sequence[str] | None = None) -> int:
    """Command line; returns the exit code."""
    arguments = _parser().parse_args(words)
    opened, answers = (json.loads(path.read_text()) for path in (arguments.labels, arguments.answers))
    try:
        if arguments.commitments is not None:
            check_commitments(opened, json.loads(arguments.commitments.read_text()))
        equivalents = None if arguments.equivalents is None else read_equivalents(arguments.equivalents, opened)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    labels = {name: entry["label"] for name, entry in opened["cases"].items()}
    figures = score(labels, answers, equivalents)
    described = {**about(opened, answers), "equivalent_sizes": equivalents}
    result = {**figures, "targets": against_targets(figures), "about": described}
    write_atomically(arguments.output, lambda to: to.write_text(json.dumps(result, indent=1, allow_nan=False) + "\n"))
    draw(labels, answers, result, arguments.output.with_suffix(".png"))
    _printed(result)
    return 0


if __name__ == "__main__":
    sys.exit(main())
