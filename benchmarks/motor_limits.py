"""Weak motors on soft ground: what a diagnosis says of limits of torque and power that the ground's load meets.

    python -m benchmarks.motor_limits [--seeds N [N ...]] [--workers N] [--parts DIR]

Cases of the project's own blind generator, which shares no code with the library, in sets of public seeds: all singles
and doubles whose motors have a limit of torque or power, or a current that folds back with speed, and a dozen in which
nothing is missing. Written are the answers, counts and a picture (``benchmarks/results/motor_limits.json``, ``.png``);
a run goes on after the answers in the folder of parts. A minute of a core a case.
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
from ddagr_gym.files import write_json
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

RESULT = Path(__file__).resolve().parent / "results" / "motor_limits.json"
NAME, FORMS = "motor_saturation", ("torque limit", "power limit", "current folds back")
LIMITS = ("torque_limit", "power_limit")
NULLS = 12
"""Cases of the first seed in which nothing is missing."""
ENCODERS = ("encoder_right", "encoder_left")


def cases(seeds: Sequence[int]) -> list[tuple[int, Case]]:
    """Seed and case, those in which nothing is missing last."""
    weak = [(seed, case) for seed in seeds for case in plan(SET, seed) if _is_weak(case)]
    return weak + idle_cases(seeds[0], NULLS)


def _is_weak(case: Case) -> bool:
    return any(form.name == NAME and form.variant in FORMS for form, _ in case.effects)


def answer(seed: int, case: Case) -> Answer:
    """What is said of a case, as JSON has it.

    Args:
        seed: of its set.
        case: of it.
    """
    found, label = diagnosed(seed, case)
    misfit = found.misfit
    return {
        "case": f"{seed} {case.name}",
        "kind": case.kind,
        "truth": list(case.verdict),
        "form": next((form.variant for form, _ in case.effects if form.name == NAME), ""),
        "true_sizes": next((item["parameters"] for item in label["effects"] if item["name"] == NAME), {}),
        "verdict": list(found.verdict),
        "complete": found.complete,
        "found_sizes": _limits(found.findings),
        "encoders_over_limit": {
            key: max(misfit[key][name] / misfit["limit"][name] for name in ENCODERS) for key in ("nominal", "corrected")
        },
        "seconds": found.seconds,
    }


def _limits(findings: Sequence[Any]) -> dict[str, Any]:
    """Limits of torque and power that are named, with their units and intervals."""
    named = [finding.parameters for finding in findings if finding.name == NAME]
    return {
        name: {"value": size.value, "unit": size.unit, "interval": size.interval}
        for parameters in named
        for name, size in parameters.items()
        if name in LIMITS and size.interval is not None
    }


def summary(answers: Sequence[Answer]) -> dict[str, Any]:
    """Counts of the answers: of cases that show, by what the encoders leave of the nominal simulator, and of all."""
    weak = [item for item in answers if item["truth"] != ["none"]]
    shown = [item for item in weak if item["encoders_over_limit"]["nominal"] > 1.0]
    singles, doubles = ([i for i in shown if (len(i["truth"]) == 2) == double] for double in (False, True))
    nulls = [item for item in answers if item["truth"] == ["none"]]
    return {
        "cases": len(weak),
        "shown": len(shown),
        "singles": {"shown": len(singles), "right": sum(_is_right(item) for item in singles)},
        "doubles": {
            "shown": len(doubles),
            "right": sum(_is_right(item) for item in doubles),
            "limit_named": sum(NAME in item["verdict"] for item in doubles),
        },
        "complete": sum(item["complete"] for item in shown),
        "nulls": {"cases": len(nulls), "alarms": sum(item["verdict"] != ["none"] for item in nulls)},
        "median_seconds": float(np.median([item["seconds"] for item in shown])) if shown else None,
        "ratios_of_power": [ratio for item in shown if (ratio := _ratio_of_power(item)) is not None],
    }


def _is_right(item: Answer) -> bool:
    return sorted(item["verdict"]) == sorted(item["truth"])


def _ratio_of_power(item: Answer) -> float | None:
    """Found over true power, where both are one."""
    true, found = item["true_sizes"].get("power_limit"), item["found_sizes"].get("power_limit")
    return float(found["value"] / true) if true and found and found["unit"] == "W" else None


def draw(answers: Sequence[Answer], path: Path) -> None:
    """Misfit of the encoders of every case whose motors are weak, nominal and corrected.

    Args:
        answers: of :func:`answer`.
        path: of the PNG.
    """
    from matplotlib.figure import Figure

    weak = sorted((item for item in answers if item["form"]), key=lambda i: (i["form"], i["kind"], i["case"]))
    with house_style():
        figure = Figure(figsize=(9.0, 1.4 + 0.3 * len(weak)), layout="constrained")
        panel = figure.subplots()
        for label, right, marker in (("all names right", True, "o"), ("not all, or none", False, "X")):
            rows = [row for row, item in enumerate(weak) if _is_right(item) is right]
            left = [weak[row]["encoders_over_limit"]["corrected"] for row in rows]
            panel.scatter(left, rows, marker=marker, color=palette.BLUE, s=42, alpha=0.8, label=label)
        nominal = [item["encoders_over_limit"]["nominal"] for item in weak]
        panel.plot(nominal, range(len(weak)), "k|", markersize=11, label="nothing corrected")
        panel.axvline(1.0, color="black", linewidth=0.8)
        panel.set_yticks(range(len(weak)), [_words(item) for item in weak], fontsize=8)
        panel.set(xscale="log", xlabel="misfit of the encoders over its limit [-]", ylim=(len(weak) - 0.4, -0.6))
        panel.legend(loc="lower center", bbox_to_anchor=(0.4, 1.0), ncols=3, fontsize=8)
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=110))


def _words(item: Answer) -> str:
    others = [name.replace("_", " ") for name in item["truth"] if name != NAME]
    return " and ".join([item["form"], *others])


def main(words: Sequence[str] | None = None) -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(SEEDS))
    parser.add_argument("--parts", type=Path, default=RESULT.with_suffix(".parts"), help="folder of finished answers")
    parser.add_argument("--output", type=Path, default=RESULT, help="JSON; the picture has the same name")
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args(words)
    answers = answers_to(cases(given.seeds), answer, given.workers, given.parts)
    counts = summary(answers)
    write_json(given.output, {"command": "python -m benchmarks.motor_limits", "summary": counts, "answers": answers})
    draw(answers, given.output.with_suffix(".png"))
    print(json.dumps(counts, indent=1))


if __name__ == "__main__":
    main()
