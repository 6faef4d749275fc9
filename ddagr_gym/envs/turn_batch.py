"""N row turns side by side: what the single and the vectorised environment both run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from ddagr_gym.control.observation import OBSERVATION
from ddagr_gym.control.timing import CONTROL_INTERVAL
from ddagr_gym.envs import turn_kernel as kernel
from ddagr_gym.envs.constants import OBSERVATION_LIMIT
from ddagr_gym.envs.ekf_features import EkfFeatureBatch
from ddagr_gym.envs.path_features import PathFeatureBatch
from ddagr_gym.envs.settings import Episode, TurnSettings, check_rate
from ddagr_gym.errors import InputError
from ddagr_gym.physics import layout
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.command_delay import CommandDelay
from ddagr_gym.physics.effects.slope import Slope
from ddagr_gym.sensors.normal_draws import NormalDraws
from ddagr_gym.simulator import Simulator

Array = NDArray[np.float64]

SAMPLE_CHANNELS = layout.READINGS[:5]
"""Columns of the raw sensor block, (CONTROL_INTERVAL, 5)."""

_POSE = np.array([layout.X, layout.Y, layout.YAW], dtype=np.int64)


class TurnBatch:
    """State of N row turns. Results for one environment do not depend on the others.

    Args:
        settings: shared settings.
        count: N.
        threads: see :class:`Simulator`.
        recorded: further simulator row entries to record at the sensor rate, after x, y and yaw.

    Attributes:
        simulator: the physics.
        tasks: (N, turn_kernel.TASK_SIZE).
        episodes: what each environment is driving.
        readings: (N, CONTROL_INTERVAL, 8) of the last interval.
        record: (N, CONTROL_INTERVAL, 3 + len(recorded)) true x, y, yaw and what else is recorded, of the last interval.
        terms: (N, len(TERMS)) unweighted reward terms of the last interval.
    """

    def __init__(self, settings: TurnSettings, count: int = 1, threads: int = 1, recorded: Sequence[int] = ()) -> None:
        self.settings = settings
        self.count = count
        self._sloping = settings.sloping
        drawn: tuple[Effect, ...] = (CommandDelay(0.0), Slope(0.0)) if self._sloping else (CommandDelay(0.0),)
        self.simulator = Simulator(
            count, numerics=settings.numerics, effects=(*drawn, *settings.effects), threads=threads
        )
        self.tasks = np.zeros((count, kernel.TASK_SIZE))
        self.episodes: list[Episode | None] = [None] * count
        self.readings = np.zeros((count, CONTROL_INTERVAL, len(layout.READINGS)))
        self._recorded = np.concatenate([_POSE, np.asarray(recorded, dtype=np.int64)])
        self.record = np.zeros((count, CONTROL_INTERVAL, len(self._recorded)))
        self.terms = np.zeros((count, len(kernel.TERMS)))
        self.commands = np.zeros((count, 2))
        """(N, 2) bank speed commands of the last interval [rad/s]."""
        self._noise = np.zeros((count, CONTROL_INTERVAL, layout.NOISE_CHANNELS))
        self._draws = NormalDraws()
        self._everyone = np.arange(count)
        # of the nominal tyres: a robot does not know how its own are pumped up or worn
        self._outer_radius = np.full(count, settings.robot.outer_radius)
        self._weights = np.array(astuple(settings.reward))
        self.features = feature_batch(settings, count) if settings.ekf_features else None
        entries = len(OBSERVATION) + (0 if self.features is None else self.features.size)
        self.observation_space = spaces.Box(-OBSERVATION_LIMIT, OBSERVATION_LIMIT, (entries,), np.float32)
        self.command_limit = settings.robot.maximum_wheel_speed

    def reset(self, chosen: Sequence[int], rngs: Sequence[np.random.Generator], options: dict[str, Any] | None) -> None:
        """Start an episode in the ``chosen`` environments.

        Args:
            chosen: their indices.
            rngs: generators of all environments.
            options: ``{"episode": Episode}`` to repeat one; otherwise each draws its own.

        Raises:
            InputError: unknown option, or an episode that this batch cannot drive; then nothing has changed.
        """
        fixed = self._episode_option(options)
        episodes = [fixed or self.settings.draw(rngs[n]) for n in chosen]
        self._check(chosen, episodes)
        for n in chosen:
            self.simulator.set_field(n, None)
        for n, episode in zip(chosen, episodes, strict=True):
            self.episodes[n] = episode
            self._start(n, episode)
        indices = np.asarray(chosen, dtype=np.int64)
        state = {
            "x": [-episode.turn.run_in for episode in episodes],
            "y": [episode.lateral_offset for episode in episodes],
            "yaw": [episode.heading_offset for episode in episodes],
        }
        self.simulator.reset(indices, state)
        self.tasks[indices, kernel.LAST_X] = state["x"]
        self.tasks[indices, kernel.LAST_Y] = state["y"]
        self.tasks[indices, kernel.LAST_YAW] = state["yaw"]
        self.tasks[indices, kernel.COURSE] = state["yaw"]
        self.readings[indices] = 0.0
        self.terms[indices] = 0.0
        self.commands[indices] = 0.0
        if self.features is not None:
            self.features.reset(indices)

    @staticmethod
    def _episode_option(options: dict[str, Any] | None) -> Episode | None:
        unknown = set(options or {}) - {"episode", "reset_mask"}
        if unknown:
            raise InputError(
                f"reset option {sorted(unknown)[0]!r} is unknown: the options are 'episode', 'reset_mask'."
            )
        episode = (options or {}).get("episode")
        if episode is not None and not isinstance(episode, Episode):
            raise InputError(f"reset option 'episode' is {episode!r}: give a ddagr_gym.envs.Episode.")
        return episode

    def _check(self, chosen: Sequence[int], episodes: Sequence[Episode]) -> None:
        """Refuse what the batch cannot drive before anything of it is changed."""
        for episode in episodes:
            check_rate(episode.sensors)
            if episode.slope[0] and not self._sloping:
                raise InputError(
                    f"the episode's ground slopes by {episode.slope[0]:g} rad: give a randomisation of slope."
                )
        replaced = set(chosen)
        others = [episode for n, episode in enumerate(self.episodes) if n not in replaced]
        fields = [episode.field for episode in (*others, *episodes) if episode is not None]
        shapes = {field.values.shape for field in fields if field is not None}
        if len(shapes) > 1:
            raise InputError(
                f"soil grids of shapes {sorted(shapes)} in one batch: give all environments episodes of the same "
                "radius."
            )

    def _start(self, n: int, episode: Episode) -> None:
        soils = episode.soils if not isinstance(episode.soils, tuple) else list(episode.soils)
        self.simulator.configure(n, episode.robot, soils, episode.sensors)
        self.simulator.set_field(n, episode.field)
        self.simulator.effect_parameters[n, 0, 0] = episode.command_delay
        if self._sloping:
            self.simulator.effect_parameters[n, 1, :2] = episode.slope
        turn = episode.turn
        task = self.tasks[n]
        task[:] = 0.0
        task[kernel.RADIUS] = turn.radius
        task[kernel.SIGN] = turn.sign
        task[kernel.RUN_IN] = turn.run_in
        task[kernel.RUN_OUT] = turn.run_out
        task[kernel.SPEED] = turn.speed

    def observe_start(self, chosen: Sequence[int], observations: NDArray[np.float32]) -> None:
        """Write the first observation of the ``chosen`` environments into ``observations`` (N, entries)."""
        indices = np.asarray(chosen, dtype=np.int64)
        kernel.observe_start(self.tasks, indices, self._outer_radius, observations)
        if self.features is not None:
            self.features.begin(indices, observations[indices])
            features = np.empty((self.count, self.features.size), dtype=np.float32)
            self.features.write(features)
            observations[indices, len(OBSERVATION) :] = features[indices]

    def new_observations(self) -> NDArray[np.float32]:
        """Zeroed observations (N, entries)."""
        return np.zeros((self.count, *(self.observation_space.shape or ())), dtype=np.float32)

    def step(
        self,
        actions: Array,
        rngs: Sequence[np.random.Generator],
        rewards: Array,
        observations: NDArray[np.float32],
        active: NDArray[np.int64] | None = None,
    ) -> None:
        """One control interval in every environment.

        Args:
            actions: (N, 2) right and left in [-1, 1].
            rngs: generators of the sensor noise, one per environment.
            rewards: (N,), written.
            observations: (N, entries), written.
            active: environments that draw noise; the others wait for a reset and their results mean nothing.
        """
        np.multiply(actions, self.command_limit, out=self.commands)
        drawing = self._draws.prepare(rngs, self._everyone if active is None else active, self._noise)
        self.simulator.advance(
            self.commands[:, None, :], self._noise, self._recorded, self.readings, self.record, drawing
        )
        kernel.judge_rows(
            self.tasks, self.simulator.rows, actions, self.readings, self.record, self._weights, self._outer_radius,
            self.terms, rewards, observations,
        )  # fmt: skip
        if self.features is not None:
            self.features.update(self.commands, self.readings)
            self.features.write(observations[:, len(OBSERVATION) :])

    @property
    def endings(self) -> NDArray[np.int64]:
        """(N,) numbered ending of each environment, 0 while it runs."""
        return np.asarray(self.tasks[:, kernel.ENDING].astype(np.int64))


def feature_batch(settings: TurnSettings, count: int) -> EkfFeatureBatch:
    """What appends to the observation the estimates that the settings name."""
    if settings.path_features:
        return PathFeatureBatch(settings.robot, settings.sensors, count)
    return EkfFeatureBatch(settings.robot, settings.sensors, count, settings.filter)


def check_action(action: Any, shape: tuple[int, ...]) -> Array:
    """Action as float64 inside [-1, 1], or one sentence about what is wrong with it.

    Raises:
        InputError: wrong shape or not finite. Values beyond the box are clipped, as every peer does.
    """
    try:
        values = np.asarray(action, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"action is {action!r}: give {shape} numbers in [-1, 1].") from None
    if values.shape != shape:
        raise InputError(f"action has shape {values.shape}: give {shape}, right and left in [-1, 1].")
    if not np.isfinite(values).all():
        raise InputError(f"action {values.tolist()} is not finite: give numbers in [-1, 1].")
    return np.clip(values, -1.0, 1.0)
