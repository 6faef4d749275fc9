"""B4, the strong classical controller: feed-forward by the force balance at the filter's estimate, PI on curvature."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.control.observation import EKF_FEATURES, FEATURE_SCALES, OBSERVATION, TurnObservation, decode
from ddagr_gym.control.pid import Pid, PidGains
from ddagr_gym.control.row_turn import Phase
from ddagr_gym.control.timing import CONTROL_PERIOD
from ddagr_gym.control.turn_controller import TurnController
from ddagr_gym.errors import InputError
from ddagr_gym.parameters import Robot

FeedForward = Callable[[NDArray[np.float64], float, float], tuple[float, float] | None]
"""(logs of a1, a2, b, Rc over their prior medians (4,), speed, curvature) -> bank speeds [rad/s] or None."""


class ForceBalance(TurnController):
    """Bank speeds from the estimated soil, corrected by PI on ``u_hat/R* - r_hat``; needs the filter's features.

    Where the estimated soil has no solution the kinematic bank speeds with ``track_ratio`` serve.

    Args:
        robot: nominal robot.
        gains: the loop's output and error are curvatures [1/m].
        feed_forward: steady bank speeds by the estimate.
        track_ratio: see :class:`TurnController`.
        lead: see there.
    """

    def __init__(
        self, robot: Robot, gains: PidGains, feed_forward: FeedForward, track_ratio: float = 1.0, lead: float = 0.0
    ) -> None:
        super().__init__(robot, track_ratio, lead)
        self._feed_forward = feed_forward
        self._pid = Pid(gains, CONTROL_PERIOD)
        self._features = np.zeros(len(EKF_FEATURES))

    def reset(self) -> None:
        """Forget the integral."""
        self._pid.reset()

    def curvature(self, seen: TurnObservation, phase: Phase, info: Any) -> float:
        """Commanded curvature, corrected in the turn by the estimated one."""
        commanded = super().curvature(seen, phase, info)
        if phase != Phase.TURN:
            return commanded
        speed = max(float(self._features[0]), 0.25 * seen.target_speed)
        return commanded + self._pid.update(commanded - float(self._features[1]) / speed)

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
