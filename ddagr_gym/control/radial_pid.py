"""B3: feed-forward plus PID on the radial error of dead reckoning by encoders and gyro."""

from __future__ import annotations

import math
from typing import Any

from ddagr_gym.control.observation import TurnObservation
from ddagr_gym.control.pid import PidGains
from ddagr_gym.control.timing import CONTROL_PERIOD
from ddagr_gym.control.turn_controller import FeedbackController
from ddagr_gym.parameters import Robot


class RadialPid(FeedbackController):
    """Dead reckons the path (mean wheel speed, gyro) and steers back to the commanded circle.

    Args:
        robot: nominal robot.
        gains: of the loop, whose output is a curvature [1/m] and whose error a distance [m].
        track_ratio: effective over geometric track [-].
        speed_ratio: travelled over rolled speed in the turn [-].
        lead: heading before the end of the turn at which it straightens [rad].
    """

    def __init__(
        self, robot: Robot, gains: PidGains, track_ratio: float = 1.0, speed_ratio: float = 1.0, lead: float = 0.0
    ) -> None:
        super().__init__(robot, gains, track_ratio, lead)
        self._speed_ratio = speed_ratio
        self.reset()

    def reset(self) -> None:
        """Back to the start of the turn."""
        super().reset()
        self._x = self._y = 0.0

    def error(self, seen: TurnObservation, feed_forward: float, info: Any) -> float:
        """Distance outside the commanded circle [m], signed as the curvature that leads back to it."""
        turned = math.pi - seen.heading_to_go
        rolled = 0.5 * (seen.encoder_right + seen.encoder_left) * self.robot.wheels[0].outer_radius
        step = self._speed_ratio * rolled * CONTROL_PERIOD
        # coordinates in which the turn goes to the left, from the start of the turn
        self._x += step * math.cos(turned)
        self._y += step * math.sin(turned)
        return seen.side * (math.hypot(self._x, self._y - seen.target_radius) - seen.target_radius)
