"""Sideslip of N robots from the lateral accelerometer, because gyro and encoders do not measure it (ours).

In a turn on uneven soil the point about which the body turns wanders along it, so that the course differs from the
heading by some degrees that change along the turn. The lateral specific force tells of it,

    f_y = dv_y/dt + r v_x + bias + noise,   v_y = -c r + delta,

with c the mean distance of the instantaneous centre ahead of the body origin. Kalman filter with the states delta
(Ornstein-Uhlenbeck, almost nothing on a straight) and bias (constant, learned on the straight before the turn).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.parameters import Imu

Array = NDArray[np.float64]

CENTRE_AHEAD = 0.037
"""Mean c over simulated turns of 0.8 m on the soils of thesis_a1_range [m]."""

_TIME = 60.0  # of the Ornstein-Uhlenbeck process [s]
_TURNING_DEVIATION = 0.02  # of delta in a turn [m/s]; over the 10 s of a turn it spreads by about a third of that
_STRAIGHT_DEVIATION = 1e-3  # of delta on a straight [m/s] (ours): a twentieth of a turn's
_BIAS_DEVIATION = 0.3  # [m/s^2]: several times what calibration leaves


class SideslipFilter:
    """Sideslip of N robots.

    Args:
        imu: nominal; its noise is taken as known.
        samples: averaged into one reading.
        period: between readings [s].
        count: N.

    Attributes:
        states: (N, 2) delta [m/s], bias [m/s^2].
        covariances: (N, 2, 2).
    """

    def __init__(self, imu: Imu, samples: int, period: float, count: int) -> None:
        self._period = period
        self._variance = (imu.accelerometer_noise**2 + imu.accelerometer_resolution**2 / 12.0) / samples
        self._kept = math.exp(-period / _TIME)
        self.states = np.zeros((count, 2))
        self.covariances = np.zeros((count, 2, 2))
        self.last_rates = np.zeros(count)
        self.reset(np.arange(count))

    def reset(self, chosen: NDArray[np.int64]) -> None:
        """Forget everything about ``chosen`` robots, which are at rest."""
        self.states[chosen] = 0.0
        self.covariances[chosen] = np.diag([_STRAIGHT_DEVIATION**2, _BIAS_DEVIATION**2])
        self.last_rates[chosen] = 0.0

    def update(self, chosen: NDArray[np.int64], lateral: Array, forward: Array, rate: Array, turning: Array) -> Array:
        """Take in one reading of ``chosen`` robots.

        Args:
            chosen: (n,) rows.
            lateral: (n,) specific force to the left, mean over the period [m/s^2].
            forward: (n,) v_x [m/s].
            rate: (n,) yaw rate [rad/s].
            turning: (n,) whether the robot turns.

        Returns:
            v_y (n,) of the body origin [m/s].
        """
        kept, period = self._kept, self._period
        # states delta before, bias, and the noise that leads to delta after: f_y sees both deltas
        spread = np.where(turning, _TURNING_DEVIATION, _STRAIGHT_DEVIATION) ** 2 * (1.0 - kept**2)
        states = np.column_stack([self.states[chosen], np.zeros(len(chosen))])
        covariances = np.zeros((len(chosen), 3, 3))
        covariances[:, :2, :2] = self.covariances[chosen]
        covariances[:, 2, 2] = spread
        sees = np.array([(kept - 1.0) / period, 1.0, 1.0 / period])
        slope = (rate - self.last_rates[chosen]) / period
        innovation = lateral - rate * forward + CENTRE_AHEAD * slope - states @ sees
        column = covariances @ sees
        gain = column / (column @ sees + self._variance)[:, None]
        states += gain * innovation[:, None]
        covariances -= gain[:, :, None] * column[:, None, :]
        moves = np.array([[kept, 0.0, 1.0], [0.0, 1.0, 0.0]])
        self.states[chosen] = states @ moves.T
        self.covariances[chosen] = moves @ covariances @ moves.T
        self.last_rates[chosen] = rate
        return self.states[chosen, 0] - CENTRE_AHEAD * rate
