"""The filter's features as wrappers, for environments that were made without them."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.utils import RecordConstructorArgs
from gymnasium.vector import AutoresetMode, VectorEnv, VectorWrapper
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from ddagr_gym.envs.ekf_features import FEATURE_COUNT, EkfFeatureBatch
from ddagr_gym.envs.turn_kernel import OBSERVATION_LIMIT
from ddagr_gym.errors import InputError


def _extended(space: Any) -> spaces.Box:
    return spaces.Box(-OBSERVATION_LIMIT, OBSERVATION_LIMIT, (space.shape[0] + FEATURE_COUNT,), np.float32)


def _check_samples(info: dict[str, Any]) -> None:
    if "samples" not in info:
        raise InputError('EkfFeatures needs the raw samples: make the environment with info_level="full".')


class EkfFeatures(gymnasium.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    """Appends the filter's estimates to the observation of a :class:`TurnEnv` made with ``info_level="full"``.

    The result equals ``DDAGR-Turn-EKF-v0`` to the bit; entries and scaling are in
    :data:`ddagr_gym.control.observation.EKF_FEATURES`.

    Args:
        env: environment.
    """

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        RecordConstructorArgs.__init__(self)
        gymnasium.Wrapper.__init__(self, env)
        self.observation_space = _extended(env.observation_space)
        settings: Any = env.unwrapped.settings  # type: ignore[attr-defined]
        self._features = EkfFeatureBatch(settings.robot, settings.sensors, 1)

    def _with_features(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        features = np.empty((1, FEATURE_COUNT), dtype=np.float32)
        self._features.write(features)
        return np.concatenate([observation, features[0]])

    def reset(self, **arguments: Any) -> tuple[Any, dict[str, Any]]:
        """Reset environment and filter."""
        observation, info = self.env.reset(**arguments)
        _check_samples(info)
        self._features.reset([0])
        return self._with_features(observation), info

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Step, and filter the interval's samples."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        self._features.update(info["command"][None], info["samples"][None])
        return self._with_features(observation), reward, terminated, truncated, info


class VectorEkfFeatures(VectorWrapper[Any, Any, Any, Any, Any], RecordConstructorArgs):
    """The same for a native batch in the autoreset modes "NextStep" and "Disabled".

    In mode "SameStep" the samples of the ended episode are gone: make ``DDAGR-Turn-EKF-v0`` instead.

    Args:
        env: batch made with ``info_level="full"``.
    """

    def __init__(self, env: VectorEnv[Any, Any, Any]) -> None:
        RecordConstructorArgs.__init__(self)
        VectorWrapper.__init__(self, env)
        if env.metadata["autoreset_mode"] == AutoresetMode.SAME_STEP:
            raise InputError('VectorEkfFeatures cannot follow mode "SameStep": make "DDAGR-Turn-EKF-v0" instead.')
        self.single_observation_space = _extended(env.single_observation_space)
        self.observation_space = batch_space(self.single_observation_space, env.num_envs)
        settings: Any = env.unwrapped.settings  # type: ignore[attr-defined]
        self._features = EkfFeatureBatch(settings.robot, settings.sensors, env.num_envs)
        self._ended = np.zeros(env.num_envs, dtype=np.bool_)

    def _with_features(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        features = np.empty((self.env.num_envs, FEATURE_COUNT), dtype=np.float32)
        self._features.write(features)
        return np.concatenate([observations, features], axis=1)

    def reset(self, **arguments: Any) -> tuple[Any, dict[str, Any]]:
        """Reset all, or those of ``options["reset_mask"]``."""
        observations, info = self.env.reset(**arguments)
        _check_samples(info)
        chosen = np.flatnonzero(info["_samples"])
        self._features.reset(chosen)
        self._ended[chosen] = False
        return self._with_features(observations), info

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Step, filter the interval's samples, and forget the episodes that have just been reset."""
        observations, rewards, terminated, truncated, info = self.env.step(actions)
        self._features.update(info["command"], info["samples"])
        if self._ended.any():
            self._features.reset(np.flatnonzero(self._ended))
        self._ended = terminated | truncated
        return self._with_features(observations), rewards, terminated, truncated, info
