"""A head start for the actor: it imitates a teacher that sees the truth, on turns that the actor itself drives.

The teacher follows the commanded path by the true pose and takes off what the robot's true curvature differs from the
commanded one. The actor, which does not see the truth, learns the mean of the teacher's outputs given what it sees:
above all, by how much the filter's speed is off. Reinforcement learning goes on from there. (Data aggregation: Ross et
al., AISTATS 2011; a teacher that sees more: Chen et al., Learning by cheating, CoRL 2019.)
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

from agents.asymmetric import TRUTH
from agents.export import actor_of
from agents.settings import ImitationSettings, TrainingSettings
from ddagr_gym.commands.progress import Progress
from ddagr_gym.control.turn_controller import CONTROL_PERIOD
from ddagr_gym.policies.design import PolicyDesign
from ddagr_gym.presets import ddagr

Array = NDArray[np.float64]

_RESPONSE = 0.30
"""Time constant from command to curvature: motors (4.5 1/s), dead time, body [s] (ours)."""
_SMOOTHING = 0.5
"""Time constant of the teacher's idea of what the soil takes off [s] (ours)."""
_LARGEST_MISMATCH = 0.4
_TRACK_RATIO = 1.5  # effective over geometric track of most soils


class Teacher:
    """Outputs (N, 2) that would bring the true robot onto the commanded path.

    Args:
        settings: of the training whose actor is taught.
        count: N.
    """

    def __init__(self, settings: TrainingSettings, count: int) -> None:
        self._design = settings.design
        self._gains = settings.imitation
        self._index = {name: k for k, name in enumerate(settings.design.frame_inputs)}
        robot, radius, speed = ddagr(), settings.task.radius[0], settings.task.speed
        self._pace = speed / radius
        self._straight = speed / (robot.wheels[0].outer_radius * robot.maximum_wheel_speed)
        self._turn = self._straight * _TRACK_RATIO * robot.half_track / radius
        self._radius = radius
        self._lagged = np.zeros((count, 2))
        self._mismatch = np.zeros(count)
        self._base = np.zeros(count)

    def reset(self, chosen: NDArray[np.int64]) -> None:
        """Forget the episodes of ``chosen`` rows."""
        for memory in (self._lagged, self._mismatch, self._base):
            memory[chosen] = 0.0

    def __call__(self, inputs: Array, truth: Array) -> NDArray[np.float32]:
        """Labels (N, 2) for the next outputs.

        Args:
            inputs: (N, inputs) that the actor sees.
            truth: (N, len(TRUTH)).
        """
        known = dict(zip(TRUTH, truth.T, strict=True))
        outputs = np.stack([inputs[:, self._index[f"correction_{k}"]] for k in (0, 1)], axis=1)
        if self._design.action == "absolute":
            labels = self._bank_speeds(known, outputs)
        else:
            labels = self._corrections(known, outputs[:, 0], self._feed_forward(inputs))
        return np.clip(labels, -1.0, 1.0).astype(np.float32)

    def _wanted(self, known: dict[str, Array]) -> Array:
        """Curvature over 1/R* that leads onto the path, ahead of time by the response."""
        to_go = known["true_distance_to_go"] - _RESPONSE * self._pace
        reference = ((to_go > 0.0) & (to_go < math.pi)).astype(float)
        gains = self._gains
        # the truth's errors are scaled by ten
        return reference - 0.1 * (
            gains.cross_track * known["true_cross_track"] + gains.heading * known["true_heading_error"]
        )

    def _feed_forward(self, inputs: Array) -> Array:
        """Curvature over 1/R* that the next outputs will correct, as :class:`PolicyView` commands it."""
        turning, leaving, to_go = (inputs[:, self._index[name]] for name in ("turning", "leaving", "heading_to_go"))
        heading = math.pi * (to_go - (1.0 - leaving))
        return np.where(turning > 0.0, 1.0, self._radius * self._design.heading_gain * heading)

    def _corrections(self, known: dict[str, Array], correction: Array, base: Array) -> Array:
        scale, moving = self._design.curvature_scale, known["true_speed"] > 0.5
        self._lagged[:, 0] += _share(_RESPONSE) * (self._base + scale * correction - self._lagged[:, 0])
        self._base = base
        mismatch = np.where(moving, known["true_curvature"] - self._lagged[:, 0], 0.0)
        mismatch = np.clip(mismatch, -_LARGEST_MISMATCH, _LARGEST_MISMATCH)
        self._mismatch += _share(_SMOOTHING) * (mismatch - self._mismatch)
        wanted = (self._wanted(known) - base - self._mismatch) / scale
        return np.stack([wanted, np.zeros_like(wanted)], axis=1)

    def _bank_speeds(self, known: dict[str, Array], outputs: Array) -> Array:
        self._lagged += _share(_RESPONSE) * (outputs - self._lagged)
        curvature = np.where(known["true_speed"] > 0.5, known["true_curvature"], 0.0)
        turn = self._turn * (self._wanted(known) - curvature)
        speed = self._straight * (1.0 - known["true_speed"])
        return self._lagged + np.stack([speed + turn, speed - turn], axis=1)


