"""The drives of a folder one by one: what is kept of each by its content, and how several run side by side."""

from __future__ import annotations

import hashlib
import os
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from ddagr_gym.api.drive_names import names_apart
from ddagr_gym.api.inputs import Source, Sources, recordings_from, sources_in
from ddagr_gym.errors import InputError
from ddagr_gym.recordings.files import DEFAULT_LIMITS, Limits
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.tasks.task import Failure

if TYPE_CHECKING:
    from ddagr_gym.diagnosis.answer.drive_series import DriveAnswer
    from ddagr_gym.diagnosis.change.ordinary import OrdinaryRobot
    from ddagr_gym.diagnosis.store import StepStore
    from ddagr_gym.tasks import TaskRunner

Calibrated: TypeAlias = "tuple[OrdinaryRobot, dict[str, str]]"
"""The calibrated robot, and its ordinary drives' names by the hash of their values."""

STEP = "answer"
"""Name of the only finished step of a drive."""

FAULT = "a fault of this program"
"""Begins the sentence on a drive that failed for a reason that nobody foresaw."""

LESS_AT_ONCE = "mostly for want of memory: give fewer --processes; the same command goes on."
"""Ends the sentence on a drive whose process was ended from outside."""


@dataclass(frozen=True)
class Setting:
    """What all drives are compared with, and how.

    Attributes:
        calibration: folder.
        ground: of the calibration that all drives are on; "" where it is not known.
        column_map: of files that are not imported yet; None for the one that fits best.
        limits: on rows and bytes of files.
        seed: of everything random.
        threads: of the simulator.
    """

    calibration: Path
    ground: str = ""
    column_map: str | None = None
    limits: Limits = DEFAULT_LIMITS
    seed: int = 0
    threads: int = 1


@dataclass(frozen=True, eq=False)
class DriveTask:
    """One drive.

    Attributes:
        source: path, or the recording itself.
        name: of its file, with as many of its folders as tell it from others, and a number for what is there again.
        sha256: of the file or of the values; "" where the file cannot be read.
        unread: why not; "" where it can.
    """

    source: Path | Recording
    name: str
    sha256: str
    unread: str = ""


def tasks_of(given: Sources) -> list[DriveTask]:
    """One task for each drive that is given, each with a name of its own, files as they are found in folders.

    Raises:
        InputError: nothing given, or a folder without recordings.
    """
    found = [_task(item, number) for number, item in enumerate(sources_in(given))]
    if not found:
        raise InputError("no recording is given: name one or more files, or a folder of them.")
    names = names_apart([task.name for task in found], [task.source for task in found])
    return [replace(task, name=name) for task, name in zip(found, names, strict=True)]


def _task(item: Source, number: int) -> DriveTask:
    from ddagr_gym.diagnosis.preprocessing.input_requirements import content_hash
    from ddagr_gym.recordings.files import sha256_of

    if isinstance(item, str | os.PathLike):
        path = Path(item)
        try:
            return DriveTask(path, path.name, sha256_of(path))
        except InputError as error:
            return DriveTask(path, path.name, "", str(error))
    (recording,) = recordings_from(item)
    return DriveTask(recording, recording.meta.source or f"table {number + 1}", content_hash(recording))


def setting_key(setting: Setting) -> str:
    """SHA-256 of all that an answer depends on besides the drive; the number of threads is not among it."""
    from ddagr_gym.calibration.files import NAME, ROBOT
    from ddagr_gym.calibration.ordinary_files import NAME as BANK
    from ddagr_gym.diagnosis.gates.source_digest import source_digest

    digest = hashlib.sha256(source_digest().encode())
    files = [setting.calibration / name for name in (NAME, ROBOT, BANK)]
    for path in [*files, *sorted(setting.calibration.glob("soil_*.yaml"))]:
        digest.update(path.name.encode() + path.read_bytes())
    chosen = setting.column_map
    own = Path(chosen).read_bytes() if chosen is not None and Path(chosen).is_file() else b""
    digest.update(repr((setting.ground, chosen, setting.seed)).encode() + own)
    return digest.hexdigest()


