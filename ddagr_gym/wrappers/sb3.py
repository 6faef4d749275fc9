"""The native batch as a Stable-Baselines3 ``VecEnv`` (SB3 refuses ``gymnasium.vector.VectorEnv``)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvObs, VecEnvStepReturn

from ddagr_gym.envs.turn_vector_env import TurnVectorEnv
from ddagr_gym.errors import InputError


class TurnVecEnv(VecEnv):
    """N row turns for SB3: ``TurnVecEnv(64, radius=0.8)``; arguments as :class:`TurnVectorEnv`.

    Infos are empty but for environments that have just ended: ``terminal_observation``, ``TimeLimit.truncated``,
    ``is_success`` and the small info of the ending.

    Args:
        num_envs: N.
        staggered: spread the time limits of the first episodes, so that later ones are at different parts of the turn;
            otherwise every rollout of a learner would hold one part, and it would forget the others.
        arguments: of :class:`TurnVectorEnv`.
    """

    def __init__(self, num_envs: int, staggered: bool = False, **arguments: Any) -> None:
        self.staggered = staggered
        self.env = TurnVectorEnv(num_envs, autoreset_mode="SameStep", **arguments)
        super().__init__(num_envs, self.env.single_observation_space, self.env.single_action_space)
        self._actions = np.zeros((num_envs, 2), dtype=np.float32)

    def reset(self) -> VecEnvObs:
        """Reset all environments; seeds come from :meth:`seed`, options from :meth:`set_options`.

        Raises:
            InputError: options that are not the same for all environments.
        """
        seeds = self._seeds if any(seed is not None for seed in self._seeds) else None
        observations, _ = self.env.reset(seed=seeds, options=self._common_options())
        if self.staggered:
            self.env.spread_time_limits()
        self._reset_seeds()
        self._reset_options()
        self.reset_infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        return observations

    def _common_options(self) -> dict[str, Any]:
        options: dict[str, Any] = self._options[0]
        for other in self._options[1:]:
            # SB3 copies options, but what is one object stays one
            if other.keys() != options.keys() or any(other[name] is not options[name] for name in options):
                raise InputError(
                    f"the options {options!r} and {other!r} of two environments differ: the batch resets all of them "
                    "by one, give a single dictionary."
                )
        return options

    def step_async(self, actions: np.ndarray) -> None:
        """Keep the actions for :meth:`step_wait`."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """One control interval; ended environments return the first observation of their next episode."""
        observations, rewards, terminated, truncated, info = self.env.step(self._actions)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        dones = terminated | truncated
        for n in np.flatnonzero(dones):
            last = {key: value[n].item() for key, value in info["final_info"].items() if _is_scalar(key, value)}
            infos[n] = {
                "terminal_observation": info["final_obs"][n],
                "TimeLimit.truncated": bool(truncated[n] and not terminated[n]),
                "is_success": bool(last["success"]),
                **last,
            }
        return observations, rewards.astype(np.float32), dones, infos

    def close(self) -> None:
        """Stop the threads."""
        self.env.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """The batch's attribute, once for each index."""
        value = getattr(self.env, attr_name)
        return [value for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute of the batch: it is shared by all environments, and ``indices`` must name all."""
        self._check_all(indices, f"{attr_name} is set")
        setattr(self.env, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method of the batch once, ``indices`` must name all; its result is repeated for each."""
        self._check_all(indices, f"{method_name} is called")
        result = getattr(self.env, method_name)(*method_args, **method_kwargs)
        return [result for _ in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: type, indices: VecEnvIndices = None) -> list[bool]:
        """No single environment is wrapped."""
        return [False for _ in self._get_indices(indices)]

    def get_images(self) -> Sequence[np.ndarray | None]:
        """No pictures: the batch does not render."""
        return [None for _ in range(self.num_envs)]

    def _check_all(self, indices: VecEnvIndices, what: str) -> None:
        if set(self._get_indices(indices)) != set(range(self.num_envs)):
            raise InputError(f"indices are {indices!r} and {what} for the whole batch: give None.")

    def _get_indices(self, indices: int | Iterable[int] | None) -> Iterable[int]:
        return super()._get_indices(indices)


def _is_scalar(key: str, value: Any) -> bool:
    return not key.startswith("_") and isinstance(value, np.ndarray) and value.ndim == 1
