"""Run ``ddagr diagnose`` on cases as a user would and write what it says, one entry a case, failures included.

    python -m benchmarks.answers.run_diagnoses concealed             every case of shared/concealed -> concealed.json
    python -m benchmarks.answers.run_diagnoses recordings            every real drive -> recordings.json
    python -m benchmarks.answers.run_diagnoses recordings --calibration CAL   what changed in those that CAL is not of
    python -m benchmarks.answers.run_diagnoses DIR --output FILE     a set of the project's own generator

Options after ``--`` go to every run; ``-- --names-only`` leaves out what follows the verdict and halves the time.
``--full-every N`` runs one case in N to the end and names only in the others. Which ones, a hash of their names and
of ``--full-seed`` says, so that no label has a part in it.

Each case is one run of the command line in a process of its own; the cores are shared among ``--processes`` of them.
Finished cases are kept beside the answers until all are there, so that an interrupted script goes on, and a case that
was run with other options is run again; nothing is edited by hand. A run that fails, or takes longer than
``--time-limit``, is an answer that says so. ``--collect`` runs nothing and writes the answers of the cases that an
interrupted script has finished. ``commit`` is the checkout's at the time. A case without an answer, as where its run
was told to stop or its recording cannot be read, is named at the end (exit code 1), and the others go on. ``--cluster``
runs cases on Ray (``local``, or an address), whose nodes see the same files.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from types import FrameType
from typing import Any, NoReturn

from benchmarks.answers.run_recordings_check import recordings_folder
from benchmarks.commits import commit_of
from ddagr_gym.calibration.files import load as load_calibration
from ddagr_gym.errors import InputError
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.tasks import FailedTasksError, Task, TaskRunner
from ddagr_gym.tasks.runner import STOPPED
from ddagr_gym.tasks.task import raise_failures
from ddagr_gym.version import __version__

HERE = Path(__file__).resolve().parent
CHECKOUT = HERE.parents[1]
ENTRIES = (
    "verdict", "complete", "findings", "rejected", "sentence", "fit", "detectable", "detectable_alone", "misfit",
    "change", "drivetrain", "seconds", "version",
)  # fmt: skip
"""What an answer keeps of a diagnosis.json."""

UNKNOWN_GROUND = ("--soil", "firm_ground", "--soil-uncertainty", "4")
"""Where a file does not say what it was driven on."""

_RECORDING = ".csv.gz"

INTERRUPTED = (130, -2, -15)
"""Exit codes of a run that was told to stop; it is no answer."""


class InterruptedRunError(Exception):
    """A run was told to stop."""


@dataclass(frozen=True)
class Case:
    """Recordings that are diagnosed together.

    Attributes:
        name: key of the answer.
        arguments: of ``ddagr diagnose``, without the output.
        options: of this script and its user, kept with the answer.
    """

    name: str
    arguments: tuple[str, ...]
    options: tuple[str, ...] = ()


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
        yield Case(path.name.split(".", 1)[0], (str(path), "--robot", robot, *UNKNOWN_GROUND))


def changed_cases(folder: Path, calibration: Path) -> Iterator[Case]:
    """Real drives of the robot of a calibration that it was not made of, one a case."""
    made = load_calibration(calibration)
    of = {item.source.split(".", 1)[0] for item in made.drives}
    for case in real_cases(folder):
        if case.name not in of and case.name.startswith(made.robot):
            yield Case(case.name, (case.arguments[0], "--calibration", str(calibration)))


def chosen_for_all(name: str, every: int, seed: int) -> bool:
    """Whether a case is one of those that are run to the end: one in ``every``, by a hash of its name.

    Args:
        name: of the case.
        every: 1 chooses all.
        seed: another one chooses others.
    """
    return int.from_bytes(hashlib.sha256(f"{seed} {name}".encode()).digest()[:8]) % every == 0


def with_options(cases: list[Case], options: tuple[str, ...], every: int | None, seed: int) -> list[Case]:
    """Cases with their options: those of the user, and ``--names-only`` where a case is not run to the end."""
    found = []
    for case in cases:
        short = every is not None and not chosen_for_all(case.name, every, seed)
        found.append(replace(case, options=(*options, "--names-only") if short else options))
    return found


def diagnose(case: Case, parts: Path, threads: int, limit: float) -> dict[str, Any]:
    """Answer of one case, from its part where it is finished already.

    Args:
        case: what to run.
        parts: folder of finished answers.
        threads: of the run.
        limit: after which it is stopped [s].

    Raises:
        InterruptedRunError: the run was told to stop.
    """
    part = parts / f"{case.name}.json"
    data = data_hash(case.arguments)
    asked = {"arguments": shown(case.arguments), "options": list(case.options), "data": data}
    if part.is_file():
        kept: dict[str, Any] = json.loads(part.read_text())
        if [kept.get(name) for name in asked] == list(asked.values()):
            return kept
    output = parts / case.name
    command = [sys.executable, "-m", "ddagr_gym", "diagnose", *case.arguments, "--threads", str(threads), *case.options]
    began, commit = time.monotonic(), commit_of(CHECKOUT)
    done = _run([*command, "--output", str(output), "--overwrite"], limit)
    if done.returncode in INTERRUPTED:
        raise InterruptedRunError(case.name)
    told = {**asked, "commit": commit}
    answer = _answer(output / "diagnosis.json", done) | told
    answer.setdefault("seconds", time.monotonic() - began)
    write_atomically(part, lambda to: to.write_text(json.dumps(answer, indent=1) + "\n"))
    shutil.rmtree(output, ignore_errors=True)
    return answer


def shown(arguments: Sequence[str]) -> list[str]:
    """Arguments of a run as they are kept with its answer: recordings and other folders by name, the checkout's files
    from there."""
    return [_shown(word) for word in arguments]


def _shown(word: str) -> str:
    inside = word.startswith(f"{CHECKOUT}/")
    return word.removeprefix(f"{CHECKOUT}/") if inside and not word.endswith(_RECORDING) else Path(word).name


def data_hash(arguments: Sequence[str]) -> str:
    """SHA-256 over the recordings among the arguments."""
    digest = hashlib.sha256()
    for word in arguments:
        if word.endswith(_RECORDING):
            digest.update(hashlib.sha256(Path(word).read_bytes()).digest())
    return digest.hexdigest()


def _run(command: list[str], limit: float) -> subprocess.CompletedProcess[str]:
    """The command in one thread of linear algebra; one that takes too long ends with code 124."""
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    try:
        with _ended_by_sigterm():
            return subprocess.run(
                command, capture_output=True, text=True, cwd=CHECKOUT, env=environment, check=False, timeout=limit
            )
    except subprocess.TimeoutExpired:
        return subprocess.CompletedProcess(command, 124, "", f"stopped after {limit:g} s")


@contextmanager
def _ended_by_sigterm() -> Iterator[None]:
    """Block that SIGTERM leaves by an exception, so that a worker that is stopped takes its command with it."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.getsignal(signal.SIGTERM)
    if before is not signal.SIG_DFL:
        # the runner's own, where the case runs in its process
        yield
        return
    signal.signal(signal.SIGTERM, _leave)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _leave(number: int, frame: FrameType | None) -> NoReturn:
    raise SystemExit(STOPPED)


