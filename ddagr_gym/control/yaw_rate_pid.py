"""B2: PID on the yaw rate. Naive on purpose: it restores the yaw rate, not the speed, so the radius suffers."""

from __future__ import annotations

from typing import Any

from ddagr_gym.control.observation import TurnObservation
from ddagr_gym.control.turn_controller import FeedbackController


class YawRatePid(FeedbackController):
    """Kinematic feed-forward plus PID on the error of the yaw rate [rad/s] against speed over radius."""

    def error(self, seen: TurnObservation, feed_forward: float, info: Any) -> float:
        """Commanded less measured yaw rate [rad/s]."""
        return seen.side * seen.target_speed / seen.target_radius - seen.yaw_rate
