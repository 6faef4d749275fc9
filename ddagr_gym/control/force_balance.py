"""B4, the strong classical controller: feed-forward by the force balance at the filter's estimate, PI on curvature."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.control.observation import EKF_FEATURES, FEATURE_SCALES, OBSERVATION, TurnObservation, decode
from ddagr_gym.control.pid import PidGains
from ddagr_gym.control.turn_controller import FeedbackController, curvature_error
from ddagr_gym.errors import InputError
from ddagr_gym.parameters import Robot

FeedForward = Callable[[NDArray[np.float64], float, float], tuple[float, float] | None]
"""(logs of a1, a2, b, Rc over their prior medians (4,), speed, curvature) -> bank speeds [rad/s] or None."""


class ForceBalance(FeedbackController):
    """Bank speeds from the estimated soil, corrected by PI on ``kappa* - r_hat/u_hat``; needs the filter's features.

    Theory: control, eq. (5). Where the estimated soil has no solution the kinematic bank speeds with ``track_ratio``
    serve.

    Args:
        robot: nominal robot.
        gains: of the loop, whose output and error are curvatures [1/m].
        feed_forward: steady bank speeds by the estimate.
        track_ratio: effective over geometric track [-].
        lead: heading before the end of the turn at which it straightens [rad].
    """

    def __init__(
        self, robot: Robot, gains: PidGains, feed_forward: FeedForward, track_ratio: float = 1.0, lead: float = 0.0
    ) -> None:
        super().__init__(robot, gains, track_ratio, lead)
        self._feed_forward = feed_forward
        self._features = np.zeros(len(EKF_FEATURES))

    def error(self, seen: TurnObservation, feed_forward: float, info: Any) -> float:
        """Commanded less estimated curvature [1/m]."""
        speed, yaw_rate = float(self._features[0]), float(self._features[1])
        return curvature_error(feed_forward, yaw_rate, speed, seen.target_speed)

    def __call__(self, observation: ArrayLike, info: Any = None) -> NDArray[np.float32]:
        """Action (2,), right and left bank speed over the robot's maximum."""
        values = np.asarray(observation, dtype=float)
        if values.shape != (len(OBSERVATION) + len(EKF_FEATURES),):
            raise InputError(f"observation has shape {values.shape}: this controller needs DDAGR-Turn-EKF-v0.")
        self._features = values[len(OBSERVATION) :] * FEATURE_SCALES
        seen = decode(values)
        curvature = self.curvature(seen, self.phase(seen), info)
        speeds = self._feed_forward(self._features[2:6], seen.target_speed, curvature)
        if speeds is None:
            speeds = self.bank_speeds(seen.target_speed, curvature)
        return np.clip(np.array(speeds) / self.robot.maximum_wheel_speed, -1.0, 1.0).astype(np.float32)
