"""What each choice of the diagnosis is worth: arms without it, on cases of the project's own generator.

    python -m benchmarks.ablate_concealed DIR --labels LABELS.json --nulls 20 --singles 28

Everything is compared after the first scan (the effect that stands first, and whether it passes its gate), where the
arms differ; a whole diagnosis goes on with joint refits and is better. Figures of an arm, each ``{value, interval,
count}`` with 95 % Wilson intervals:

- ``top1``: singles where the right effect stands first and passes its gate;
- ``first``: singles where it stands first, gate aside;
- ``false_alarm_rate``: nulls where some effect passes its gate or a channel's misfit its limit;
- ``top1_at_same_alarms``: singles where the right effect stands first and higher over its gate than any effect in any
  null of the same arm, so that no arm is blamed or praised for gates that were made for another one.

Seconds are of CPU. Finished cases are kept beside the result, so that an interrupted script goes on.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.ablations.figure import draw
from benchmarks.score_concealed import NULLS, mean, share
from ddagr_gym.errors import InputError
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.tasks import Task, TaskRunner, run_tasks

RESULT = Path(__file__).resolve().parent / "results" / "concealed_ablations.json"

Said = Mapping[str, Mapping[str, Mapping[str, Any]]]
"""What was said by case and arm."""


@dataclass(frozen=True)
class Work:
    """One case for a worker.

    Attributes:
        folder: of the case.
        part: where its result is kept.
        thresholds: file of the null bank; the one that ships by default.
    """

    folder: Path
    part: Path
    thresholds: Path | None


def chosen(labels: Mapping[str, Any], nulls: int, singles: int, seed: int) -> list[str]:
    """Cases to examine: nulls of both kinds alike, singles of as many different effects as possible.

    Args:
        labels: by case.
        nulls: how many.
        singles: how many.
        seed: of the choice.

    Raises:
        InputError: the set has fewer.
    """
    rng = np.random.default_rng(seed)
    found: list[str] = []
    groups = {"nulls": (nulls, NULLS), "singles": (singles, ("single",))}
    for words, (count, kinds) in groups.items():
        names = [name for name in sorted(labels) if labels[name]["kind"] in kinds]
        if count > len(names):
            raise InputError(f"{count} {words} were asked for and the set has {len(names)}: ask for fewer.")
        found += _spread([names[k] for k in rng.permutation(len(names))], labels)[:count]
    return sorted(found)


def _spread(names: Sequence[str], labels: Mapping[str, Any]) -> list[str]:
    """Names in rounds, each with at most one of a kind and verdict."""
    seen: dict[tuple[str, ...], int] = {}
    rounds = []
    for name in names:
        key = (labels[name]["kind"], *labels[name]["verdict"])
        rounds.append((seen.get(key, 0), name))
        seen[key] = seen.get(key, 0) + 1
    return [name for _, name in sorted(rounds, key=lambda item: item[0])]


def examined(work: Work) -> str:
    """Examine a case unless that is done; returns its name."""
    from benchmarks.ablations.examine import ROBOT, examine
    from ddagr_gym.diagnosis.gates.source_digest import source_digest
    from ddagr_gym.diagnosis.gates.threshold_files import default_thresholds, load_thresholds

    thresholds = default_thresholds(ROBOT) if work.thresholds is None else load_thresholds(work.thresholds)
    key = f"{source_digest()} {thresholds.bank}"
    if not (work.part.is_file() and json.loads(work.part.read_text())["key"] == key):
        entry = {"key": key, "arms": examine(work.folder, thresholds)}
        write_atomically(work.part, lambda to: to.write_text(json.dumps(entry, indent=1) + "\n"))
    return work.folder.name


def figures(labels: Mapping[str, Any], said: Said) -> dict[str, Any]:
    """Figures by arm.

    Args:
        labels: by case.
        said: of the cases that were examined.
    """
    arms = list(next(iter(said.values())))
    nulls = [name for name in said if labels[name]["kind"] in NULLS]
    singles = [name for name in said if labels[name]["kind"] == "single"]
    return {arm: _of_arm({name: said[name][arm] for name in said}, labels, nulls, singles) for arm in arms}


def _of_arm(
    said: Mapping[str, Mapping[str, Any]], labels: Mapping[str, Any], nulls: Sequence[str], singles: Sequence[str]
) -> dict[str, Any]:
    right = {name: said[name]["name"] == labels[name]["verdict"][0] for name in singles}
    highest = max((said[name]["ratio"] for name in nulls), default=0.0)
    return {
        "top1": share([right[name] and said[name]["passes"] for name in singles]),
        "first": share(list(right.values())),
        "false_alarm_rate": share([said[name]["alarm"] for name in nulls]),
        "named_on_nulls": share([said[name]["passes"] for name in nulls]),
        "top1_at_same_alarms": share([right[name] and said[name]["ratio"] > highest for name in singles]),
        "highest_ratio_of_nulls": highest,
        "seconds": mean([entry["seconds"] for entry in said.values()]),
    }


def ablate(
    folder: Path,
    labels: Mapping[str, Any],
    names: Sequence[str],
    output: Path,
    processes: int,
    thresholds: Path | None,
    cluster: str = "",
) -> dict[str, Any]:
    """Examine cases, write the result and the picture.

    Args:
        folder: of the set.
        labels: by case.
        names: of the cases.
        output: JSON to write; the picture has the same name.
        processes: that work at the same time.
        thresholds: file of the null bank; the one that ships by default.
        cluster: as of :class:`ddagr_gym.tasks.TaskRunner`; its nodes see the same files.
    """
    parts = output.with_suffix(".parts")
    parts.mkdir(parents=True, exist_ok=True)
    works = [Work(folder / name, parts / f"{name}.json", thresholds) for name in names]
    with TaskRunner(processes, cluster=cluster) as runner:
        run_tasks([Task(work.folder.name, examined, (work,)) for work in works], "examining cases", runner)
    said = {work.folder.name: json.loads(work.part.read_text())["arms"] for work in works}
    truth = {name: {"kind": labels[name]["kind"], "label": labels[name]["verdict"]} for name in said}
    result = {"arms": figures(labels, said), "cases": {name: truth[name] | {"said": said[name]} for name in said}}
    write_atomically(output, lambda to: to.write_text(json.dumps(result, indent=1) + "\n"))
    draw(result["arms"], output.with_suffix(".png"))
    shutil.rmtree(parts)
    return result


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", type=Path, help="folder of a set")
    parser.add_argument("--labels", type=Path, required=True)
    parser.add_argument("--nulls", type=int, default=20)
    parser.add_argument("--singles", type=int, default=28)
    parser.add_argument("--seed", type=int, default=0, help="chooses the cases")
    parser.add_argument("--only", nargs="*", help="names of cases instead")
    parser.add_argument("--thresholds", type=Path, help="of ddagr null-bank; those that ship by default")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--cluster", default="", help="local, or the address of a Ray cluster")
    parser.add_argument("--output", type=Path, default=RESULT)
    return parser


def main(words: Sequence[str] | None = None) -> int:
    """Command line; returns the exit code."""
    arguments = _parser().parse_args(words)
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    labels = {name: entry["label"] for name, entry in json.loads(arguments.labels.read_text())["cases"].items()}
    try:
        names = arguments.only or chosen(labels, arguments.nulls, arguments.singles, arguments.seed)
        result = ablate(
            arguments.cases, labels, names, arguments.output, arguments.processes, arguments.thresholds,
            arguments.cluster,
        )  # fmt: skip
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    for arm, entry in result["arms"].items():
        shown = {name: f["value"] for name, f in entry.items() if isinstance(f, dict) and f["value"] is not None}
        print(f"{arm:14s}", "  ".join(f"{name} {value:.2f}" for name, value in shown.items()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
