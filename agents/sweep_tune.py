"""A sweep's trainings as trials of Ray Tune, with its median stopping rule.

Trainings keep their own checkpoints, from which they go on to the bit, and a stopped one its course. A repeated command
therefore begins a new run of Tune in which trainings that have ended report what they had: the rule knows them again,
and the sweep may have grown meanwhile. Tune's own state of a run (``Tuner.restore``) knows neither.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from agents.main import ALGORITHMS
from agents.run import course_of, finished, train
from agents.sweep import OBJECTIVE, STOPPED, Sweep, Trial, stopped_course
from ddagr_gym.errors import InputError
from ddagr_gym.extras import how_to_install, need
from ddagr_gym.files import write_json
from ddagr_gym.progress import Progress
from ddagr_gym.tasks import Ended, Failure, Task
from ddagr_gym.tasks.task import raise_failures

ATTEMPTS = 3
"""How often a training is begun whose worker is lost or that fails, each time from its last checkpoint (ours)."""

need("ray")
# interrupts end the command at once, and nothing is written beside the trainings' own records
os.environ["TUNE_DISABLE_SIGINT_HANDLER"] = "1"
os.environ["TUNE_DISABLE_AUTO_CALLBACK_LOGGERS"] = "1"
try:
    from ray import tune
    from ray.tune.schedulers import FIFOScheduler, MedianStoppingRule
except ImportError as error:
    raise InputError(f"Ray is installed without Tune ({error}): run {how_to_install('cluster')}.") from None


def train_on_ray(sweep: Sweep, trials: Sequence[Trial], output: Path, workers: int, cluster: str) -> None:
    """Train what is not trained yet.

    Args:
        sweep: how trainings are stopped.
        trials: the trainings.
        output: folder of the trainings, which all nodes see.
        workers: processors of a local cluster.
        cluster: "local", or the address of one that runs.

    Raises:
        InputError: no cluster answers.
        FailedTasksError: trainings failed; the others ended.
    """
    import ray

    from ddagr_gym.tasks.engine_ray import code_hash, connect

    connect(cluster, workers)
    try:
        given = {"trials": tuple(trials), "output": str(output.resolve()), "code": code_hash()}
        with Progress(len(trials), "trainings") as progress:
            tuner = tune.Tuner(
                tune.with_resources(tune.with_parameters(reported_training, **given), {"cpu": 1}),
                param_space={"number": tune.grid_search(list(range(len(trials))))},
                tune_config=tune.TuneConfig(scheduler=_scheduler(sweep)),
                run_config=tune.RunConfig(
                    name="ray",
                    storage_path=str(output.resolve()),
                    failure_config=tune.FailureConfig(max_failures=ATTEMPTS - 1),
                    callbacks=[_Ends(trials, output, progress)],
                    verbose=0,
                ),
            )
            results = tuner.fit()
    finally:
        ray.shutdown()
    # in the order of the trials
    raise_failures([_failed(trials[n], results[n].error) for n in range(len(trials)) if results[n].error], len(trials))


def reported_training(config: dict[str, Any], trials: tuple[Trial, ...], output: str, code: str) -> None:
    """One training on a node, whose validations are reported; one that has ended reports them again."""
    from ddagr_gym.tasks.engine_ray import check_code

    check_code(code)
    trial, folder = trials[config["number"]], Path(output)
    result = finished(trial.folder(folder), trial.settings)
    ended = stopped_course(trial, folder) if result is None else course_of(result)
    if ended is None:
        make_model = ALGORITHMS[trial.settings.algorithm]
        train(make_model, trial.settings, trial.seed, trial.folder(folder), report=tune.report, quiet=True)
    for entry in ended or ():
        tune.report(entry)


class MedianRule(MedianStoppingRule):  # type: ignore[misc]
    """Ray's rule, for trainings that report again what they had before they were interrupted."""

    def __init__(self, grace: int) -> None:
        # an endless slice: without enough others to compare with, a training goes on and is not paused
        super().__init__("steps", OBJECTIVE, "max", grace_period=grace, min_time_slice=float("inf"))
        self._latest: dict[str, float] = {}

    def on_trial_result(self, tune_controller: Any, trial: Any, result: dict[str, Any]) -> str:
        """Whether a training goes on; what is known of it does not count twice."""
        if result["steps"] <= self._latest.get(trial.trial_id, -1):
            return str(self.CONTINUE)
        self._latest[trial.trial_id] = result["steps"]
        return str(super().on_trial_result(tune_controller, trial, result))


def _scheduler(sweep: Sweep) -> Any:
    return MedianRule(sweep.grace) if sweep.median_stopping else FIFOScheduler()


class _Ends(tune.Callback):  # type: ignore[misc]
    """Counts trainings that have ended, and keeps the courses of those that were stopped.

    By a ``ray://`` address Tune runs on the head of the cluster, with a copy of this that shows no progress.
    """

    def __init__(self, trials: Sequence[Trial], output: Path, progress: Progress | None) -> None:
        self._trials, self._output, self._progress = trials, output.resolve(), progress
        self._courses: dict[int, dict[int, dict[str, Any]]] = {n: {} for n in range(len(trials))}

    def __getstate__(self) -> dict[str, Any]:
        # a terminal cannot be sent or written
        return self.__dict__ | {"_progress": None}

    def on_trial_result(self, iteration: int, trials: list[Any], trial: Any, result: dict[str, Any], **_: Any) -> None:
        """Note a validation."""
        names = ("steps", "cpu_seconds", *(name for name in result if name.startswith(("radius_", "heading_radius_"))))
        entry = {name: result[name] for name in (*names, "success_rate", OBJECTIVE)}
        self._courses[trial.config["number"]][result["steps"]] = entry

    def on_trial_complete(self, iteration: int, trials: list[Any], trial: Any, **_: Any) -> None:
        """Keep the course of a training that has no result: it was stopped."""
        number = trial.config["number"]
        own = self._trials[number]
        if finished(own.folder(self._output), own.settings) is None and stopped_course(own, self._output) is None:
            content = {"digest": own.settings.digest(), "course": list(self._courses[number].values())}
            write_json(own.folder(self._output) / STOPPED, content)
        self._count()

    def on_trial_error(self, iteration: int, trials: list[Any], trial: Any, **_: Any) -> None:
        """Count a training that failed."""
        self._count()

    def _count(self) -> None:
        """One training more, where there is somebody to tell."""
        if self._progress is not None:
            self._progress.advance()


def _failed(trial: Trial, error: Exception) -> Ended:
    cause = getattr(error, "cause", error)
    message = str(cause).strip().rpartition("\n")[2] or type(cause).__name__
    failure = Failure("raised", message, str(error), bad_input=isinstance(cause, InputError))
    return Ended(Task(str(trial), reported_training), failure=failure)
