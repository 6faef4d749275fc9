"""Dead reckoning of N robots by inertial filters: the poses of :class:`~ddagr_gym.estimation.DeadReckoning`."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.estimation.dead_reckoning import led_on, settled
from ddagr_gym.estimation.inertial_filter import InertialBatch, InertialModel
from ddagr_gym.estimation.layout import X

Array = NDArray[np.float64]


class ReckonedBatch(InertialBatch):
    """Inertial filters of N robots, and where their poses lead when each correction of the way settles slowly.

    Args:
        model: what the filters know.
        count: N.
        settling: as of :class:`~ddagr_gym.estimation.DeadReckoning` [s], to whose poses these are equal to the bit.

    Attributes:
        settled: (N, 3) x, y [m] and continuous yaw [rad] since the start, which is at (0, 0, 0).
    """

    REMEMBERED = (*InertialBatch.REMEMBERED, "settled")
    """Arrays that it goes on from."""

    def __init__(self, model: InertialModel, count: int = 1, settling: float = 0.0) -> None:
        self.settled = np.zeros((count, 3))
        self._settling = settling
        super().__init__(model, count)

    def reset(self, chosen: ArrayLike | None = None) -> None:
        """Start from the prior, at rest; ``chosen``: indices of robots, all by default."""
        super().reset(chosen)
        self.settled[slice(None) if chosen is None else np.atleast_1d(np.asarray(chosen))] = 0.0

    def step(self, commands: ArrayLike, readings: ArrayLike) -> Array:
        """As :meth:`InertialBatch.step`, sample by sample, so that the way between them is known."""
        samples = np.asarray(readings, dtype=np.float64)
        if samples.ndim != 3:
            return super().step(commands, samples)  # says what is wrong
        motion = np.empty((self.count, samples.shape[1] + 1, 3))
        motion[:, 0] = self.works[:, X : X + 3]
        standardised = np.empty(samples.shape)
        for k in range(samples.shape[1]):
            standardised[:, k] = super().step(commands, samples[:, k : k + 1])[:, 0]
            motion[:, k + 1] = self.works[:, X : X + 3]
        self._settle(motion)
        return standardised

    def _settle(self, motion: Array) -> None:
        """Lead the poses on by velocities (N, K + 1, 3), then towards the filters'."""
        period, filtered = self.model.flat.sample_period, self.poses
        time = (motion.shape[1] - 1) * period
        for n in range(self.count):
            led = led_on(self.settled[n], motion[n, 1:], motion[n, 0], period)
            self.settled[n] = settled(led, filtered[n], time, self._settling)
