"""``ddagr_gym.diagnose_drives``: many drives of one robot, each against its calibration, and what changed over time."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ddagr_gym.api.drive_tasks import (
    STEP,
    DriveTask,
    Setting,
    answered,
    load_calibrated,
    setting_key,
    store_of,
    tasks_of,
)
from ddagr_gym.api.inputs import Sources
from ddagr_gym.api.results import Report, Table
from ddagr_gym.errors import at_least, unknown_name
from ddagr_gym.files import expanded
from ddagr_gym.recordings.files import DEFAULT_LIMITS, Limits

if TYPE_CHECKING:
    from ddagr_gym.diagnosis.answer.drive_series import DriveAnswer, DriveRow, DriveSeries, SeriesEvent
    from ddagr_gym.diagnosis.answer.verdict import Diagnosis
    from ddagr_gym.diagnosis.change.ordinary import OrdinaryRobot
    from ddagr_gym.diagnosis.store import StepStore

ANSWERS = "answers"
"""Folder of a report with what is kept of each drive, from which a later run goes on."""


@dataclass(frozen=True, eq=False, repr=False)
class DriveSeriesResult(Report):
    """Many drives of one robot over time.

    ``report`` writes drives.csv and drives.json, the page, index.html, for each answered drive a diagnosis.json in a
    folder of its number, and ``answers``, by which a later run with further drives computes only these.

    Attributes:
        series: the whole answer, as drives.json holds it.
        diagnoses: of the answered drives by the number of their row.
        kept: folders with the answers; none without a cache.
    """

    series: DriveSeries
    diagnoses: Mapping[int, Diagnosis]
    kept: Sequence[Path] = field(default=())

    @property
    def headline(self) -> str:
        """The first drive at which something changed, and what."""
        return self.series.sentence

    @property
    def drives(self) -> tuple[DriveRow, ...]:
        """One row per drive, in their order."""
        return self.series.rows

    @property
    def events(self) -> tuple[SeriesEvent, ...]:
        """Drives at which something changed."""
        return self.series.events

    @property
    def refused(self) -> tuple[DriveRow, ...]:
        """Drives without an answer."""
        return tuple(row for row in self.drives if row.refused)

    def tables(self) -> Sequence[Table]:
        """Drives, and events."""
        from ddagr_gym.reporting import drive_series_text as text

        drives = Table(text.DRIVE_HEADER, text.drive_rows(self.series))
        events = Table(text.EVENT_HEADER, text.event_rows(self.series))
        return [drives, events] if self.events else [drives]

    def __str__(self) -> str:
        from ddagr_gym.reporting.drive_series_text import series_text

        return series_text(self.series)

    def to_json(self, path: str | os.PathLike[str]) -> None:
        """Write drives.json (``docs/drive_series_schema.md``), whole or not at all."""
        from ddagr_gym.diagnosis.series.files import save

        save(self.series, Path(path))

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the table of drives, whole or not at all."""
        from ddagr_gym.files import write_text
        from ddagr_gym.reporting.drive_series_text import drives_csv

        write_text(path, drives_csv(self.series))

    def _fill(self, folder: Path, progress: Callable[[str], None] | None) -> None:
        from ddagr_gym.diagnosis.result.files import save
        from ddagr_gym.reporting.drive_series_page import write_page

        self.to_json(folder / "drives.json")
        self.to_csv(folder / "drives.csv")
        for number, diagnosis in self.diagnoses.items():
            (folder / f"drive_{number + 1}").mkdir()
            save(diagnosis, folder / f"drive_{number + 1}" / "diagnosis.json")
        for kept in self.kept:
            shutil.copytree(kept, folder / ANSWERS / kept.name)
        write_page(folder, self.series)