def store_of(
    task: DriveTask, key: str, cache: Path | None, progress: Callable[[str], None] = lambda line: None
) -> StepStore:
    """Where the answer on a drive is kept: a folder of its own, named by all that the answer depends on."""
    from ddagr_gym.diagnosis.store import StepStore

    whole = hashlib.sha256(f"{key} {task.sha256} {task.name}".encode()).hexdigest()
    return StepStore(None if cache is None else cache / whole[:32], whole, progress)


def answered(
    tasks: Sequence[DriveTask], setting: Setting, calibrated: Calibrated, processes: int, cluster: str = ""
) -> Iterator[tuple[DriveTask, DriveAnswer | str]]:
    """Answers, or sentences why there is none, as they come.

    Args:
        tasks: drives.
        setting: of all.
        calibrated: what all are compared with.
        processes: that work side by side.
        cluster: as of :class:`ddagr_gym.tasks.TaskRunner`; files are sent there by content.
    """
    from ddagr_gym.tasks import Task, TaskRunner

    if not tasks:
        return
    given = {task.name: task for task in tasks}
    with TaskRunner(min(processes, len(tasks)), cluster=cluster) as runner:
        shared, column_map = runner.share(calibrated), _own_map(setting, runner)
        # one after the other: a file is read when its turn comes
        sent = (Task(task.name, answer_of, (task, setting, shared, _file(task, runner), column_map)) for task in tasks)
        for ended in runner.run(sent):
            yield given[ended.task.name], ended.value if ended.failure is None else _without_answer(ended.failure)


def _file(task: DriveTask, runner: TaskRunner) -> Any:
    """Handle of a drive's file or folder (a bag); None for a recording, and for what cannot be read."""
    source = task.source
    return runner.share_file(source) if isinstance(source, Path) and source.exists() and not task.unread else None


def _own_map(setting: Setting, runner: TaskRunner) -> Any:
    """Handle of one's own column map; the name of a shipped one."""
    chosen = setting.column_map
    return runner.share_file(Path(chosen)) if chosen is not None and Path(chosen).is_file() else chosen


def _without_answer(failure: Failure) -> str:
    if failure.kind == "lost":
        return f"no answer, {failure.message}, {LESS_AT_ONCE}"
    return f"{FAULT}: {failure.message}"


def answer_of(
    task: DriveTask, setting: Setting, calibrated: Calibrated, file: Path | None, column_map: Path | str | None
) -> DriveAnswer | str:
    """The answer on a drive; whatever is wrong with it is a sentence, and no other drive's matter.

    Args:
        task: the drive.
        setting: of all.
        calibrated: what all are compared with.
        file: of the drive where the task is run; None for a recording.
        column_map: its place, or its name.
    """
    from ddagr_gym.diagnosis.series.one_drive import answer_for
    from ddagr_gym.tasks import release

    if task.unread:
        return task.unread
    ordinary, known = calibrated
    try:
        try:
            (recording,) = recordings_from(file or task.source, ordinary.robot, column_map, setting.limits)
        finally:
            if file is not None:
                release(file)
        name = known.get(_hash(recording), "")
        return answer_for(
            recording.with_meta(source=task.name), ordinary, setting.ground, name, seed=setting.seed,
            threads=setting.threads,
        )  # fmt: skip
    except InputError as error:
        return " ".join(str(error).split())
    except Exception as error:
        return _fault(error)


def _hash(recording: Recording) -> str:
    from ddagr_gym.diagnosis.preprocessing.input_requirements import content_hash

    return content_hash(recording)


def _fault(error: Exception) -> str:
    last = traceback.extract_tb(error.__traceback__)[-1]
    where = f"{Path(last.filename).name}, line {last.lineno}"
    return f"{FAULT} ({type(error).__name__} in {where}: {' '.join(str(error).split())}): report it with the drive."


def load_calibrated(folder: Path) -> Calibrated:
    """What drives are compared with, from a calibration's folder.

    Raises:
        InputError: no such calibration, or one without a bank.
    """
    from ddagr_gym.calibration.files import load
    from ddagr_gym.calibration.ordinary_robot import load_ordinary_robot

    drives = {item.sha256: item.source for item in load(folder).drives}
    return load_ordinary_robot(folder), drives
