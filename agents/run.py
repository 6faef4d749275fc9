"""What PPO and SAC share: the environment stack, the folder of a training, its journal, its checkpoints."""

from __future__ import annotations

import io
import json
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger, configure
from stable_baselines3.common.vec_env import VecNormalize

from agents.asymmetric import WithTruth
from agents.checkpoint import read_checkpoint, resume, snapshot, write_checkpoint
from agents.export import archive_of
from agents.settings import TrainingSettings
from agents.validation import ValidationResult, drive_all
from ddagr_gym.commands.output import write_text
from ddagr_gym.config import dump_config
from ddagr_gym.envs.options import make_settings
from ddagr_gym.envs.settings import Episode
from ddagr_gym.files import make_folder
from ddagr_gym.policies.archive import save_policy
from ddagr_gym.progress import Progress
from ddagr_gym.wrappers.policy_view import PolicyViewVecEnv
from ddagr_gym.wrappers.sb3 import TurnVecEnv

Episodes = list[tuple[int, Episode]]

Report = Callable[[dict[str, Any]], None]

CHECKPOINT = "checkpoint.pkl"
POLICY = "policy.npz"
RESULT = "result.json"

_REWARD_CLIP = 10.0


def _unheard(entry: dict[str, Any]) -> None:
    """A report that nobody asked for."""


def make_environment(settings: TrainingSettings) -> VecNormalize:
    """Batch of turns as the policy sees it, inputs and rewards normalised."""
    turns = TurnVecEnv(settings.environments, staggered=True, **settings.task.environment(settings.design))
    view: Any = PolicyViewVecEnv(turns, settings.design)
    if settings.algorithm == "ppo":
        view = WithTruth(view)
    discount = settings.ppo.discount if settings.algorithm == "ppo" else settings.sac.discount
    return VecNormalize(view, norm_reward=settings.algorithm == "ppo", clip_reward=_REWARD_CLIP, gamma=discount)


@dataclass
class Training:
    """One training in its folder.

    Attributes:
        settings: of the arm.
        seed: of this training.
        folder: of its files.
        validation: scenarios that its course is judged on.
        checkpoint_seconds: between checkpoints.
        report: called with each validation of its course, those before an interruption included.
        quiet: without a bar of progress.
    """

    settings: TrainingSettings
    seed: int
    folder: Path
    validation: Episodes
    checkpoint_seconds: float = 60.0
    report: Report = _unheard
    quiet: bool = False

    def logger(self) -> Logger:
        """TensorBoard under the folder; nothing on the terminal."""
        return configure(str(self.folder / "tensorboard"), ["tensorboard"])

    def run(self, model: BaseAlgorithm, normalise: VecNormalize) -> dict[str, Any]:
        """Train to the end, from the checkpoint where there is one.

        Returns:
            The result, which is also written.
        """
        make_folder(self.folder)
        write_text(self.folder / "settings.yaml", dump_config(self.settings))
        model.set_logger(self.logger())
        checkpoint = self.folder / CHECKPOINT
        saved = read_checkpoint(checkpoint, self.settings.digest())
        history: list[dict[str, Any]] = []
        spent = 0.0
        if saved is not None:
            extra = resume(model, normalise, saved)
            history, spent = extra["history"], extra["seconds"]
        steps = self.settings.steps
        for entry in history:
            self.report(entry)
        stream = io.StringIO() if self.quiet else None
        with Progress(steps, f"{self.folder.parent.name} {self.folder.name}", stream=stream) as progress:
            progress.advance(model.num_timesteps)
            course = _Course(self, normalise, progress, history, spent)
            if model.num_timesteps < steps:
                model.learn(steps - model.num_timesteps, course, reset_num_timesteps=saved is None)
        return self._finish(model, normalise, course)

    def _finish(self, model: BaseAlgorithm, normalise: VecNormalize, course: _Course) -> dict[str, Any]:
        policy = archive_of(model, normalise, self.settings, self.seed)
        save_policy(policy, self.folder / POLICY)
        result = {
            "seed": self.seed,
            "steps": model.num_timesteps,
            "cpu_seconds": round(course.seconds(), 1),
            "digest": self.settings.digest(),
            "validation": {**self.validate(model, normalise).summary(), "robot": self._judged_on()},
            "course": course.history,
        }
        write_text(self.folder / RESULT, json.dumps(result, indent=1))
        self.report(course_of(result)[-1])
        return result

    def _judged_on(self) -> str:
        """Names of the robots of the validation turns, which may be others than the trained one."""
        return ", ".join(sorted({episode.robot.name for _, episode in self.validation}))

    def validate(self, model: BaseAlgorithm, normalise: VecNormalize) -> ValidationResult:
        """Drive the validation scenarios without exploration."""
        policy = archive_of(model, normalise, self.settings, self.seed)
        design = self.settings.design
        # the judge's settings, not the training's: rewards are then comparable between arms
        return drive_all(policy, design, make_settings(**design.environment), self.validation)


