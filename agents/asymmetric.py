"""A critic that knows more than the actor: the true motion and soil, in training only.

Knowing the truth, the value explains most of the difference between one turn and the next, so that what is left for
the actor to learn from is its own doing (Pinto et al., Asymmetric actor critic, RSS 2018). The actor, which alone is
published, sees the policy's inputs and nothing else.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import MlpExtractor
from stable_baselines3.common.vec_env import VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.envs import turn_kernel as kernel
from ddagr_gym.envs.turn_batch import TurnBatch
from ddagr_gym.physics import layout
from ddagr_gym.wrappers.policy_view import PolicyViewVecEnv

TRUTH = (
    "true_speed",
    "true_side_speed",
    "true_curvature",
    "true_cross_track",
    "true_heading_error",
    "slip_outer",
    "slip_inner",
    "sinkage",
)
"""What the critic sees besides the policy's inputs; dimensionless, turned to the left."""

_LARGEST = 10.0


def true_entries(batch: TurnBatch) -> NDArray[np.float32]:
    """The true state of a batch, (N, len(TRUTH))."""
    rows, tasks = batch.simulator.rows, batch.tasks
    side, radius, speed = tasks[:, kernel.SIGN], tasks[:, kernel.RADIUS], tasks[:, kernel.SPEED]
    forward, rate = rows[:, layout.V_X], side * rows[:, layout.YAW_RATE]
    unit = RowTurn(radius=1.0, side="left", run_in=0.0)
    distance, cross_track = unit.project(rows[:, layout.X] / radius, side * rows[:, layout.Y] / radius)
    slip = rows[:, layout.SLIP_RATIO : layout.SLIP_RATIO + 4]
    right, left = slip[:, (0, 2)].mean(axis=1), slip[:, (1, 3)].mean(axis=1)
    entries = [
        forward / speed,
        side * rows[:, layout.V_Y] / speed,
        radius * rate / np.maximum(np.hypot(forward, rows[:, layout.V_Y]), 0.25 * speed),
        10.0 * cross_track,
        10.0 * (side * rows[:, layout.YAW] - unit.heading(distance)),
        np.where(side > 0.0, right, left),
        np.where(side > 0.0, left, right),
        10.0 * rows[:, layout.SINKAGE : layout.SINKAGE + 4].mean(axis=1),
    ]
    return np.clip(np.stack(entries, axis=1), -_LARGEST, _LARGEST).astype(np.float32)


class WithTruth(VecEnvWrapper):
    """Appends :data:`TRUTH` to what the policy sees; the actor of :class:`AsymmetricPolicy` does not read it."""

    venv: PolicyViewVecEnv

    def __init__(self, venv: PolicyViewVecEnv) -> None:
        shape = (int(np.prod(venv.observation_space.shape or ())) + len(TRUTH),)
        super().__init__(venv, observation_space=spaces.Box(-_LARGEST, _LARGEST, shape, np.float32))
        self._truth = np.zeros((venv.num_envs, len(TRUTH)), dtype=np.float32)

    @property
    def batch(self) -> TurnBatch:
        """The batch that is driven."""
        return self.venv.venv.env.batch

    def reset(self) -> VecEnvObs:
        """Reset."""
        inputs = self.venv.reset()
        self._truth = true_entries(self.batch)
        return np.concatenate([inputs, self._truth], axis=1)

    def step_wait(self) -> VecEnvStepReturn:
        """Step; the batch has already begun the next episode, so a terminal observation has the truth a step before."""
        inputs, rewards, dones, infos = self.venv.step_wait()
        for n in np.flatnonzero(dones):
            infos[n]["terminal_observation"] = np.concatenate([infos[n]["terminal_observation"], self._truth[n]])
        self._truth = true_entries(self.batch)
        return np.concatenate([inputs, self._truth], axis=1), rewards, dones, infos


class _SplitExtractor(MlpExtractor):
    def __init__(self, seen: int, known: int, architecture: Any, activation: Any, device: Any) -> None:
        super().__init__(seen, architecture, activation, device)
        critic = MlpExtractor(known, architecture, activation, device)
        self.value_net = critic.value_net
        self._seen = seen

    def forward_actor(self, features: torch.Tensor) -> torch.Tensor:
        return super().forward_actor(features[:, : self._seen])

    def forward(self, features: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        return self.forward_actor(features), self.forward_critic(features)


class AsymmetricPolicy(ActorCriticPolicy):
    """SB3's policy whose actor reads all but the last ``len(TRUTH)`` entries."""

    def _build_mlp_extractor(self) -> None:
        known = self.features_dim
        self.mlp_extractor = _SplitExtractor(known - len(TRUTH), known, self.net_arch, self.activation_fn, self.device)
