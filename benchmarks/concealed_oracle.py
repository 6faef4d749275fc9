"""What an oracle gains on unseen drives that is told the names, beside what the diagnosis gains.

    python -m benchmarks.concealed_oracle DIR --labels LABELS.json --answers ANSWERS.json

The oracle fits the library's effects that a case's label names, however little they show, to the same windows by the
same steps, and is certified on the same drives. Its gain is the share of the refitted nominal model's error 5 s ahead
that it saves, of the motion where that is certainly something, else of the readings. Cases are the certified singles
and doubles whose effects the diagnosis says it can show; where it gave just these names it is the same model, and has
all of the gain. ``benchmarks/results/concealed_oracle.json`` and ``.png`` have every case.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.ablations.examine import ROBOT, SOIL, read_runs
from benchmarks.concealed_truth import Sizes, detectable
from benchmarks.score_concealed import RESULT, figure_line, mean, read_equivalents
from ddagr_gym.diagnosis.certification.certificate import LEAST_EXPLAINABLE
from ddagr_gym.diagnosis.certification.certify import certify_models
from ddagr_gym.diagnosis.gates.threshold_files import default_thresholds
from ddagr_gym.diagnosis.gates.thresholds import Gate, Thresholds
from ddagr_gym.diagnosis.preprocessing.session import prepare
from ddagr_gym.diagnosis.result.files import plain
from ddagr_gym.diagnosis.search.rivals import rivals_of
from ddagr_gym.diagnosis.search.scanned_model import scan_model
from ddagr_gym.diagnosis.search.starting_models import StartingModels, starting_models
from ddagr_gym.diagnosis.setting import Setting
from ddagr_gym.errors import InputError
from ddagr_gym.identification.gauss_newton import Fitted, fit
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style
from ddagr_gym.tasks import Task, TaskRunner, run_tasks

HORIZON = "5"
SEEN_IN_VALUES = ("sensor_hold", "gyro_sign")
"""Effects that are found without a fit, and taken out of the recordings before it."""


def fit_named_effects(first: StartingModels, names: Sequence[str]) -> Fitted | None:
    """The nominal model with the effects of some names, the one that explains most first; None where one has no trace.

    Args:
        first: where a search begins.
        names: of effects.
    """
    none = Gate(float("inf"), float("inf"))
    gates = Thresholds({"": none} | dict.fromkeys(names, Gate(0.0, -float("inf"))), {}, 0, "an oracle")
    problem = first.session.problem
    model, left = scan_model(problem, first.refitted), set(names)
    while left:
        rivals = [r for r in rivals_of(problem, model, first.raw, gates, len(left)) if r.name in left]
        if not rivals:
            return None
        best = rivals[0].fitted
        model = scan_model(problem, fit(problem, best.point, iterations=8, renewals=2, first=best))
        left -= set(model.names)
    return model.fitted


def oracle(folder: Path, names: Sequence[str]) -> dict[str, Any] | None:
    """Certificate of the model with given names, as ``fit`` of a diagnosis; None where a name has no trace.

    Args:
        folder: of a case.
        names: of effects that are fitted.
    """
    robot, soil, runs = get_robot(ROBOT), get_soil(SOIL), read_runs(folder)
    thresholds = default_thresholds(ROBOT)
    first = starting_models(prepare(runs, robot, soil, thresholds, Setting().with_windows(thresholds.duration)))
    fitted = fit_named_effects(first, names)
    if fitted is None:
        return None
    return plain(certify_models(first.session, first.refitted, fitted, np.random.default_rng(0)))


def gain(fit: Mapping[str, Any] | None, name: str) -> Mapping[str, Any] | None:
    """Gain of the corrected model at the horizon; None where none was certified.

    Args:
        fit: of a diagnosis.
        name: "gain" of the motion or "gain_readings".
    """
    entry = ((fit or {}).get(name) or {}).get(HORIZON)
    return None if entry is None else entry["corrected"]


def compared(answer: Mapping[str, Any], same: bool, made: Mapping[str, Any] | None) -> dict[str, Any]:
    """Gains of diagnosis and oracle, and the share of one in the other where the oracle certainly gains anything.

    Args:
        answer: to the case.
        same: whether it gave the label's names.
        made: certificate of the oracle.
    """
    for name in ("gain", "gain_readings"):
        ours, best = gain(answer["fit"], name), gain(answer["fit"] if same else made, name)
        if ours is None or best is None or best["value"] < LEAST_EXPLAINABLE:
            continue
        if best["interval"] is None or best["interval"][0] > 0.0:
            share = ours["value"] / best["value"]
            return {"of": name, "diagnosis": ours["value"], "oracle": best["value"], "share": share}
    return {"of": None, "diagnosis": None, "oracle": None, "share": None}


def eligible(
    labels: Mapping[str, Any], answers: Mapping[str, Any], equivalents: Mapping[str, Sizes]
) -> Iterator[tuple[str, list[str], bool]]:
    """Cases with the names to fit, and whether the diagnosis gave just these."""
    for name, answer in sorted(answers.items()):
        label = labels[name]
        if label["kind"] not in ("single", "double") or not answer.get("fit"):
            continue
        if detectable(label, answer, equivalents.get(name)):
            fitted = [item for item in label["verdict"] if item not in SEEN_IN_VALUES]
            if fitted:
                yield name, fitted, sorted(answer["verdict"]) == sorted(label["verdict"])


def one(case: tuple[str, list[str], bool], folder: Path, answers: Mapping[str, Any]) -> dict[str, Any]:
    """What is written of a case."""
    name, names, same = case
    made = None if same else oracle(folder / name, names)
    found = compared(answers[name], same, made)
    return {"case": name, "names": names, "verdict": answers[name]["verdict"], "same": same, **found}


def draw(cases: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Gains of both, case by case, as PNG."""
    shown = [case for case in cases if case["share"] is not None]
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(8.0, 1.2 + 0.32 * max(len(shown), 1)), layout="constrained")
        axes = figure.subplots()
        rows = np.arange(len(shown))
        axes.barh(rows - 0.2, [100.0 * c["oracle"] for c in shown], 0.36, color=palette.GREY, label="told the names")
        axes.barh(rows + 0.2, [100.0 * c["diagnosis"] for c in shown], 0.36, color=palette.BLUE, label="diagnosis")
        axes.set_yticks(rows, [f"{c['case']}: {' + '.join(c['names'])}" for c in shown])
        axes.invert_yaxis()
        axes.set_xlabel("error on unseen drives that the names save, 5 s ahead [%]")
        figure.legend(loc="outside upper right", ncols=2)
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=120))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", type=Path, help="folder of a set")
    parser.add_argument("--labels", type=Path, required=True)
    parser.add_argument("--answers", type=Path, required=True)
    parser.add_argument("--equivalents", type=Path, required=True, help="sizes in the library's terms, of the same set")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--cluster", default="", help="local, or the address of a Ray cluster")
    parser.add_argument("--output", type=Path, default=RESULT.with_name("concealed_oracle.json"))
    return parser


def main(words: Sequence[str] | None = None) -> int:
    """Command line; returns the exit code."""
    options = _parser().parse_args(words)
    opened, answers = (json.loads(path.read_text()) for path in (options.labels, options.answers))
    labels = {name: entry["label"] for name, entry in opened["cases"].items()}
    try:
        chosen = list(eligible(labels, answers, read_equivalents(options.equivalents, opened)))
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    with TaskRunner(options.processes, cluster=options.cluster) as runner:
        shared = runner.share(answers)
        cases = run_tasks([Task(case[0], one, (case, options.cases, shared)) for case in chosen], "oracle", runner)
    share = mean([case["share"] for case in cases if case["share"] is not None])
    result = {"gain_share_of_oracle": share, "set": opened["set"], "cases": cases}
    write_atomically(options.output, lambda to: to.write_text(json.dumps(result, indent=1, allow_nan=False) + "\n"))
    draw(cases, options.output.with_suffix(".png"))
    print(figure_line("gain_share_of_oracle", share))
    return 0


if __name__ == "__main__":
    sys.exit(main())
