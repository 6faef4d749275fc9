"""What the robot is told to do: three drives of 60 s, the same programmes for every label.

``run_1`` straights and stops, ``run_2`` arcs, ``run_3`` anything: spins, weaves, ramps, reversing.
"""

from __future__ import annotations

import numpy as np

SAMPLE_RATE = 50
"""[Hz]"""
DURATION = 60.0
"""[s]"""
RUNS = ("run_1", "run_2", "run_3")
PAUSE_BETWEEN_RUNS = 70.0
"""From the start of one drive to the start of the next [s]."""
FASTEST = 1.2
"""Largest bank speed command [rad/s]."""

Segment = tuple[float, np.ndarray]


def _hold(seconds: float, right: float, left: float) -> np.ndarray:
    return np.tile([right, left], (max(round(seconds * SAMPLE_RATE), 1), 1))


def _straight(rng: np.random.Generator) -> np.ndarray:
    speed = rng.uniform(0.15, 1.15) * (1.0 if rng.random() < 0.75 else -1.0)
    return _hold(rng.uniform(3.0, 7.0), speed, speed)


def _stop(rng: np.random.Generator) -> np.ndarray:
    return _hold(rng.uniform(1.2, 3.0), 0.0, 0.0)


def _arc(rng: np.random.Generator) -> np.ndarray:
    mean = rng.uniform(0.25, 0.65) * (1.0 if rng.random() < 0.85 else -1.0)
    share = rng.choice([rng.uniform(0.15, 0.6), 1.0, rng.uniform(0.6, 1.0)]) * rng.choice([-1.0, 1.0])
    return _hold(rng.uniform(4.0, 9.0), mean * (1.0 + share), mean * (1.0 - share))


def _spin(rng: np.random.Generator) -> np.ndarray:
    speed = rng.uniform(0.2, 0.6) * rng.choice([-1.0, 1.0])
    return _hold(rng.uniform(2.5, 5.0), speed, -speed)


def _weave(rng: np.random.Generator) -> np.ndarray:
    seconds, period = rng.uniform(8.0, 14.0), rng.uniform(3.0, 7.0)
    mean, depth = rng.uniform(0.4, 0.75), rng.uniform(0.2, 0.45)
    swing = depth * np.sin(2.0 * np.pi * np.arange(int(seconds * SAMPLE_RATE)) / (period * SAMPLE_RATE))
    return np.column_stack([mean + swing, mean - swing])


def _ramp(rng: np.random.Generator) -> np.ndarray:
    ends = rng.uniform(-0.4, 1.1, (2, 2))
    share = np.linspace(0.0, 1.0, int(rng.uniform(5.0, 9.0) * SAMPLE_RATE))[:, None]
    return ends[0] + share * (ends[1] - ends[0])


_MENUS = {
    "run_1": ((_straight, 0.72), (_stop, 0.28)),
    "run_2": ((_arc, 0.8), (_stop, 0.1), (_straight, 0.1)),
    "run_3": ((_arc, 0.25), (_spin, 0.15), (_weave, 0.2), (_ramp, 0.15), (_straight, 0.15), (_stop, 0.1)),
}


def _limit_slew(commands: np.ndarray, slew: float) -> np.ndarray:
    """Bound the change of each command to ``slew`` [rad/s^2], as an operator's stick or a planner does."""
    step = slew / SAMPLE_RATE
    limited = commands.copy()
    for k in range(1, len(limited)):
        limited[k] = limited[k - 1] + np.clip(commands[k] - limited[k - 1], -step, step)
    return limited


def programme(run: str, seed: int) -> np.ndarray:
    """Bank speed commands of one drive.

    Args:
        run: ``run_1``, ``run_2`` or ``run_3``.
        seed: of the manoeuvre set; never depends on the label.

    Returns:
        (3000, 2) commands right, left [rad/s] at 50 Hz, at rest at both ends.
    """
    rng = np.random.default_rng([seed, RUNS.index(run)])
    makers, weights = zip(*_MENUS[run], strict=True)
    samples, pieces = int(DURATION * SAMPLE_RATE), [_hold(rng.uniform(1.5, 2.5), 0.0, 0.0)]
    while sum(map(len, pieces)) < samples:
        pieces.append(makers[rng.choice(len(makers), p=weights)](rng))
    commands = np.clip(np.concatenate(pieces)[:samples], -FASTEST, FASTEST)
    commands[-int(1.5 * SAMPLE_RATE) :] = 0.0
    return np.round(_limit_slew(commands, rng.uniform(1.5, 6.0)), 4)