class _Course(BaseCallback):
    """Journal, validation and checkpoints of a training, all between rollouts."""

    def __init__(
        self,
        training: Training,
        normalise: VecNormalize,
        progress: Progress,
        history: list[dict[str, Any]],
        spent: float,
    ) -> None:
        super().__init__()
        self.training = training
        self.normalise = normalise
        self.progress = progress
        self.history = history
        self._spent = spent
        self._started = time.process_time()
        self._saved_at = time.monotonic()
        self._endings: list[tuple[bool, float]] = []

    def seconds(self) -> float:
        """CPU time of the training so far, resumed parts added [s]."""
        return self._spent + time.process_time() - self._started

    def _on_rollout_start(self) -> None:
        interval = self.training.settings.validation_interval
        done = self.history[-1]["steps"] // interval if self.history else -1
        if self.model.num_timesteps // interval > done:
            self._validate()
        if time.monotonic() - self._saved_at >= self.training.checkpoint_seconds:
            self.checkpoint()

    def _validate(self) -> None:
        summary = self.training.validate(self.model, self.normalise).summary()
        entry = {"steps": self.model.num_timesteps, "cpu_seconds": round(self.seconds(), 1), **summary}
        self.history.append(entry)
        self.training.report(entry)
        for name, value in summary.items():
            if value is not None:
                self.logger.record(f"validation/{name}", value)

    def checkpoint(self) -> None:
        """Save, between rollouts only: a rollout begins with an empty buffer."""
        extra = {"history": self.history, "seconds": self.seconds()}
        saved = snapshot(self.model, self.normalise, extra)
        write_checkpoint(self.training.folder / CHECKPOINT, self.training.settings.digest(), saved)
        self._saved_at = time.monotonic()

    def _on_step(self) -> bool:
        self.progress.advance(self.training.settings.environments)
        dones = self.locals["dones"]
        if dones.any():
            infos = self.locals["infos"]
            shares = [float(infos[n]["is_success"]) for n in np.flatnonzero(dones)]
            self.logger.record_mean("training/success", float(np.mean(shares)))
        return True


def finished(folder: Path, settings: TrainingSettings) -> dict[str, Any] | None:
    """Result of a training that has ended with these settings, or None."""
    file = folder / RESULT
    if not file.is_file() or not (folder / POLICY).is_file():
        return None
    result: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return result if result["digest"] == settings.digest() else None


def course_of(result: dict[str, Any]) -> list[dict[str, Any]]:
    """Validations of a training that has ended, the last one of the policy that it gave."""
    last = {"steps": result["steps"], "cpu_seconds": result["cpu_seconds"], **result["validation"]}
    return [*result["course"], last]


def validation_episodes(count: int | None = None) -> Episodes:
    """The first ``count`` scenarios of the validation set V, all by default."""
    from ddagr_gym.evaluation.scenarios import load_scenarios

    return [(scenario.seed, scenario.episode) for scenario in load_scenarios("V")[:count]]


def describe(found: dict[str, Any]) -> str:
    """A validation's summary as a phrase, with the robot that made its turns where that was kept."""
    median, worst = (
        "none" if found[f"radius_error_{name}"] is None else f"{100 * found[f'radius_error_{name}']:.2f} %"
        for name in ("median", "p95")
    )
    turned_by = f" (turns of the robot {found['robot']})" if found.get("robot") else ""
    success = f"success {100 * found['success_rate']:.0f} %"
    return f"median |e_R| {median}, 95th percentile {worst}, {success}{turned_by}"


def one_thread() -> None:
    """One thread for torch: more are slower for networks of this size, and on a busy machine much slower."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    torch.set_num_threads(1)


MakeModel = Callable[[TrainingSettings, VecNormalize, int], BaseAlgorithm]


def train(
    make_model: MakeModel,
    settings: TrainingSettings,
    seed: int,
    folder: Path,
    validation: Episodes | None = None,
    checkpoint_seconds: float = 60.0,
    *,
    report: Report = _unheard,
    quiet: bool = False,
) -> dict[str, Any]:
    """One training from start, or from its checkpoint, to end; what has ended before is not done again.

    Args:
        make_model: algorithm.
        settings: of the arm.
        seed: of the training.
        folder: of its files.
        validation: scenarios that its course is judged on; the validation set by default.
        checkpoint_seconds: between checkpoints.
        report: called with each validation as it is made, and with those before an interruption.
        quiet: without a bar of progress.
    """
    one_thread()
    before = finished(folder, settings)
    if before is not None:
        return before
    torch.manual_seed(seed)
    normalise = make_environment(settings)
    model = make_model(settings, normalise, seed)
    # after the model, which seeds its environments too: so far apart that no two trainings share an episode
    normalise.seed(1_000_000 * (seed + 1))
    judged = validation_episodes() if validation is None else validation
    try:
        return Training(settings, seed, folder, judged, checkpoint_seconds, report, quiet).run(model, normalise)
    finally:
        normalise.close()