def _share(time_constant: float) -> float:
    return 1.0 - math.exp(-CONTROL_PERIOD / time_constant)


def imitate(model: PPO, normalise: VecNormalize, settings: TrainingSettings) -> None:
    """Fit the actor of ``model`` to the teacher; the statistics of ``normalise`` grow along and then hold."""
    gains, design, count = settings.imitation, settings.design, settings.environments
    teacher, rng = Teacher(settings, count), np.random.default_rng(model.seed)
    seen: list[Array] = []
    labels: list[NDArray[np.float32]] = []
    normalise.reset()
    teacher.reset(np.arange(count))
    with Progress(gains.rounds * gains.steps, "imitation") as progress:
        for _ in range(gains.rounds):
            for _ in range(gains.steps):
                _drive_one(model, normalise, design, teacher, rng, gains.exploration, seen, labels)
                progress.advance()
            _fit(model, normalise, gains, np.concatenate(seen), np.concatenate(labels), rng)


def _drive_one(
    model: PPO,
    normalise: VecNormalize,
    design: PolicyDesign,
    teacher: Teacher,
    rng: np.random.Generator,
    exploration: float,
    seen: list[Array],
    labels: list[NDArray[np.float32]],
) -> None:
    original: Any = normalise.get_original_obs()
    inputs, truth = original[:, : len(design.inputs)], original[:, len(design.inputs) :]
    seen.append(inputs)
    labels.append(teacher(inputs.astype(np.float64), truth.astype(np.float64)))
    outputs, _ = model.predict(normalise.normalize_obs(original), deterministic=True)
    noise = exploration * rng.standard_normal(outputs.shape)
    _, _, dones, _ = normalise.step((outputs + noise).astype(np.float32))
    teacher.reset(np.flatnonzero(dones))


def _fit(
    model: PPO,
    normalise: VecNormalize,
    settings: ImitationSettings,
    seen: Array,
    labels: NDArray[np.float32],
    rng: np.random.Generator,
) -> None:
    actor = actor_of(model)
    statistics: Any = normalise.obs_rms
    mean, deviation = (value[: seen.shape[1]] for value in (statistics.mean, np.sqrt(statistics.var + 1e-8)))
    inputs = torch.as_tensor(np.clip((seen - mean) / deviation, -10.0, 10.0), dtype=torch.float32)
    targets = torch.as_tensor(labels)
    optimiser = torch.optim.Adam(actor.parameters(), settings.learning_rate)
    batches = math.ceil(len(inputs) / settings.batch)
    for epoch in range(settings.epochs):
        optimiser.param_groups[0]["lr"] = settings.learning_rate * (1.0 - epoch / settings.epochs)
        for chosen in np.array_split(rng.permutation(len(inputs)), batches):
            loss = torch.nn.functional.smooth_l1_loss(actor(inputs[chosen]), targets[chosen], beta=0.05)
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
