"""Row turns driven by a controller, with everything that a figure, a metric or a recording needs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from gymnasium.utils import seeding
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.envs import turn_kernel as kernel
from ddagr_gym.envs.constants import EPISODE_STEPS
from ddagr_gym.envs.settings import Episode, TurnSettings
from ddagr_gym.envs.turn_batch import TurnBatch, check_action
from ddagr_gym.envs.turn_info import batch_info, single_info
from ddagr_gym.physics import layout
from ddagr_gym.simulator import TRUTH

Array = NDArray[np.float64]


class Controller(Protocol):
    """What drives a turn: forgets at ``reset`` and maps an observation to an action."""

    def reset(self) -> None:
        """Forget the last episode."""

    def __call__(self, observation: ArrayLike, info: Any = None) -> NDArray[np.float32]:
        """Action (2,) for an observation; ``info`` is the environment's, for upper bounds only."""


class BatchController(Protocol):
    """What drives N turns side by side by their observations alone."""

    def reset(self) -> None:
        """Forget the last episodes."""

    def __call__(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """Actions (N, 2) for observations (N, entries)."""


@dataclass(frozen=True, eq=False)
class TurnRun:
    """One driven turn.

    Attributes:
        columns: (T,) by name at the sensor rate: time, commands, readings, truth.
        episode: what was driven.
        ending: numbered ending, 0 for time.
        success: whether every wheel fits its furrow at the next row's start line.
        total_reward: sum over the episode.
    """

    columns: dict[str, Array]
    episode: Episode
    ending: int
    success: bool
    total_reward: float


def drive_turn(controller: Controller, settings: TurnSettings, seed: int, episode: Episode | None = None) -> TurnRun:
    """Drive one turn to its end; the same seed gives the same bits as the environment of that seed.

    Args:
        controller: drives.
        settings: of the environment.
        seed: of the episode and the sensor noise.
        episode: repeat this one instead of drawing.
    """
    controller.reset()

    def act(batch: TurnBatch, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        return controller(observations[0], single_info(batch_info(batch, "full")))[None]

    return _drive(act, settings, [seed], [episode])[0]


def drive_turns(
    controller: BatchController, settings: TurnSettings, seeds: Sequence[int], episodes: Sequence[Episode]
) -> list[TurnRun]:
    """Drive N turns side by side, each to its end; each run equals that of :func:`drive_turn` to the bit.

    Args:
        controller: drives all of them.
        settings: of the environment.
        seeds: of the sensor noise, N.
        episodes: what is driven, N.
    """
    controller.reset()
    return _drive(lambda batch, observations: controller(observations), settings, seeds, episodes)


class _Log:
    """What one robot did so far."""

    def __init__(self) -> None:
        self.parts: list[tuple[Array, Array, Array]] = []
        self.total = 0.0
        self.ending, self.success = kernel.NO_ENDING, False

    def add(self, batch: TurnBatch, n: int, reward: float) -> None:
        self.total += reward
        command = np.repeat(batch.commands[n : n + 1], batch.readings.shape[1], axis=0)
        self.parts.append((command, batch.readings[n].copy(), batch.record[n].copy()))
        self.ending = int(batch.endings[n])
        self.success = bool(batch.tasks[n, kernel.SUCCESS] > 0.0)

    def run(self, episode: Episode) -> TurnRun:
        columns = _columns(episode, *(np.concatenate(part) for part in zip(*self.parts, strict=True)))
        return TurnRun(columns, episode, self.ending, self.success, self.total)


def _drive(
    act: Callable[[TurnBatch, NDArray[np.float32]], NDArray[np.float32]],
    settings: TurnSettings,
    seeds: Sequence[int],
    episodes: Sequence[Episode | None],
) -> list[TurnRun]:
    count = len(seeds)
    batch = TurnBatch(settings, count, recorded=list(TRUTH.values()))
    rngs = [seeding.np_random(seed)[0] for seed in seeds]
    for n, episode in enumerate(episodes):
        batch.reset([n], rngs, None if episode is None else {"episode": episode})
    observations = batch.new_observations()
    batch.observe_start(range(count), observations)
    rewards, driving = np.zeros(count), np.ones(count, dtype=np.bool_)
    logs = [_Log() for _ in range(count)]
    for _ in range(EPISODE_STEPS):
        actions = np.where(driving[:, None], act(batch, observations), 0.0)
        active = np.flatnonzero(driving)
        batch.step(check_action(actions, (count, 2)), rngs, rewards, observations, active)
        for row in active.tolist():
            logs[row].add(batch, row, float(rewards[row]))
            driving[row] = logs[row].ending == kernel.NO_ENDING
        if not driving.any():
            break
    return [log.run(episode) for log, episode in zip(logs, batch.episodes, strict=True) if episode is not None]


def _columns(episode: Episode, commands: Array, readings: Array, records: Array) -> dict[str, Array]:
    columns: dict[str, Array] = {"t": np.arange(1.0, len(commands) + 1.0) * episode.sensors.period}
    columns |= {"command_right": commands[:, 0].copy(), "command_left": commands[:, 1].copy()}
    columns |= {name: readings[:, i].copy() for i, name in enumerate(layout.READINGS)}
    columns |= {name: records[:, 3 + i].copy() for i, name in enumerate(TRUTH)}
    return columns
