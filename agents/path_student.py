"""A student of the path tracker that sees the true pose: what the estimated one asks for less of, by what can be seen.

The teacher is the same tracker on the true motion. In batches that the student drives itself (Ross, Gordon and Bagnell,
DAgger, AISTATS 2011), the network learns by least squares by how much the teacher's curvature differs from that of the
estimated pose. So it learns to correct the pose without the noise of a return, and its output is what can be expected
of the error.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from agents.run import one_thread
from agents.settings import TrainingSettings
from ddagr_gym.estimation import Reckoned
from ddagr_gym.physics import layout
from ddagr_gym.policies.archive import Policy
from ddagr_gym.policies.tracking import TrackedPaths
from ddagr_gym.version import __version__
from ddagr_gym.wrappers.policy_view import PolicyViewVecEnv
from ddagr_gym.wrappers.sb3 import TurnVecEnv

Array = NDArray[np.float64]

_POSE = (layout.X, layout.Y, layout.YAW, layout.V_X, layout.V_Y, layout.YAW_RATE)
_NO_SOIL = np.ones(4)  # no curvature depends on it
_LARGEST_LABEL = 3.0  # in units of the output (ours): a slip of the estimate at the start would outweigh all else
_STATISTICS = 3  # rounds after which the inputs' mean and deviation stay as they are
_LEAST_DEVIATION = 1e-4


@dataclass(frozen=True)
class StudentSettings:
    """How a student is taught.

    Attributes:
        rounds: of driving and learning.
        steps: control steps of every environment in a round.
        gradient_steps: in a round, on all that has been seen.
        batch: samples of each.
        learning_rate: in the first round; falls linearly to a twentieth.
        weight_decay: of the weights.
        units: of each of two hidden layers.
    """

    rounds: int = 15
    steps: int = 250
    gradient_steps: int = 500
    batch: int = 512
    learning_rate: float = 1e-3
    weight_decay: float = 1e-2
    units: int = 64


class PathStudent:
    """A network that is taught on the turns of a training's settings.

    Args:
        settings: of the turns and of the design, whose features are "path".
        seed: of turns and network.
        how: it is taught.

    Attributes:
        explained: after each round, share of the variance of that round's new labels that the network of before it
            explained [-].
    """

    def __init__(self, settings: TrainingSettings, seed: int, how: StudentSettings = StudentSettings()) -> None:
        one_thread()
        torch.manual_seed(seed)
        self.settings, self.seed, self.how = settings, seed, how
        design = settings.design
        self._turns = TurnVecEnv(settings.environments, staggered=True, **settings.task.environment(design))
        self._view = PolicyViewVecEnv(self._turns, design)
        self._view.seed(1_000_000 * (seed + 1))
        own = self._turns.env.settings
        assert design.tracker is not None
        self._teacher = TrackedPaths(design.tracker, own.robot, own.sensors, settings.environments)
        count, units = len(design.inputs), how.units
        self._network = torch.nn.Sequential(
            torch.nn.Linear(count, units), torch.nn.Tanh(), torch.nn.Linear(units, units), torch.nn.Tanh(),
            torch.nn.Linear(units, 1),
        )  # fmt: skip
        for parameter in self._network[-1].parameters():
            torch.nn.init.zeros_(parameter)
        self._mean, self._deviation = np.zeros(count), np.ones(count)
        self._inputs: list[NDArray[np.float32]] = []
        self._labels: list[Array] = []
        self.explained: list[float] = []

    def policy(self) -> Policy:
        """What it has learnt, as a policy that corrects the curvature alone."""
        layers = [layer for layer in self._network if isinstance(layer, torch.nn.Linear)]
        weights = [layer.weight.detach().numpy().copy() for layer in layers]
        biases = [layer.bias.detach().numpy().copy() for layer in layers]
        weights[-1], biases[-1] = (np.concatenate([last, np.zeros_like(last)]) for last in (weights[-1], biases[-1]))
        steps = self.how.steps * self.settings.environments * len(self._labels)
        record = {"algorithm": "student", "seed": self.seed, "steps": steps, "digest": self.settings.digest(),
                  "version": __version__}  # fmt: skip
        return Policy(
            self.settings.design, tuple(weights), tuple(biases), self._mean.copy(), self._deviation.copy(),
            training=record,
        )  # fmt: skip

    def teach(self) -> Policy:
        """All rounds."""
        inputs: Any = self._view.reset()
        fresh = np.ones(self.settings.environments, dtype=np.bool_)
        optimiser = torch.optim.AdamW(self._network.parameters(), weight_decay=self.how.weight_decay)
        for number in range(self.how.rounds):
            inputs, fresh = self._drive(inputs, fresh)
            self._learn(optimiser, number)
        self._view.close()
        return self.policy()

    def _drive(self, inputs: Any, fresh: NDArray[np.bool_]) -> tuple[Any, NDArray[np.bool_]]:
        """A round of driving; the inputs after it, and who has begun a turn."""
        policy, design = self.policy(), self.settings.design
        paths = self._view.view.paths
        seen_inputs, labels = [], []
        for _ in range(self.how.steps):
            whole = self._view.view.si(self._view._seen)
            self._ask(whole, np.flatnonzero(fresh))
            driving = ~paths.standing
            unit = whole[:, 7] * whole[:, 8] / design.curvature_scale  # mirrored, over 1/R*
            seen_inputs.append(inputs[driving])
            labels.append((unit * (self._teacher.curvatures - paths.curvatures))[driving])
            inputs, _, fresh, _ = self._view.step(policy(inputs))
        self._inputs.append(np.concatenate(seen_inputs))
        self._labels.append(np.clip(np.concatenate(labels), -_LARGEST_LABEL, _LARGEST_LABEL))
        self.explained.append(_explained(policy(self._inputs[-1])[:, 0], self._labels[-1]))
        return inputs, fresh

    def _ask(self, whole: Array, begun: NDArray[np.int64]) -> None:
        """Let the teacher see observations (N, entries) in SI units, and the truth."""
        self._teacher.start(begun, whole[begun])
        truth = self._turns.env.batch.simulator.rows[:, _POSE].tolist()
        motions = [Reckoned(*row, _NO_SOIL) for row in truth]
        self._teacher.follow(np.arange(len(whole)), whole, motions)

    def _learn(self, optimiser: torch.optim.Optimizer, number: int) -> None:
        inputs, labels = np.concatenate(self._inputs), np.concatenate(self._labels)
        if number < _STATISTICS:
            self._mean, self._deviation = inputs.mean(0, dtype=float), inputs.std(0, dtype=float) + _LEAST_DEVIATION
        normal = np.clip((inputs - self._mean) / self._deviation, -Policy.clip, Policy.clip)
        seen, wanted = torch.as_tensor(normal, dtype=torch.float32), torch.as_tensor(labels, dtype=torch.float32)
        for group in optimiser.param_groups:
            group["lr"] = self.how.learning_rate * max(1.0 - number / self.how.rounds, 0.05)
        for _ in range(self.how.gradient_steps):
            chosen = torch.randint(len(seen), (self.how.batch,))
            loss = torch.mean((self._network(seen[chosen])[:, 0] - wanted[chosen]) ** 2)
            optimiser.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            optimiser.step()


def _explained(found: NDArray[np.floating[Any]], labels: Array) -> float:
    """Share of the labels' variance that an estimate explains [-]; below 0 where it is worse than their mean."""
    return 1.0 - float(np.mean((labels - found) ** 2) / np.var(labels))
