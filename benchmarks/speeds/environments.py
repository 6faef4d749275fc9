"""Contestants of this package: one environment through ``gym.make``, and the native batch."""

from __future__ import annotations

import gymnasium
import numpy as np

from benchmarks.speeds.timing import Contestant
from ddagr_gym.control.timing import CONTROL_INTERVAL
from ddagr_gym.parameters import Sensors

ENVIRONMENT = "ddagr_gym:DDAGR-Turn-v0"
STEP_SECONDS = CONTROL_INTERVAL * Sensors().period


def play(env: gymnasium.Env, actions: np.ndarray, steps: int) -> None:
    """Step ``env``, resetting it where an episode ends; each episode plays the next row of ``actions``."""
    sequences = [list(sequence) for sequence in actions]
    env.reset()
    episode, k = 0, 0
    for _ in range(steps):
        _, _, terminated, truncated, _ = env.step(sequences[episode][k])
        k += 1
        if terminated or truncated or k == len(sequences[episode]):
            env.reset()
            episode, k = (episode + 1) % len(sequences), 0


def single(name: str, actions: np.ndarray, steps: int) -> Contestant:
    """One environment through ``gym.make``, resets included; the amount is steps."""
    env = gymnasium.make(ENVIRONMENT)
    env.reset(seed=1)

    def run() -> float:
        play(env, actions, steps)
        return float(steps)

    return Contestant(name, run)


def batch(name: str, actions: np.ndarray, steps: int, count: int, threads: int = 1) -> Contestant:
    """``gym.make_vec`` with ``count`` environments, resets included; the amount is simulated seconds of all."""
    env = gymnasium.make_vec(ENVIRONMENT, num_envs=count, threads=threads)
    env.reset(seed=1)
    sequence = np.arange(count) % len(actions)
    clock = np.zeros(count, dtype=np.int64)

    def run() -> float:
        nonlocal sequence
        for _ in range(steps):
            _, _, terminated, truncated, _ = env.step(actions[sequence, clock])
            clock[:] += 1
            ended = terminated | truncated | (clock == actions.shape[1])
            sequence = (sequence + ended) % len(actions)
            clock[ended] = 0
        return steps * count * STEP_SECONDS

    return Contestant(name, run, threads)


def between_resets(name: str, actions: np.ndarray, steps: int, count: int, threads: int = 1) -> Contestant:
    """``gym.make_vec`` over the first ``steps`` steps of ``count`` episodes, reset before the clock starts.

    Raises:
        RuntimeError: an episode ended within these steps.
    """
    env = gymnasium.make_vec(ENVIRONMENT, num_envs=count, threads=threads)
    sequence = np.arange(count) % len(actions)

    def run() -> float:
        for k in range(steps):
            _, _, terminated, truncated, _ = env.step(actions[sequence, k])
            if (terminated | truncated).any():
                raise RuntimeError(f"an episode ended at step {k}: measure fewer than {steps}.")
        return steps * count * STEP_SECONDS

    return Contestant(name, run, threads, lambda: env.reset(seed=1))
