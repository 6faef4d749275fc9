"""Many trainings: configurations by seeds, side by side, with a table and a picture of what came of them.

``ddagr train --sweep FILE`` runs them on worker processes, each to its end. With ``--cluster`` they run on Ray Tune
(:mod:`agents.sweep_tune`), which may stop those that fall behind. A training is the one of ``ddagr train``: of one
thread, with the same bits wherever it runs. Its folder says how far it is, so that the same command goes on after a
stop, and adds configurations and seeds that the file has meanwhile.
"""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agents.main import ALGORITHMS, load_settings
from agents.run import course_of, finished, train
from agents.settings import TrainingSettings
from ddagr_gym.config import load_config
from ddagr_gym.errors import InputError
from ddagr_gym.files import make_folder, write_text
from ddagr_gym.tasks import Task, TaskRunner, run_tasks

TABLE, FIGURE = "sweep.csv", "sweep.png"
STOPPED = "stopped.json"
"""In the folder of a training that fell behind: its course until then."""

OBJECTIVE = "mean_return"
"""What trainings are compared by while they run: the mean return on the validation set, judged alike for all."""

COLUMNS = (
    "configuration", "seed", "ended", "steps", "cpu_seconds", "radius_error_median", "radius_error_p95",
    "heading_radius_error_median", "success_rate", OBJECTIVE,
)  # fmt: skip
"""Of the table; ``ended`` is "finished", "stopped" (it fell behind) or "" (no result)."""

FINISHED, FELL_BEHIND = "finished", "stopped"

_NAME = re.compile(r"\w[\w.-]*")


@dataclass(frozen=True)
class SweepConfiguration:
    """Settings of some trainings.

    Attributes:
        config: name in configs/training, or a YAML file.
        set: changes of it, as ``ppo.learning_rate=3e-4``.
    """

    config: str
    set: tuple[str, ...] = ()


@dataclass(frozen=True)
class Sweep:
    """What is trained.

    Attributes:
        description: one line.
        configurations: by name, which is that of their folder.
        seeds: of each configuration, from 0.
        median_stopping: whether a training is stopped whose best validation so far is worse than the median of the
            others' running means at the same step. Which ones are stopped depends on how many run at a time.
        grace: control steps before which none is stopped.
    """

    description: str
    configurations: dict[str, SweepConfiguration]
    seeds: int = 3
    median_stopping: bool = False
    grace: int = 0

    def __post_init__(self) -> None:
        if not self.configurations:
            raise InputError("configurations is empty: give at least one, NAME: {config: ppo_ekf}.")
        for name in self.configurations:
            if not _NAME.fullmatch(name):
                raise InputError(f"the configuration {name!r} names a folder: letters, digits, '_', '-' and '.' only.")
        for field, least in (("seeds", 1), ("grace", 0)):
            if getattr(self, field) < least:
                raise InputError(f"{field} is {getattr(self, field)}: give at least {least}.")


@dataclass(frozen=True)
class Trial:
    """One training of a sweep.

    Attributes:
        configuration: its name.
        seed: of the training.
        settings: of it.
    """

    configuration: str
    seed: int
    settings: TrainingSettings

    def __str__(self) -> str:
        return f"{self.configuration} seed {self.seed}"

    def folder(self, output: Path) -> Path:
        """Where its files go."""
        return output / self.configuration / f"seed_{self.seed}"


def load_sweep(file: Path) -> tuple[Sweep, list[Trial]]:
    """A sweep and its trainings, seeds of one configuration after those of the other.

    Raises:
        InputError: what is wrong with the file, or with a configuration, in one sentence.
    """
    sweep, trials = load_config(file, Sweep), []
    for name, chosen in sweep.configurations.items():
        try:
            settings = load_settings(chosen.config, chosen.set)
        except InputError as error:
            raise InputError(f"{file}, configuration {name!r}: {error}") from None
        trials += [Trial(name, seed, settings) for seed in range(sweep.seeds)]
    return sweep, trials


def run_sweep(file: Path, output: Path, workers: int, cluster: str = "") -> list[dict[str, Any]]:
    """Train all of a sweep that is not trained yet, and write its table and picture.

    Args:
        file: of the sweep.
        output: folder of the trainings.
        workers: trainings at a time, or processors of a local cluster.
        cluster: empty for processes of this machine; "local" or the address of a Ray cluster, whose nodes see the
            output folder.

    Returns:
        Rows of the table, one for each training.

    Raises:
        InputError: bad input, or median stopping without a cluster.
        FailedTasksError: trainings failed; the others ended, and the table has them.
    """
    sweep, trials = load_sweep(file)
    if sweep.median_stopping and not cluster:
        raise InputError(
            f"{file} asks for median_stopping, which is Ray Tune's: give --cluster local, or set it to false."
        )
    make_folder(output)
    try:
        if cluster and not all(outcome(trial, output)[0] for trial in trials):
            from agents.sweep_tune import train_on_ray

            train_on_ray(sweep, trials, output, workers, cluster)
        elif not cluster:
            _train_on_processes(trials, output, workers)
    finally:
        # also after a stop: what there is
        rows = [row_of(trial, output) for trial in trials]
        write_table(rows, output / TABLE)
    _draw(sweep, trials, output)
    return rows


def _train_on_processes(trials: Sequence[Trial], output: Path, workers: int) -> None:
    waiting = [trial for trial in trials if finished(trial.folder(output), trial.settings) is None]
    with TaskRunner(min(workers, max(len(waiting), 1))) as runner:
        run_tasks([Task(str(trial), train_trial, (trial, output)) for trial in waiting], "trainings", runner)


def train_trial(trial: Trial, output: Path) -> None:
    """One training in its folder; workers call it by name."""
    train(ALGORITHMS[trial.settings.algorithm], trial.settings, trial.seed, trial.folder(output), quiet=True)


def stopped_course(trial: Trial, output: Path) -> list[dict[str, Any]] | None:
    """Course of a training that fell behind with these settings; None where it did not."""
    file = trial.folder(output) / STOPPED
    if not file.is_file():
        return None
    kept = json.loads(file.read_text(encoding="utf-8"))
    course: list[dict[str, Any]] = kept["course"]
    return course if kept["digest"] == trial.settings.digest() else None


def outcome(trial: Trial, output: Path) -> tuple[str, list[dict[str, Any]]]:
    """How a training ended, as the table says it, and its validations by steps."""
    result = finished(trial.folder(output), trial.settings)
    if result is not None:
        return FINISHED, course_of(result)
    stopped = stopped_course(trial, output)
    return ("", []) if stopped is None else (FELL_BEHIND, stopped)


def row_of(trial: Trial, output: Path) -> dict[str, Any]:
    """Row of the table: how a training ended, and its last validation."""
    ended, found = outcome(trial, output)
    last = found[-1] if found else {}
    known = {"configuration": trial.configuration, "seed": trial.seed, "ended": ended}
    return known | {name: last.get(name) for name in COLUMNS if name not in known}


def write_table(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Write rows as CSV; what is not known is empty."""
    text = io.StringIO()
    table = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    table.writeheader()
    table.writerows(rows)
    write_text(path, text.getvalue())


def _draw(sweep: Sweep, trials: Sequence[Trial], output: Path) -> None:
    from agents.sweep_figure import draw_courses

    courses: dict[str, list[tuple[bool, list[dict[str, Any]]]]] = {name: [] for name in sweep.configurations}
    for trial in trials:
        ended, found = outcome(trial, output)
        courses[trial.configuration].append((ended == FELL_BEHIND, found))
    draw_courses(courses, OBJECTIVE, output / FIGURE)
