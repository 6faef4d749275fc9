"""The policy's view as a wrapper of SB3's vectorised environment."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from stable_baselines3.common.vec_env import VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from ddagr_gym.policies.design import PolicyDesign
from ddagr_gym.policies.view import INPUT_LIMIT, PolicyView
from ddagr_gym.wrappers.sb3 import TurnVecEnv


class PolicyViewVecEnv(VecEnvWrapper):
    """A :class:`TurnVecEnv` with the inputs and actions of a policy design.

    Observations are the design's inputs, actions its two outputs in [-1, 1].

    Args:
        venv: the batch, made with ``**design.environment``.
        design: wiring.
    """

    venv: TurnVecEnv

    def __init__(self, venv: TurnVecEnv, design: PolicyDesign) -> None:
        shape = (len(design.inputs),)
        super().__init__(
            venv,
            observation_space=spaces.Box(-INPUT_LIMIT, INPUT_LIMIT, shape, np.float32),
            action_space=spaces.Box(-1.0, 1.0, (2,), np.float32),
        )
        settings = venv.env.settings
        self.view = PolicyView(design, settings.robot, settings.sensors, venv.num_envs)
        self._seen = np.zeros((venv.num_envs, design.observation_size), dtype=np.float32)

    def reset(self) -> VecEnvObs:
        """Reset all environments and the memory."""
        observations: Any = self.venv.reset()
        self._seen = observations
        self.view.reset()
        return self.view.observe(observations)

    def step_async(self, actions: np.ndarray) -> None:
        """Turn outputs into bank speeds."""
        self.venv.step_async(self.view.act(actions, self._seen))

    def step_wait(self) -> VecEnvStepReturn:
        """Step; an ended environment's terminal observation is viewed with its memory, which is then forgotten."""
        received: Any = self.venv.step_wait()
        observations, rewards, dones, infos = received
        last = observations.copy()
        ended = np.flatnonzero(dones)
        for n in ended:
            last[n] = infos[n]["terminal_observation"]
        inputs = self.view.observe(last)
        if ended.size:
            for n in ended:
                infos[n]["terminal_observation"] = inputs[n].copy()
            self.view.reset(ended)
            inputs[ended] = self.view.observe(observations[ended], ended)
        self._seen = observations
        return inputs, rewards, dones, infos

    def state(self) -> dict[str, Any]:
        """Memory of the view, and what it last saw."""
        return {"memory": self.view.memory(), "seen": self._seen.copy()}

    def restore(self, state: dict[str, Any]) -> None:
        """Back to a :meth:`state`."""
        self.view.restore(state["memory"])
        self._seen = state["seen"].copy()
