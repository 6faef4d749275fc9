"""Run ``ddagr diagnose`` on cases as a user would and write what it says, one entry a case, failures included.

    python benchmarks/answers/run_diagnoses.py concealed             every case of shared/concealed -> concealed.json
    python benchmarks/answers/run_diagnoses.py recordings            every real drive -> recordings.json
    python benchmarks/answers/run_diagnoses.py DIR --output FILE     a set of the project's own generator

Options after ``--`` go to every run; ``-- --names-only`` leaves out what follows the verdict and halves the time.

Each case is one run of the command line in a process of its own. Finished cases are kept beside the answers until all
are there, so that an interrupted script goes on; nothing is edited by hand. ``commit`` is the checkout's at the time.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ddagr_gym import __version__
from ddagr_gym.recordings.files import write_atomically

HERE = Path(__file__).resolve().parent
CHECKOUT = HERE.parents[1]
ENTRIES = ("verdict", "complete", "findings", "sentence", "fit", "detectable", "misfit", "seconds", "version")
"""What an answer keeps of a diagnosis.json."""

UNKNOWN_GROUND = ("--soil", "firm_ground", "--soil-uncertainty", "4", "--stride", "4")
"""Where a file does not say what it was driven on; every other window of drives of ten minutes is enough."""

REAL_BANK = CHECKOUT / "ddagr_gym" / "data" / "null_bank_warthog.json"
"""Thresholds from ordinary Warthog drives; no ordinary Husky drive is at hand, so they serve for it too."""


@dataclass(frozen=True)
class Case:
    """Recordings that are diagnosed together.

    Attributes:
        name: key of the answer.
        arguments: of ``ddagr diagnose``, without the output.
    """

    name: str
    arguments: tuple[str, ...]


def shared() -> Path:
    """Folder with the cases."""
    return Path(os.environ.get("DDAGR_SHARED") or CHECKOUT.parent / "shared")


def synthetic_cases(folder: Path) -> Iterator[Case]:
    """Folders of three drives of the DDAGR on the thesis's soil."""
    for path in sorted(item for item in folder.iterdir() if any(item.glob("run_*.csv.gz"))):
        runs = (str(run) for run in sorted(path.glob("run_*.csv.gz")))
        yield Case(path.name, (*runs, "--map", "concealed", "--robot", "ddagr", "--soil", "thesis_a1"))


def real_cases(folder: Path) -> Iterator[Case]:
    """Real drives, one a case; the robot is in the file's name."""
    for path in sorted((folder / "concealed").glob("*.csv.gz")) + sorted((folder / "open").glob("*.csv.gz")):
        robot = path.name.split("_", 1)[0]
        options = ("--robot", robot, *UNKNOWN_GROUND, "--thresholds", str(REAL_BANK))
        yield Case(path.name.split(".", 1)[0], (str(path), *options))


def diagnose(case: Case, parts: Path, options: tuple[str, ...]) -> dict[str, Any]:
    """Answer of one case, from its part where it is finished already."""
    part = parts / f"{case.name}.json"
    if part.is_file():
        return json.loads(part.read_text())  # type: ignore[no-any-return]
    output = parts / case.name
    command = [sys.executable, "-m", "ddagr_gym", "diagnose", *case.arguments, *options]
    began = time.monotonic()
    done = subprocess.run(
        [*command, "--output", str(output), "--overwrite"], capture_output=True, text=True, cwd=CHECKOUT, check=False
    )
    answer = _answer(output / "diagnosis.json", done) | {"commit": commit()}
    answer.setdefault("seconds", time.monotonic() - began)
    write_atomically(part, lambda to: to.write_text(json.dumps(answer, indent=1) + "\n"))
    shutil.rmtree(output, ignore_errors=True)
    return answer


def _answer(path: Path, done: subprocess.CompletedProcess[str]) -> dict[str, Any]:
    """Entries of a diagnosis, or what the command said when it failed."""
    if done.returncode == 0 and path.is_file():
        found = json.loads(path.read_text())
        return {name: found.get(name) for name in ENTRIES}
    lines = done.stderr.strip().splitlines()
    failure = {"exit_code": done.returncode, "message": lines[-1] if lines else ""}
    return {"verdict": [], "complete": False, "findings": [], "version": __version__, "failure": failure}


def commit() -> str:
    """Commit of the checkout, with a mark where files differ from it."""
    head = subprocess.run(["git", "rev-parse", "HEAD"], capture_output=True, text=True, cwd=CHECKOUT, check=False)
    changes = subprocess.run(
        ["git", "status", "--porcelain", "--untracked-files=no"],
        capture_output=True,
        text=True,
        cwd=CHECKOUT,
        check=False,
    )
    return head.stdout.strip() + ("+changes" if changes.stdout.strip() else "")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", help="concealed, recordings, or a folder of cases")
    parser.add_argument("--output", type=Path, default=None)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--only", nargs="*", default=None, help="names of cases")
    words = sys.argv[1:]
    end = words.index("--") if "--" in words else len(words)
    arguments, options = parser.parse_args(words[:end]), tuple(words[end + 1 :])
    if arguments.cases == "recordings":
        found = list(real_cases(Path(os.environ.get("DDAGR_RECORDINGS") or shared() / "recordings")))
    else:
        folder = shared() / "concealed" if arguments.cases == "concealed" else Path(arguments.cases)
        found = list(synthetic_cases(folder))
    if arguments.only is not None:
        found = [case for case in found if case.name in arguments.only]
    output = arguments.output or HERE / f"{Path(arguments.cases).name}.json"
    if not found:
        print(f"no cases for {arguments.cases}: set DDAGR_SHARED or name a folder of cases", file=sys.stderr)
        return 2
    write_answers(found, output, arguments.processes, options)
    return 0


def write_answers(cases: list[Case], output: Path, processes: int, options: tuple[str, ...]) -> None:
    """Answers of all cases into one file, in the cases' order."""
    parts = output.with_suffix(".parts")
    parts.mkdir(parents=True, exist_ok=True)
    answers: dict[str, Any] = {}
    with ThreadPoolExecutor(processes) as pool:
        futures = {pool.submit(diagnose, case, parts, options): case.name for case in cases}
        for future in as_completed(futures):
            answers[futures[future]] = future.result()
            said = future.result()["verdict"] or future.result().get("failure")
            print(f"{len(answers)}/{len(cases)} {futures[future]}: {said}", flush=True)
    ordered = {case.name: answers[case.name] for case in cases}
    write_atomically(output, lambda to: to.write_text(json.dumps(ordered, indent=1, allow_nan=False) + "\n"))
    shutil.rmtree(parts)


if __name__ == "__main__":
    sys.exit(main())
