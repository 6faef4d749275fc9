"""How well a policy turns on frozen scenarios: all of them side by side in one batch."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium.utils import seeding
from numpy.typing import NDArray

from ddagr_gym.control.circle import turn_window
from ddagr_gym.control.row_turn import RowTurn, wheels_fit_furrow
from ddagr_gym.envs import turn_kernel as kernel
from ddagr_gym.envs.constants import EPISODE_STEPS
from ddagr_gym.envs.settings import Episode, TurnSettings
from ddagr_gym.envs.turn_batch import TurnBatch
from ddagr_gym.evaluation.metrics import TurnStatus, exit_state, turn_radius_error
from ddagr_gym.policies.design import PolicyDesign
from ddagr_gym.policies.view import PolicyView

Array = NDArray[np.float64]
Network = Callable[[NDArray[np.float32]], NDArray[np.floating[Any]]]
"""(N, inputs) -> (N, 2) outputs."""


@dataclass(frozen=True, eq=False)
class ValidationResult:
    """What became of each scenario.

    Attributes:
        errors: (N,) e_R [-], infinite where the turn has no radius or was not made to 150 degrees.
        heading_errors: (N,) arc length over heading change against R* in the same window [-], likewise. It leaves out
            the sideslip, which changes along a turn on uneven soil and which a robot without a receiver cannot see:
            what is left is what control can do something about.
        successes: (N,) whether every wheel fits its furrow at the exit.
        returns: (N,) sum of rewards.
    """

    errors: Array
    heading_errors: Array
    successes: NDArray[np.bool_]
    returns: Array

    def summary(self) -> dict[str, float | None]:
        """Median and 95th percentile of |e_R|, share of successes, mean return; failures count as worst.

        None where so many turns have no radius that the value has none.
        """
        return {
            "radius_error_median": _quantile(self.errors, 0.5),
            "radius_error_p95": _quantile(self.errors, 0.95),
            "heading_radius_error_median": _quantile(self.heading_errors, 0.5),
            "success_rate": float(self.successes.mean()),
            "mean_return": float(self.returns.mean()),
        }


def _quantile(errors: Array, level: float) -> float | None:
    value = float(np.quantile(np.abs(errors), level, method="higher"))
    return value if np.isfinite(value) else None


def drive_all(
    network: Network, design: PolicyDesign, settings: TurnSettings, episodes: Sequence[tuple[int, Episode]]
) -> ValidationResult:
    """Drive every (noise seed, episode); the same turns as ``ddagr evaluate`` drives one by one.

    Args:
        network: the policy without exploration.
        design: its wiring.
        settings: of the environment, with the features that the design needs.
        episodes: what to drive.
    """
    count = len(episodes)
    batch = TurnBatch(settings, count)
    rngs = [seeding.np_random(seed)[0] for seed, _ in episodes]
    for n, (_, episode) in enumerate(episodes):
        batch.reset([n], rngs, {"episode": episode})
    observations = batch.new_observations()
    batch.observe_start(range(count), observations)
    view = PolicyView(design, settings.robot, settings.sensors, count)
    rewards, returns, driving = np.zeros(count), np.zeros(count), np.ones(count, dtype=np.bool_)
    tracks: list[list[Array]] = [[] for _ in range(count)]
    for _ in range(EPISODE_STEPS):
        actions = view.act(network(view.observe(observations)), observations)
        active = np.flatnonzero(driving)
        batch.step(actions.astype(np.float64), rngs, rewards, observations, active)
        for n in active:
            tracks[n].append(batch.record[n, :, :3].copy())
        returns[active] += rewards[active]
        driving &= batch.endings == kernel.NO_ENDING
        if not driving.any():
            break
    judged = [_judge(np.concatenate(track), episode) for track, (_, episode) in zip(tracks, episodes, strict=True)]
    errors, heading_errors, successes = (np.array(values) for values in zip(*judged, strict=True))
    return ValidationResult(errors, heading_errors, successes.astype(np.bool_), returns)


def _judge(track: Array, episode: Episode) -> tuple[float, float, bool]:
    """e_R, the heading's radius error and success of a track (T, 3) of true x, y, yaw at the sensor rate."""
    turn, half_wheelbase = episode.turn, episode.robot.half_wheelbase
    t = np.arange(1.0, len(track) + 1.0) * episode.sensors.period
    x, y, yaw = track.T
    leave = exit_state(t, x, y, yaw, turn, half_wheelbase)
    end = len(t) if leave is None else int(np.searchsorted(t, leave.time)) + 1
    radius = turn_radius_error(x[:end], y[:end], yaw[:end], turn.radius, turn.side)
    fits = leave is not None and wheels_fit_furrow(leave.lateral_error, leave.heading_error, half_wheelbase)
    if radius.error is None or radius.status is not TurnStatus.COMPLETE:
        return np.inf, np.inf, fits
    return radius.error, _heading_radius(x[:end], y[:end], yaw[:end], turn) / turn.radius - 1.0, fits


def _heading_radius(x: Array, y: Array, yaw: Array, turn: RowTurn) -> float:
    """Arc length over heading change between 30 and 150 degrees [m]."""
    window, _ = turn_window(yaw, turn.side)
    assert window is not None
    length = float(np.hypot(np.diff(x[window]), np.diff(y[window])).sum())
    return length / (turn.sign * float(yaw[window][-1] - yaw[window][0]))
