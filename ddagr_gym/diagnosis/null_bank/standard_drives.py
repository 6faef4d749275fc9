"""Drives for a null bank where no recordings are given: three of 60 s, as people drive to learn about a robot.

``straights`` with stops, ``arcs`` of several curvatures, and ``anything``: spins, weaves, ramps, reversing. Speeds,
lengths and order are drawn, so that thresholds hold for drives of this kind and not for one of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.null_bank.drives import Template
from ddagr_gym.identification.noise import ChannelNoise
from ddagr_gym.parameters import Robot

Array = NDArray[np.float64]

RATE = 50.0
"""Samples per second [Hz] (ours: a common rate of field robots' inertial units)."""

DURATION = 60.0
"""Of one drive [s] (ours: as the drives that the project's blind cases have)."""

POSE_PERIOD = 0.2
"""Between poses [s] (a satellite receiver at 5 Hz)."""

POSE_SHARE = 0.8
"""Share of the robots that carry a receiver (ours)."""

_FASTEST = 0.24
"""Fastest tread speed of the drives [m/s]: what field work in rows is done at."""


def standard_template(robot: Robot, rng: np.random.Generator) -> Template:
    """Commands, sampling and noise of three drives.

    Args:
        robot: whose wheels turn the tread speeds into bank speeds.
        rng: of commands, noise levels and starts.
    """
    programmes = (_straights, _arcs, _anything)
    commands = tuple(_fill(programme, rng) / robot.outer_radius for programme in programmes)
    present = np.ones((int(RATE * DURATION), 8), dtype=bool)
    present[:, 5:] = False
    if rng.random() < POSE_SHARE:
        present[:: round(RATE * POSE_PERIOD), 5:] = True
    starts = tuple((*rng.uniform(-1.0, 1.0, 2), rng.uniform(-math.pi, math.pi)) for _ in programmes)
    return Template(commands, 1.0 / RATE, (present,) * 3, _noise(rng), starts)


def _noise(rng: np.random.Generator) -> tuple[ChannelNoise, ...]:
    """Noise of a field robot's sensors: shaking that grows with speed, 20 000 counts a turn, a 12 mm receiver."""
    at_rest = float(rng.uniform(0.025, 0.04))
    shaking = [ChannelNoise(at_rest, float(rng.uniform(0.2, 0.35)), float(rng.uniform(0.4, 0.75)), 0.0) for _ in "xy"]
    gyro = ChannelNoise(3e-3, 0.0, 0.0, 0.0)
    quantum = 2.0 * math.pi / 20_000 * RATE
    encoder = ChannelNoise(quantum / math.sqrt(6.0), 0.0, -0.5, quantum)
    place, heading = ChannelNoise(0.012, 0.0, 0.0, 0.0), ChannelNoise(0.008, 0.0, 0.0, 0.0)
    return (*shaking, gyro, encoder, encoder, place, place, heading)


def _fill(programme: Callable[[np.random.Generator], Array], rng: np.random.Generator) -> Array:
    """Pieces of a programme joined to a drive that starts at rest, (n, 2) tread speeds [m/s]."""
    samples = int(RATE * DURATION)
    pieces = [np.zeros((int(RATE), 2))]
    while sum(len(piece) for piece in pieces) < samples:
        pieces.append(programme(rng))
    return np.concatenate(pieces)[:samples]


def _hold(seconds: float, right: float, left: float) -> Array:
    """Constant tread speeds [m/s] of the right and the left bank for a time."""
    return np.tile([right, left], (round(seconds * RATE), 1))


def _signed(rng: np.random.Generator, low: float, high: float) -> float:
    """A tread speed of either sign between two shares of the fastest [m/s]."""
    return float(rng.uniform(low, high) * rng.choice([-1.0, 1.0]) * _FASTEST)


def _straights(rng: np.random.Generator) -> Array:
    speed = float(rng.uniform(0.15, 1.0)) * _FASTEST * float(rng.choice([1.0, 1.0, -1.0]))
    return np.concatenate([_hold(rng.uniform(3.0, 7.0), speed, speed), _hold(rng.uniform(1.0, 3.0), 0.0, 0.0)])


def _arcs(rng: np.random.Generator) -> Array:
    mean, share = float(rng.uniform(0.25, 0.55)) * _FASTEST, float(rng.uniform(0.15, 1.0) * rng.choice([-1.0, 1.0]))
    return _hold(rng.uniform(4.0, 9.0), mean * (1.0 + share), mean * (1.0 - share))


def _anything(rng: np.random.Generator) -> Array:
    kind = int(rng.integers(5))
    seconds = float(rng.uniform(4.0, 9.0))
    if kind == 0:
        turn = _signed(rng, 0.15, 0.5)
        return _hold(0.6 * seconds, turn, -turn)
    if kind == 1:
        t = np.arange(round(1.5 * seconds * RATE)) / RATE
        swing = rng.uniform(0.15, 0.4) * np.sin(2.0 * math.pi * t / rng.uniform(3.0, 7.0))
        mean = float(rng.uniform(0.35, 0.6))
        return _FASTEST * np.stack([mean + swing, mean - swing], axis=1)
    if kind == 2:
        ends = rng.uniform(-0.35, 0.9, (2, 2))
        return np.asarray(_FASTEST * np.linspace(ends[0], ends[1], round(seconds * RATE)))
    if kind == 3:
        return np.concatenate([_arcs(rng), _hold(1.5, 0.0, 0.0)])
    return _straights(rng)
