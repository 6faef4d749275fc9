"""What a diagnosis calls the forms that a missing effect may have: a disc or a band of soil, a lag of both banks or of
the turning alone, ruts, soil that is heaped up at once or first.

    python -m benchmarks.effect_forms [--forms NAME/FORM ...] [--seeds N [N ...]] [--nulls N] [--workers N]
    python -m benchmarks.effect_forms --forms all          every form of the generator: seven hours of a core

Cases of the project's own blind generator, which shares no code with the library, in sets of public seeds
(``benchmarks/concealed/README.md``): all singles and doubles that have one of the forms, and some in which nothing is
missing. By default the forms that the library's effects were last given parameters for. Each case is diagnosed names
only. Written are the answers, counts and a picture (``benchmarks/results/effect_forms.json``, ``.png``); a run goes on
after the answers in the folder of parts. A minute of a core a case. These cases are to develop on: what counts is a
sealed set.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.blind_cases import SEEDS, SET, Answer, answers_to, diagnosed, idle_cases
from benchmarks.concealed.cases import Case, plan
from benchmarks.concealed_names import any_right, rightly_named
from ddagr_gym.errors import InputError
from ddagr_gym.files import write_json
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

RESULT = Path(__file__).resolve().parent / "results" / "effect_forms.json"
FORMS = (
    "multipass/alignment",
    "multipass/rut map",
    "soil_split/stiffness",
    "soil_patch/band",
    "lateral_bulldozing/berm",
    "motor_lag/turning only",
    "command_deadband/turning only",
)
NULLS = 10
"""Cases of the first seed in which nothing is missing."""

LOOKS = {
    "right": ("all names right, complete", "o", palette.BLUE),
    "right, incomplete": ("all names right, more is said to be left", "D", palette.PALE),
    "one of two": ("one of two names right", "^", palette.GREEN),
    "wrong": ("another name", "X", palette.ORANGE),
    "nothing": ("no name", ".", "black"),
}
"""Words, marker and colour by :func:`kind_of_answer`."""


def forms_of(case: Case) -> list[str]:
    """Effect and form of what is missing in a case, as ``soil_patch/band``."""
    return [f"{form.name}/{form.variant}" for form, _ in case.effects]


def cases(forms: Sequence[str], seeds: Sequence[int], nulls: int) -> list[tuple[int, Case]]:
    """Seed and case, those in which nothing is missing last.

    Args:
        forms: as of :func:`forms_of`; "all" for those of all singles and doubles.
        seeds: of sets.
        nulls: how many of the first set.

    Raises:
        InputError: a form that no case has.
    """
    asked = [(seed, case) for seed in seeds for case in plan(SET, seed) if case.kind in ("single", "double")]
    known = {form for _, case in asked for form in forms_of(case)}
    wanted = known if "all" in forms else set(forms)
    if absent := sorted(wanted - known):
        raise InputError(f"no case has the form {absent[0]!r}: choose from {', '.join(sorted(known))}, or all.")
    found = [(seed, case) for seed, case in asked if not wanted.isdisjoint(forms_of(case))]
    return found + idle_cases(seeds[0], nulls)


def answer(seed: int, case: Case) -> Answer:
    """What is said of a case, as JSON has it.

    Args:
        seed: of its set.
        case: of it.
    """
    found, label = diagnosed(seed, case)
    return {
        "case": f"{seed} {case.name}",
        "kind": case.kind,
        "forms": forms_of(case),
        "truth": list(case.verdict),
        "verdict": list(found.verdict),
        "complete": found.complete,
        "right": rightly_named(label, found.verdict),
        "any_right": any_right(label, found.verdict),
        "seconds": found.seconds,
    }


def kind_of_answer(item: Answer) -> str:
    """Key of :data:`LOOKS`."""
    if item["right"]:
        return "right" if item["complete"] else "right, incomplete"
    if item["verdict"] in (["none"], ["unknown"]):
        return "nothing"
    return "one of two" if item["any_right"] and len(item["truth"]) == 2 else "wrong"


def summary(answers: Sequence[Answer]) -> dict[str, Any]:
    """Counts by form of singles and doubles that are named right, and of false alarms."""
    asked = [item for item in answers if item["forms"]]
    nulls = [item for item in answers if not item["forms"]]
    forms = sorted({form for item in asked for form in item["forms"]})
    return {
        "forms": {form: _counts([item for item in asked if form in item["forms"]]) for form in forms},
        "nulls": {"cases": len(nulls), "alarms": sum(item["verdict"] != ["none"] for item in nulls)},
        "median_seconds": float(np.median([item["seconds"] for item in answers])) if answers else None,
    }


def _counts(items: Sequence[Answer]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for kind in ("single", "double"):
        own = [item for item in items if item["kind"] == kind]
        found[f"{kind}s"] = {
            "cases": len(own),
            "right": sum(item["right"] for item in own),
            "complete": sum(item["right"] and item["complete"] for item in own),
        }
    return found


def draw(answers: Sequence[Answer], path: Path) -> None:
    """Every case as a mark, forms as rows: single effects on the left, doubles behind them.

    Args:
        answers: of :func:`answer`.
        path: of the PNG.
    """
    from matplotlib.figure import Figure

    forms = sorted({form for item in answers for form in item["forms"]})
    with house_style():
        figure = Figure(figsize=(9.0, 1.6 + 0.36 * len(forms)), layout="constrained")
        panel = figure.subplots()
        places = [(row, column, item) for row, form in enumerate(forms) for column, item in _in_order(answers, form)]
        for kind, (words, marker, colour) in LOOKS.items():
            own = [(column, row) for row, column, item in places if kind_of_answer(item) == kind]
            panel.scatter(*np.array(own).reshape(-1, 2).T, marker=marker, color=colour, s=70, label=words)
        doubles = [(column, row) for row, column, item in places if item["kind"] == "double"]
        panel.scatter(
            *np.array(doubles).reshape(-1, 2).T, marker="o", s=190, facecolors="none", edgecolors="black",
            linewidths=0.7, label="beside a second effect",
        )  # fmt: skip
        panel.set_yticks(range(len(forms)), [form.replace("_", " ").replace("/", ": ") for form in forms], fontsize=8)
        panel.set(xticks=[], ylim=(len(forms) - 0.4, -0.6), xlabel="cases")
        panel.legend(loc="lower center", bbox_to_anchor=(0.4, 1.0), ncols=3, fontsize=8)
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=110))


def _in_order(answers: Sequence[Answer], form: str) -> list[tuple[int, Answer]]:
    """Cases that have a form with their places, singles first."""
    own = [item for item in answers if form in item["forms"]]
    return list(enumerate(sorted(own, key=lambda item: (item["kind"] == "double", item["case"]))))


def main(words: Sequence[str] | None = None) -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--forms", nargs="+", default=list(FORMS), metavar="NAME/FORM")
    parser.add_argument("--seeds", type=int, nargs="+", default=list(SEEDS))
    parser.add_argument("--nulls", type=int, default=NULLS, help="cases of the first seed in which nothing is missing")
    parser.add_argument("--parts", type=Path, default=RESULT.with_suffix(".parts"), help="folder of finished answers")
    parser.add_argument("--output", type=Path, default=RESULT, help="JSON; the picture has the same name")
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args(words)
    try:
        chosen = cases(given.forms, given.seeds, given.nulls)
    except InputError as error:
        parser.error(str(error))
    answers = answers_to(chosen, answer, given.workers, given.parts)
    counts = summary(answers)
    write_json(given.output, {"command": "python -m benchmarks.effect_forms", "summary": counts, "answers": answers})
    draw(answers, given.output.with_suffix(".png"))
    print(json.dumps(counts, indent=1))


if __name__ == "__main__":
    main()
