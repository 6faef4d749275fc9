"""The row turn as a native batch: one compiled loop over environments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from ddagr_gym.envs.constants import EPISODE_STEPS
from ddagr_gym.envs.options import action_space, check_info_level, check_mode, settings_from
from ddagr_gym.envs.turn_batch import TurnBatch, check_action
from ddagr_gym.envs.turn_info import batch_info
from ddagr_gym.errors import InputError, at_least, unknown_name

Observations = NDArray[np.float32]

UNLIMITED = -1
"""As ``max_episode_steps``: no time limit, as ``gym.make`` has it."""


def _autoreset_mode(mode: str | AutoresetMode) -> AutoresetMode:
    try:
        return AutoresetMode(mode)
    except ValueError:
        raise unknown_name("autoreset_mode", mode, [m.value for m in AutoresetMode]) from None


class TurnVectorEnv(VectorEnv[Observations, NDArray[np.float32], NDArray[Any]]):
    """N row turns, bit-equal to N single :class:`TurnEnv` with seeds ``seed + i``.

    Args:
        num_envs: N.
        max_episode_steps: time limit, -1 for none.
        autoreset_mode: an ``AutoresetMode`` or its value: "NextStep" (default), "SameStep", "Disabled".
        threads: threads that share the batch; results do not depend on it.
        render_mode: None; pictures are made by the single environment.
        info_level: "small" or "full", as arrays with masks ``_<key>``.
        settings: as :class:`TurnEnv`.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012

    def __init__(
        self,
        num_envs: int = 1,
        max_episode_steps: int = EPISODE_STEPS,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        threads: int = 1,
        render_mode: str | None = None,
        info_level: str = "small",
        **settings: Any,
    ) -> None:
        if max_episode_steps != UNLIMITED:
            at_least(max_episode_steps=(max_episode_steps, 1))
        self.num_envs = num_envs
        self.render_mode = check_mode(render_mode, ())
        self.autoreset_mode = _autoreset_mode(autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}
        self.info_level = check_info_level(info_level)
        self.max_episode_steps = max_episode_steps
        self.settings = settings_from(settings)
        self.batch = TurnBatch(self.settings, num_envs, threads)
        self.single_observation_space = self.batch.observation_space
        self.single_action_space = action_space()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._rngs: list[np.random.Generator] = []
        self._seeds: list[int] = []
        self._observations = self.batch.new_observations()
        self._rewards = np.zeros(num_envs)
        self._steps = np.zeros(num_envs, dtype=np.int64)
        self._ended = np.zeros(num_envs, dtype=np.bool_)

    @property  # type: ignore[misc]
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """Generators, one per environment."""
        self._seed(None)
        return tuple(self._rngs)

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """Their seeds."""
        self._seed(None)
        return tuple(self._seeds)

    def _seed(self, seed: int | Sequence[int | None] | None, chosen: NDArray[np.int64] | None = None) -> None:
        """Seed the ``chosen`` environments, all by default; at first each gets a generator, chosen or not."""
        given: list[int | None]
        if seed is None:
            given = [None] * self.num_envs
        elif isinstance(seed, (int, np.integer)):
            given = [int(seed) + i for i in range(self.num_envs)]
        else:
            given = list(seed)
        if len(given) != self.num_envs:
            raise InputError(f"{len(given)} seeds for {self.num_envs} environments: give one each, or one integer.")
        fresh = not self._rngs
        if fresh:
            self._rngs = [np.random.default_rng(0)] * self.num_envs
            self._seeds = [0] * self.num_envs
        for n, value in enumerate(given):
            if fresh or (value is not None and (chosen is None or n in chosen)):
                self._rngs[n], self._seeds[n] = seeding.np_random(value)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Reset all environments, or those in ``options["reset_mask"]`` (N,) bool; the others run on undisturbed.

        Raises:
            InputError: number of seeds, mask or options wrong.
        """
        chosen = self._chosen(options)
        self._seed(seed, chosen)
        self._start(chosen, options)
        info = batch_info(self.batch, self.info_level)
        mask = np.zeros(self.num_envs, dtype=np.bool_)
        mask[chosen] = True
        return self._observations.copy(), _masked(info, mask)

    def spread_time_limits(self) -> None:
        """Let the running episodes end at times spread evenly up to the limit, if there is one, the first ones soon."""
        if self.max_episode_steps != UNLIMITED:
            self._steps += np.arange(self.num_envs)[::-1] * self.max_episode_steps // self.num_envs

    def _chosen(self, options: dict[str, Any] | None) -> NDArray[np.int64]:
        mask = (options or {}).get("reset_mask")
        if mask is None:
            return np.arange(self.num_envs)
        if (
            not isinstance(mask, np.ndarray)
            or mask.shape != (self.num_envs,)
            or mask.dtype != np.bool_
            or not mask.any()
        ):
            raise InputError(f"reset_mask is {mask!r}: give a boolean array ({self.num_envs},) with one True at least.")
        return np.flatnonzero(mask)

    def _start(self, chosen: NDArray[np.int64], options: dict[str, Any] | None = None) -> None:
        self.batch.reset(chosen.tolist(), self._rngs, options)
        self.batch.observe_start(chosen.tolist(), self._observations)
        self._steps[chosen] = 0
        self._ended[chosen] = False

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[Observations, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """One control interval in every environment; see :class:`AutoresetMode` for what follows an ending.

        Raises:
            InputError: actions of the wrong shape or not finite.
            gymnasium.error.ResetNeeded: before the first reset, or after an ending in mode "Disabled".
        """
        if not self._rngs:
            raise gymnasium.error.ResetNeeded("call reset() before step().")
        checked = check_action(actions, (self.num_envs, 2))
        resting = np.flatnonzero(self._ended)
        if resting.size and self.autoreset_mode == AutoresetMode.DISABLED:
            raise gymnasium.error.ResetNeeded(f"environment {resting[0]} has ended: reset it with reset_mask.")
        active = np.flatnonzero(~self._ended)
        self.batch.step(checked, self._rngs, self._rewards, self._observations, active)
        self._steps[active] += 1
        terminated = (self.batch.endings != 0) & ~self._ended
        limited = self.max_episode_steps != UNLIMITED
        truncated = limited & (self._steps >= self.max_episode_steps) & ~self._ended
        rewards = np.where(self._ended, 0.0, self._rewards)
        if resting.size:
            self._start(resting)
        info = self._after_endings(terminated, truncated)
        return self._observations.copy(), rewards, terminated, truncated, info

    def _after_endings(self, terminated: NDArray[np.bool_], truncated: NDArray[np.bool_]) -> dict[str, Any]:
        ended = terminated | truncated
        everyone = np.ones(self.num_envs, dtype=np.bool_)
        info = _masked(batch_info(self.batch, self.info_level), everyone)
        if self.autoreset_mode != AutoresetMode.SAME_STEP:
            self._ended = ended
        elif ended.any():
            final: dict[str, Any] = {"final_obs": np.full(self.num_envs, None, dtype=object)}
            for n in np.flatnonzero(ended):
                final["final_obs"][n] = self._observations[n].copy()
            last = batch_info(self.batch, self.info_level)
            for key in last:
                last[key][~ended] = 0
            final |= {"final_info": _masked(last, ended), "_final_obs": ended.copy(), "_final_info": ended.copy()}
            self._start(np.flatnonzero(ended))
            info = {**final, **_masked(batch_info(self.batch, self.info_level), everyone)}
        return info

    def close_extras(self, **kwargs: Any) -> None:
        """Stop the threads."""
        self.batch.simulator.close()


def _masked(info: dict[str, Any], mask: NDArray[np.bool_]) -> dict[str, Any]:
    """Info with, for each key, the mask ``_key`` of the environments that it speaks of."""
    return {**info, **{f"_{key}": mask.copy() for key in info}}
