"""Generate a set of concealed cases.

``python -m benchmarks.concealed.generate --set development --seed 1 --output DIR``
``python -m benchmarks.concealed.generate --set ninth --seed secret --output DIR --labels FILE``
``python -m benchmarks.concealed.generate --set ninth --plan``

The same seed gives the same bytes. A run that was interrupted goes on where it stopped. ``--seed secret`` draws a
128-bit seed that is kept with the labels only. The pool is its own: this folder shares no code with ``ddagr_gym``.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import secrets
import shutil
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from .cases import SETS, Case, counts, plan
from .commitments import committed, salt
from .drive import SUBSTEPS, drive
from .jit import FOLDER, source_digest
from .plant import nominal_plant
from .simulate import simulate_case
from .storage import BenchmarkError, read_json, write_case, write_json


def _header(set_name: str, seed: int) -> dict[str, Any]:
    import numba
    import scipy

    versions = {"numpy": np.__version__, "scipy": scipy.__version__, "numba": numba.__version__}
    sources = tuple(sorted(path.name for path in FOLDER.glob("*.py")))
    return {"set": set_name, "seed": seed, "generator": source_digest(sources), "versions": versions}


def _parts(labels_file: Path) -> Path:
    return labels_file.with_name(f"{labels_file.name}.parts")


def _begin(set_name: str, seed: int | None, output: Path, labels_file: Path) -> dict[str, Any]:
    """Header of the run; on resuming it must be the one that began."""
    kept, parts = labels_file if labels_file.exists() else _parts(labels_file) / "header.json", _parts(labels_file)
    if kept.exists():
        before = {key: value for key, value in read_json(kept).items() if key != "cases"}
        header = _header(set_name, before["seed"] if seed is None else seed)
        if before != header:
            raise BenchmarkError(f"{output} was begun with another seed, set or generator: give a new --output.")
    else:
        if output.exists() and any(output.iterdir()):
            raise BenchmarkError(f"{output} is not empty and has no labels at {labels_file}: give a new --output.")
        header = _header(set_name, secrets.randbits(128) if seed is None else seed)
    parts.mkdir(parents=True, exist_ok=True)
    output.mkdir(parents=True, exist_ok=True)
    write_json(parts / "header.json", header)
    return header


def make_case(task: tuple[Case, int, Path, Path]) -> str:
    """Generate one case unless it is already there; returns its name."""
    case, seed, output, parts = task
    part = parts / f"{case.name}.json"
    if not (part.exists() and (output / case.name).is_dir()):
        logs, label = simulate_case(case, seed)
        data = write_case(output / case.name, logs)
        write_json(part, {"label": label, "data": data})
    return case.name


def warm_up() -> None:
    """Compile the kernels once, so that parallel workers load them."""
    drive(nominal_plant(), np.zeros((2 * SUBSTEPS, 2)), np.zeros(3))


def _work(tasks: list[tuple[Case, int, Path, Path]], processes: int) -> Iterator[str]:
    if processes == 1:
        yield from map(make_case, tasks)
        return
    with multiprocessing.get_context("spawn").Pool(processes) as pool:
        yield from pool.imap_unordered(make_case, tasks)


def _progress(done: int, total: int, began: float) -> None:
    left = (time.monotonic() - began) / done * (total - done)
    end = "\n" if done == total else "\r"
    print(f"{done}/{total} cases, about {left:4.0f} s left", end=end, file=sys.stderr, flush=True)


def _finish(header: dict[str, Any], cases: list[Case], output: Path, labels_file: Path) -> None:
    """Collect the parts into labels and, for a sealed set, commitments."""
    parts = _parts(labels_file)
    entries = {case.name: read_json(parts / f"{case.name}.json") for case in cases}
    sealed = header["set"] != "development"
    opened = {
        name: {"label": entry["label"], **({"salt": salt(header["seed"], name)} if sealed else {})}
        for name, entry in entries.items()
    }
    if sealed:
        write_json(output / "commitments.json", committed(header, entries))
    write_json(labels_file, {**header, "cases": opened})
    shutil.rmtree(parts)


def generate(
    set_name: str,
    seed: int | None,
    output: Path,
    labels_file: Path | None = None,
    processes: int = 2,
    limit: int | None = None,
) -> Path:
    """Generate a set.

    Args:
        set_name: of :data:`benchmarks.concealed.cases.SETS`; all but the development set are sealed.
        seed: of the set; None draws a secret one.
        output: folder for the cases; may hold the same set begun earlier.
        labels_file: where the labels go; default ``output/labels.json`` (development) or a file beside the folder.
        processes: that work at the same time.
        limit: only the first cases, for a trial.

    Returns:
        The labels file.
    """
    output = output.resolve()
    beside = output.with_name(f"{output.name}.labels.json")
    default = output / "labels.json" if set_name == "development" else beside
    labels_file = (labels_file or default).resolve()
    if set_name != "development" and output in labels_file.parents:
        raise BenchmarkError(f"{labels_file} lies inside the {set_name} set: give --labels a file outside {output}.")
    header = _begin(set_name, seed, output, labels_file)
    cases = plan(set_name, header["seed"])[:limit]
    if labels_file.exists() and len(read_json(labels_file)["cases"]) == len(cases):
        shutil.rmtree(_parts(labels_file))
        return labels_file
    warm_up()
    tasks, began = [(case, header["seed"], output, _parts(labels_file)) for case in cases], time.monotonic()
    for done, _ in enumerate(_work(tasks, processes), start=1):
        _progress(done, len(tasks), began)
    _finish(header, cases, output, labels_file)
    return labels_file


def _seed(text: str) -> int | None:
    if text == "secret":
        return None
    if not text.isdigit():
        raise argparse.ArgumentTypeError(f"{text!r} is no seed: give a non-negative whole number or 'secret'")
    return int(text)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="benchmarks.concealed.generate", description=__doc__.split("\n\n")[0])
    parser.add_argument("--set", dest="set_name", choices=SETS, required=True)
    parser.add_argument("--seed", type=_seed, default=-1, help="whole number, or 'secret'")
    parser.add_argument("--output", type=Path, help="folder for the cases")
    parser.add_argument("--labels", type=Path, help="file for the labels; outside the folder for a sealed set")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--limit", type=int, help="only the first cases, for a trial")
    parser.add_argument("--plan", action="store_true", help="only say how many cases of each kind a set holds")
    return parser


def plan_text(set_name: str) -> str:
    """Cases of each kind, a line each, and their sum; nothing that a seed decides."""
    found = counts(set_name)
    return "\n".join(
        f"{kind:15s} {count:4d}" for kind, count in [*sorted(found.items()), ("cases", sum(found.values()))]
    )


def main(arguments: list[str] | None = None) -> int:
    """Command line; returns the exit code."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if options.plan:
        print(plan_text(options.set_name))
        return 0
    if options.seed == -1 or options.output is None:
        parser.error("give --seed and --output, or --plan")
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    try:
        labels = generate(
            options.set_name, options.seed, options.output, options.labels, options.processes, options.limit
        )
    except BenchmarkError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    print(f"cases: {options.output}\nlabels: {labels}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
