"""Row turns driven by a controller, with everything that a figure, a metric or a recording needs."""

from __future__ import annotations

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
    batch = TurnBatch(settings, recorded=list(TRUTH.values()))
    rng, _ = seeding.np_random(seed)
    batch.reset([0], [rng], None if episode is None else {"episode": episode})
    observations = batch.new_observations()
    batch.observe_start([0], observations)
    controller.reset()
    rewards, total = np.zeros(1), 0.0
    readings, records, commands = [], [], []
    for _ in range(EPISODE_STEPS):
        info = single_info(batch_info(batch, "full"))
        action = check_action(controller(observations[0], info), (2,))
        batch.step(action[None], [rng], rewards, observations)
        total += float(rewards[0])
        readings.append(batch.readings[0].copy())
        records.append(batch.record[0].copy())
        commands.append(np.repeat(batch.commands, len(readings[-1]), axis=0))
        if batch.endings[0] != kernel.NO_ENDING:
            break
    driven = batch.episodes[0]
    assert driven is not None
    columns = _columns(driven, np.concatenate(commands), np.concatenate(readings), np.concatenate(records))
    success = bool(batch.tasks[0, kernel.SUCCESS] > 0.0)
    return TurnRun(columns, driven, int(batch.endings[0]), success, total)


def _columns(episode: Episode, commands: Array, readings: Array, records: Array) -> dict[str, Array]:
    columns: dict[str, Array] = {"t": np.arange(1.0, len(commands) + 1.0) * episode.sensors.period}
    columns |= {"command_right": commands[:, 0].copy(), "command_left": commands[:, 1].copy()}
    columns |= {name: readings[:, i].copy() for i, name in enumerate(layout.READINGS)}
    columns |= {name: records[:, 3 + i].copy() for i, name in enumerate(TRUTH)}
    return columns
