"""How a null world is commanded and read: hold of the commands, moment of the readings, shape of the noise.

Two simulators of the same robot, and two loggers of the same drive, differ in all of this; none of it is missing
physics.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.noise import ChannelNoise

Array = NDArray[np.float64]

PARTS = 4
"""Parts of a sample in which a null world is simulated, so that readings may fall between samples (ours)."""

_SLOW = 0.98
"""Correlation of successive samples of the slow part of the noise [-] (ours: a time constant of 1 s at 50 Hz)."""

_COUNTER = -0.4
"""Correlation of successive samples below which rounding is that of a differenced counter (whose own is -0.5)."""

_JITTER = 0.4
"""Standard deviation of a speed before it is rounded by itself, in quanta (ours)."""

_MEANS = ("encoder_right", "encoder_left")
_INERTIAL = ("specific_force_x", "specific_force_y", "yaw_rate")


@dataclass(frozen=True)
class Reading:
    """Choices of a simulator and its logger.

    Attributes:
        ramped: whether commands change linearly over a sample instead of at once.
        command_late: parts of a sample by which commands act late, 0 to PARTS - 1.
        inertial_late: the same by which the inertial unit is read late.
        inertial_mean: whether the inertial unit gives means over a sample instead of values at its end.
        encoder_instant: whether encoders give the speed at the end of a sample instead of the mean.
        tails: degrees of freedom of Student's t distribution of the noise, above 2; 0 for normal noise.
        rounded: whether encoders' speeds are rounded one by one instead of as differences of a counter.
        slow: share of the inertial noise's standard deviation that changes slowly.
    """

    ramped: bool = False
    command_late: int = 0
    inertial_late: int = 0
    inertial_mean: bool = False
    encoder_instant: bool = False
    tails: float = 0.0
    rounded: bool = False
    slow: float = 0.0

    def commands(self, commands: Array) -> Array:
        """(PARTS * n, 2) commands of the parts of samples from (n, 2) of samples."""
        parts = np.repeat(commands, PARTS, axis=0)
        if self.ramped:
            samples = np.arange(1, len(parts) + 1) / PARTS
            ends = np.arange(len(commands) + 1)
            before = np.concatenate([commands[:1], commands])
            parts = np.stack([np.interp(samples, ends, before[:, bank]) for bank in range(2)], axis=1)
        return _late(parts, self.command_late)

    def read(self, name: str, parts: Array) -> Array:
        """(n,) readings of a channel without noise from (PARTS * n,) values."""
        if name in _MEANS:
            return parts[PARTS - 1 :: PARTS] if self.encoder_instant else _means(parts)
        if name in _INERTIAL:
            parts = _late(parts, self.inertial_late)
            return _means(parts) if self.inertial_mean else parts[PARTS - 1 :: PARTS]
        return parts[PARTS - 1 :: PARTS]

    def noisy(self, name: str, clean: Array, noise: ChannelNoise, speed: Array, rng: np.random.Generator) -> Array:
        """Readings with coloured noise that grows with speed; a counter's speed is rounded in its angle instead.

        Args:
            name: of the channel.
            clean: (n,) readings without noise.
            noise: of the channel.
            speed: (n,) travel speed [m/s].
            rng: source of randomness.
        """
        if self.rounded and noise.quantum > 0.0:
            return np.round(clean / noise.quantum + _JITTER * rng.standard_normal(len(clean))) * noise.quantum
        if noise.quantum > 0.0 and noise.correlation <= _COUNTER:
            counts = np.floor(np.cumsum(clean) / noise.quantum + rng.random())
            return np.diff(counts, prepend=0.0) * noise.quantum
        share = self.slow if name in _INERTIAL else 0.0
        shape = np.sqrt(1.0 - share**2) * _coloured(self._white(len(clean) + 100, rng), noise.correlation)
        if share > 0.0:
            shape = shape + share * _coloured(rng.standard_normal(len(clean) + 100), _SLOW)
        read = clean + shape * np.hypot(noise.sigma, noise.per_speed * speed) * max(noise.inflation, 1.0)
        return np.asarray(np.round(read / noise.quantum) * noise.quantum) if noise.quantum > 0.0 else read

    def _white(self, count: int, rng: np.random.Generator) -> Array:
        if self.tails <= 2.0:
            return rng.standard_normal(count)
        return np.asarray(rng.standard_t(self.tails, count) * np.sqrt((self.tails - 2.0) / self.tails))


def _late(parts: Array, count: int) -> Array:
    """The same rows ``count`` later, the first one repeated before them."""
    return np.concatenate([np.repeat(parts[:1], count, axis=0), parts])[: len(parts)]


def _means(parts: Array) -> Array:
    return np.asarray(parts.reshape(-1, PARTS).mean(axis=1))


def _coloured(white: Array, correlation: float) -> Array:
    """First-order autoregressive noise of unit variance, without the first hundred samples."""
    from scipy.signal import lfilter

    return np.asarray(lfilter([1.0], [1.0, -correlation], white)[100:] * np.sqrt(1.0 - correlation**2))


def draw_reading(kind: str, rng: np.random.Generator) -> Reading:
    """Reading of a null world of a kind: only "readings", "noise" and "all" differ from the nominal one."""
    options: Mapping[str, object] = {}
    if kind in ("readings", "all"):
        options = {
            "ramped": bool(rng.random() < 0.5),
            "command_late": int(rng.integers(PARTS)),
            "inertial_late": int(rng.integers(PARTS)),
            "inertial_mean": bool(rng.random() < 0.5),
            "encoder_instant": bool(rng.random() < 0.5),
        }
    if kind in ("noise", "all"):
        options = {
            **options,
            "tails": float(rng.uniform(4.0, 8.0)),
            "rounded": bool(rng.random() < 0.5),
            "slow": float(rng.uniform(0.1, 0.3)),
        }
    return Reading(**options)  # type: ignore[arg-type]