def _answer(path: Path, done: subprocess.CompletedProcess[str]) -> dict[str, Any]:
    """Entries of a diagnosis, or what the command said when it failed."""
    if done.returncode == 0 and path.is_file():
        found = json.loads(path.read_text())
        return {name: found.get(name) for name in ENTRIES}
    lines = done.stderr.strip().splitlines()
    failure = {"exit_code": done.returncode, "message": lines[-1] if lines else ""}
    return {"verdict": [], "complete": False, "findings": [], "version": __version__, "failure": failure}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", help="concealed, recordings, or a folder of cases")
    parser.add_argument("--output", type=Path, default=None)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--full-every", type=int, default=None, metavar="N", help="names only in all but one in N")
    parser.add_argument("--full-seed", type=int, default=0, help="chooses the cases that are run to the end")
    parser.add_argument("--time-limit", type=float, default=1800.0, help="of a case [s]")
    parser.add_argument("--collect", action="store_true", help="write the answers that are finished, run nothing")
    parser.add_argument("--only", nargs="*", default=None, help="names of cases")
    parser.add_argument("--calibration", type=Path, default=None, help="of the robot, for the real recordings")
    parser.add_argument("--cluster", default="", help="local, or the address of a Ray cluster (extra cluster)")
    words = sys.argv[1:]
    end = words.index("--") if "--" in words else len(words)
    arguments, options = parser.parse_args(words[:end]), tuple(words[end + 1 :])
    if arguments.cases == "recordings":
        folder, known = recordings_folder(), arguments.calibration
        found = list(real_cases(folder) if known is None else changed_cases(folder, known.resolve()))
    else:
        folder = shared() / "concealed" if arguments.cases == "concealed" else Path(arguments.cases)
        found = list(synthetic_cases(folder))
    if arguments.only is not None:
        found = [case for case in found if case.name in arguments.only]
    for name in ("processes", "full_every"):
        value = getattr(arguments, name)
        if value is not None and value < 1:
            parser.error(f"--{name.replace('_', '-')} must be at least 1")
    name = Path(arguments.cases).name
    output = arguments.output or HERE / f"{name if arguments.calibration is None else f'{name}_changed'}.json"
    if not found:
        print(f"no cases for {arguments.cases}: set DDAGR_SHARED or name a folder of cases", file=sys.stderr)
        return 2
    found = with_options(found, options, arguments.full_every, arguments.full_seed)
    if arguments.collect:
        print(f"{collect(found, output)} of {len(found)} cases are finished: {output}")
        return 0
    try:
        write_answers(found, output, arguments.processes, arguments.time_limit, arguments.cluster)
    except FailedTasksError as error:
        print(f"{error}\nthe same command runs them again", file=sys.stderr)
        return 1
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f"interrupted; the same command goes on from {output.with_suffix('.parts')}", file=sys.stderr)
        return 130
    return 0


