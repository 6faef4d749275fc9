"""The extended Kalman filter's estimates as a wrapper, for a turn that was made without them."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import NDArray

from ddagr_gym.deprecation import renamed
from ddagr_gym.envs.constants import OBSERVATION_LIMIT
from ddagr_gym.envs.turn_batch import feature_batch
from ddagr_gym.errors import InputError

__getattr__ = renamed(__name__, {"EkfFeatures": f"{__name__}:EKFObservation"}, goes="0.4.0")


class EKFObservation(gymnasium.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    """Appends the filter's estimates (speed, yaw rate, slips, a1, a2, b and Rc) to the observation of a row turn.

    The result equals ``gymnasium.make("DDAGR-Turn-EKF-v0")`` to the bit; that id is faster and also makes batches.
    Entries and scaling are in :data:`ddagr_gym.control.observation.EKF_FEATURES`.

    Args:
        env: a :class:`ddagr_gym.envs.TurnEnv` made with ``info_level="full"``.
        filter: "flat" takes the ground for level, "inertial" knows slopes, "learned" corrects it by a network.
        path_features: also append :data:`ddagr_gym.control.observation.PATH_FEATURES`, pose and path errors.

    Raises:
        InputError: an unknown filter, or path features by another than the inertial one; at the first reset of an
            environment without raw samples in its info.
    """

    def __init__(self, env: gymnasium.Env[Any, Any], filter: str = "flat", path_features: bool = False) -> None:
        RecordConstructorArgs.__init__(self, filter=filter, path_features=path_features)
        gymnasium.Wrapper.__init__(self, env)
        settings = self.get_wrapper_attr("settings").with_values(
            ekf_features=True, filter=filter, path_features=path_features
        )
        self._features = feature_batch(settings, 1)
        (entries,) = env.observation_space.shape or (0,)
        self.observation_space = spaces.Box(
            -OBSERVATION_LIMIT, OBSERVATION_LIMIT, (entries + self._features.size,), np.float32
        )

    def _with_features(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        features = np.empty((1, self._features.size), dtype=np.float32)
        self._features.write(features)
        return np.concatenate([observation, features[0]])

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Reset environment and filter."""
        observation, info = self.env.reset(seed=seed, options=options)
        if "samples" not in info:
            raise InputError('EKFObservation needs the raw samples: make the environment with info_level="full".')
        self._features.reset([0])
        self._features.begin([0], observation[None])
        return self._with_features(observation), info

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Step, and filter the interval's samples."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        self._features.update(info["command"][None], info["samples"][None])
        return self._with_features(observation), reward, terminated, truncated, info