def diagnose_drives(
    recordings: Sources,
    calibration: str | os.PathLike[str],
    ground: str = "",
    *,
    seed: int = 0,
    threads: int = 1,
    processes: int = 1,
    cluster: str = "",
    column_map: str | os.PathLike[str] | None = None,
    limits: Limits = DEFAULT_LIMITS,
    progress: Callable[[str], None] | None = None,
    cache: str | os.PathLike[str] | None = None,
) -> DriveSeriesResult:
    """Compare each of many drives of one robot with its calibration, and find where something changed.

    Every drive gets an answer of its own, as :func:`ddagr_gym.diagnose` with a calibration gives it; one that cannot be
    read or compared is a row with the reason. Drives are ordered by the time of their first row where all have a clock,
    else by the name of their file. One that the robot was calibrated with is compared with the others.

    Args:
        recordings: drives: recordings, tables, paths of files, or a folder.
        calibration: folder that ``ddagr calibrate`` wrote.
        ground: of the calibration that all drives are on; "" for one of which only the kind is known.
        seed: of the resampling.
        threads: of the simulator, in each process.
        processes: drives at a time; each takes 0.3 to 1 GB.
        cluster: a Ray cluster to work on: "local" starts one of so many processors here, an address takes one that
            runs. Answers are the same.
        column_map: shipped map by name or the path of one's own, for files that are not imported yet.
        limits: on rows and bytes of files.
        progress: called with a line of text for each drive.
        cache: folder in which answers are kept by content; the same call, also with further drives, computes only
            those that are not in it.

    Returns:
        Table of drives, control charts of all sizes, and the drives at which something changed.

    Raises:
        InputError: no recording, no such calibration, one without a bank, an unknown ground, or a cluster that does
            not answer.

    Examples:
        >>> import ddagr_gym
        >>> result = ddagr_gym.diagnose_drives("drives", calibration="calibration")  # doctest: +SKIP
        >>> print(result.headline)  # doctest: +SKIP
    """
    at_least(threads=(threads, 1), processes=(processes, 1), seed=(seed, 0))
    folder = expanded(calibration)
    calibrated = load_calibrated(folder)
    ordinary, _ = calibrated
    if ground and ground not in ordinary.soils:
        raise unknown_name("ground", ground, ordinary.soils)
    setting = Setting(folder, ground, None if column_map is None else str(column_map), limits, seed, threads)
    tasks = tasks_of(recordings)
    kept = None if cache is None else Path(cache)
    key = "" if kept is None else setting_key(setting)
    found, stores = _known(tasks, kept, key, (lambda line: None) if progress is None else progress)
    missing = [task for task in tasks if task.name not in found]
    say = _Counter(len(tasks), len(tasks) - len(missing), progress)
    for task, answer in answered(missing, setting, calibrated, processes, cluster):
        found[task.name] = answer
        if not isinstance(answer, str):
            stores[task.name].step(STEP, partial(_same, answer))
        say.answered(task.name, answer)
    return _result(tasks, found, ordinary, ground, kept, key)


def _known(
    tasks: Sequence[DriveTask], cache: Path | None, key: str, progress: Callable[[str], None]
) -> tuple[dict[str, DriveAnswer | str], dict[str, StepStore]]:
    """Answers by name that need no work: kept ones, and drives that are there twice; and where each is kept."""
    found: dict[str, DriveAnswer | str] = _twins(tasks)
    open_tasks = [task for task in tasks if task.name not in found and not task.unread]
    stores = {task.name: store_of(task, key, cache, progress) for task in open_tasks}
    kept = {name: store.find(STEP) for name, store in stores.items()}
    return found | {name: item.value for name, item in kept.items() if item is not None}, stores


def _same(answer: DriveAnswer) -> DriveAnswer:
    return answer


def _twins(tasks: Sequence[DriveTask]) -> dict[str, DriveAnswer | str]:
    """Sentences on drives that are there twice, by name: the first of them counts."""
    first: dict[str, str] = {}
    found: dict[str, DriveAnswer | str] = {}
    for task in tasks:
        if task.sha256 and first.setdefault(task.sha256, task.name) != task.name:
            found[task.name] = f"{task.name} has the content of {first[task.sha256]}: it counts once."
    return found


class _Counter:
    """Lines of progress with the time that is left.

    Args:
        total: drives.
        known: of them, without work.
        progress: called with each line.
    """

    def __init__(self, total: int, known: int, progress: Callable[[str], None] | None) -> None:
        self._total, self._known, self._progress = total, known, progress
        self._done = known
        self._start = time.monotonic()
        if known and progress is not None:
            progress(f"{known} of {total} drives have an answer already")

    def answered(self, name: str, answer: DriveAnswer | str) -> None:
        """Say what a drive came to."""
        self._done += 1
        if self._progress is None:
            return
        said = f"refused: {answer}" if isinstance(answer, str) else ", ".join(answer.diagnosis.verdict)
        each = (time.monotonic() - self._start) / (self._done - self._known)
        left = each * (self._total - self._done)
        about = f" (about {left:.0f} s left)" if left >= 1.0 else ""
        self._progress(f"drive {self._done} of {self._total}, {name}: {said}{about}")


def _result(
    tasks: Sequence[DriveTask],
    found: Mapping[str, DriveAnswer | str],
    ordinary: OrdinaryRobot,
    ground: str,
    cache: Path | None,
    key: str,
) -> DriveSeriesResult:
    from ddagr_gym.diagnosis.series.conclusion import conclude_series, drive_row, in_order

    rows = [drive_row(task.name, task.sha256, found[task.name]) for task in tasks]
    order, numbers = in_order(rows)
    answers = [found[tasks[k].name] for k in numbers]
    points = [() if isinstance(item, str) else item.points for item in answers]
    series = conclude_series([rows[k] for k in numbers], points, order, ordinary, ground)
    diagnoses = {k: item.diagnosis for k, item in enumerate(answers) if not isinstance(item, str)}
    stores = [store_of(tasks[numbers[k]], key, cache) for k in diagnoses] if cache is not None else []
    return DriveSeriesResult(series, diagnoses, tuple(item.folder for item in stores if item.folder is not None))