def write_answers(cases: list[Case], output: Path, processes: int, limit: float, cluster: str = "") -> None:
    """Answers of all cases into one file, in the cases' order.

    Args:
        cases: with their options.
        output: file to write.
        processes: runs at the same time.
        limit: of one run [s].
        cluster: as of :class:`ddagr_gym.tasks.TaskRunner`.

    Raises:
        FailedTasksError: cases without an answer; the others were run and are kept.
        InputError: a cluster that does not answer.
    """
    parts = output.resolve().with_suffix(".parts")
    parts.mkdir(parents=True, exist_ok=True)
    threads = max((os.cpu_count() or 1) // processes, 1)
    tasks = [Task(case.name, diagnose, (case, parts, threads, limit)) for case in cases]
    answers: dict[str, Any] = {}
    failed = []
    with TaskRunner(processes, cluster=cluster) as runner:
        for count, ended in enumerate(runner.run(tasks), start=1):
            if ended.failure is not None:
                failed.append(ended)
                said = ended.failure.message
            else:
                answers[ended.task.name] = ended.value
                said = ended.value["verdict"] or ended.value.get("failure")
            print(f"{count}/{len(cases)} {ended.task.name}: {said}", flush=True)
    raise_failures(failed, len(cases))
    ordered = {case.name: answers[case.name] for case in cases}
    write_atomically(output, lambda to: to.write_text(json.dumps(ordered, indent=1, allow_nan=False) + "\n"))
    shutil.rmtree(parts)


def collect(cases: list[Case], output: Path) -> int:
    """Write the answers of finished cases and leave them where they are; how many there are.

    Args:
        cases: in the order of the answers.
        output: file to write.
    """
    parts = output.with_suffix(".parts")
    finished = {case.name: parts / f"{case.name}.json" for case in cases}
    answers = {name: json.loads(part.read_text()) for name, part in finished.items() if part.is_file()}
    write_atomically(output, lambda to: to.write_text(json.dumps(answers, indent=1, allow_nan=False) + "\n"))
    return len(answers)


if __name__ == "__main__":
    sys.exit(main())
