"""Sizes of concealed effects in the library's terms, where generator and library mean different things by a size.

    python -m benchmarks.concealed_equivalents sealed --labels sealed/labels.json

writes ``benchmarks/results/concealed_equivalents.json``: by case and effect the sizes at which the library's form best
does what the generator's form did, with soil, robot and biases held at what they are without it. The latter are fitted
to a *twin*: the same case made again from its seed without the effect, everything random the same; what the library's
form would do for the twin is taken off. Nothing that a diagnosis said has a part in it; with ``--equivalents`` the
scoring asks whether such a size is one that the diagnosis says it can show. Every case is made again as well and must
give the recordings that are there.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from benchmarks.ablations.examine import ROBOT, SOIL, read_runs
from benchmarks.concealed.cases import Case, plan
from benchmarks.concealed.catalogue import DRIVETRAIN
from benchmarks.concealed.change import Form
from benchmarks.concealed.generate import warm_up
from benchmarks.concealed.simulate import simulate_case
from benchmarks.concealed.storage import csv_bytes, digest, read_json, recording_digest, write_case
from benchmarks.concealed_truth import true_sizes
from ddagr_gym.diagnosis.gates.threshold_files import default_thresholds
from ddagr_gym.diagnosis.search.starting_models import refit_nominal
from ddagr_gym.diagnosis.setting import Setting, make_problem
from ddagr_gym.errors import InputError
from ddagr_gym.identification.gauss_newton import fit
from ddagr_gym.identification.problem import Point
from ddagr_gym.physics.effects.base import Effect
from ddagr_gym.physics.effects.registry import effect_kind
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.tasks import Task, TaskRunner, run_tasks

RESULT = Path(__file__).resolve().parent / "results" / "concealed_equivalents.json"
ITERATIONS = 12


def needs_equivalent(effect: Mapping[str, Any]) -> bool:
    """Whether a label's effect has sizes in the library, but none that means the same.

    Not between command and wheel: beside faults of another structure, which show all the same, the library's sizes
    shrink to next to nothing, and the cases would count as too small to tell. They count as they are.

    Args:
        effect: entry of a label.
    """
    kind = effect_kind(effect["name"])
    fitted = kind.differentiable and not kind.categorical and effect["name"] not in DRIVETRAIN
    return fitted and not true_sizes(effect)


def without(case: Case, left_out: int) -> Case:
    """The case with one effect of its plant idle: drawn as before, it changes nothing.

    Args:
        case: of a set.
        left_out: place of the effect.
    """

    def idle(form: Form) -> Form:
        return replace(form, build=lambda size, rng, site: replace(form.build(size, rng, site), plant=None))

    effects = [(idle(form) if k == left_out else form, size) for k, (form, size) in enumerate(case.effects)]
    return replace(case, effects=tuple(effects))


def drives(case: Case, seed: int, folder: Path | None = None) -> list[Recording]:
    """Recordings of a case made from its seed.

    Args:
        case: of a set.
        seed: of the set.
        folder: of recordings that they must equal; None for none.

    Raises:
        InputError: they do not.
    """
    logs, _ = simulate_case(case, seed)
    for run, log in logs.items():
        if folder is not None and digest(csv_bytes(log)) != recording_digest(folder / f"{run}.csv.gz"):
            raise InputError(
                f"{folder.name}/{run} is not what its seed gives here: use the checkout, versions and kind of machine "
                "that made the set."
            )
    with tempfile.TemporaryDirectory() as made:
        write_case(Path(made) / "case", logs)
        return read_runs(Path(made) / "case")


def equivalent(case: Sequence[Recording], twin: Sequence[Recording], first: Effect) -> dict[str, float]:
    """Sizes at which an effect of the library best explains a case, with everything else as it is in the twin.

    What the library's effect would explain of the twin, because two simulators are not one, is taken off.

    Args:
        case: recordings with the effect.
        twin: the same without it.
        first: where the fit begins; its shapes stay.
    """
    robot, soil = get_robot(ROBOT), get_soil(SOIL)
    setting = Setting().with_windows(default_thresholds(ROBOT).duration)
    values = refit_nominal(make_problem(robot, soil, twin, setting))[1].point.values
    fixed = frozenset(first.shape_names())
    found = []
    for recordings in (case, twin):
        problem = make_problem(robot, soil, recordings, setting)
        problem.prior[:] = 0.0
        start = Point(values, problem.starts(values), (first,))
        found.append(fit(problem, start, iterations=ITERATIONS, fixed=fixed).point.effects[0])
    neutral = {name: float(first.parameter(name).metadata["neutral"]) for name in first.size_names()}
    return {name: middle + getattr(found[0], name) - getattr(found[1], name) for name, middle in neutral.items()}


def equivalents_of(name: str, folder: Path, opened: Mapping[str, Any]) -> dict[str, dict[str, float]]:
    """Equivalent sizes of a case's effects that need them, by name of the effect.

    Args:
        name: of the case.
        folder: of the set.
        opened: labels file with its seed.
    """
    seed = int(opened["seed"])
    case = next(item for item in plan(opened["set"], seed) if item.name == name)
    made = drives(case, seed, folder / name)
    found = {}
    for k, effect in enumerate(opened["cases"][name]["label"]["effects"]):
        if needs_equivalent(effect):
            kind = effect_kind(effect["name"])
            sizes = {n: kind.parameter(n).metadata for n in kind.size_names()}
            first = replace(kind.neutral(), **{n: data["neutral"] + data["least"] for n, data in sizes.items()})
            found[effect["name"]] = equivalent(made, drives(without(case, k), seed), first)
    return found


def equivalents(folder: Path, opened: Mapping[str, Any], processes: int = 2, cluster: str = "") -> dict[str, Any]:
    """Equivalent sizes of a set, by case.

    Args:
        folder: of the set.
        opened: labels file with its seed.
        processes: that work at the same time.
        cluster: as of :class:`ddagr_gym.tasks.TaskRunner`; its nodes see the same files.
    """
    labels = {name: entry["label"] for name, entry in opened["cases"].items()}
    chosen = [
        name
        for name, label in sorted(labels.items())
        if label["kind"] in ("single", "double") and any(needs_equivalent(e) for e in label["effects"])
    ]
    warm_up()
    with TaskRunner(processes, cluster=cluster) as runner:
        labels_file = runner.share(opened)
        tasks = [Task(name, equivalents_of, (name, folder, labels_file)) for name in chosen]
        found = dict(zip(chosen, run_tasks(tasks, "equivalent sizes", runner), strict=True))
    return {"set": opened["set"], "generator": opened["generator"], "seed": opened["seed"], "cases": found}


def main(words: Sequence[str] | None = None) -> int:
    """Command line; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", type=Path, help="folder of a set")
    parser.add_argument("--labels", type=Path, required=True, help="with the seed, as the generator writes them")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--cluster", default="", help="local, or the address of a Ray cluster")
    parser.add_argument("--output", type=Path, default=RESULT)
    options = parser.parse_args(words)
    try:
        result = equivalents(options.cases, read_json(options.labels), options.processes, options.cluster)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    write_atomically(options.output, lambda to: to.write_text(json.dumps(result, indent=1, allow_nan=False) + "\n"))
    for case, sizes in result["cases"].items():
        print(case, json.dumps(sizes))
    return 0


if __name__ == "__main__":
    sys.exit(main())
