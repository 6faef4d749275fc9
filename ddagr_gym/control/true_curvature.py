"""Upper bound, never deployable: PI on the true curvature."""

from __future__ import annotations

import math
from typing import Any

from ddagr_gym.control.observation import TurnObservation
from ddagr_gym.control.turn_controller import FeedbackController
from ddagr_gym.errors import InputError


class TrueCurvature(FeedbackController):
    """Feed-forward plus PI on curvature [1/m] from the true speed and yaw rate (``info_level="full"``)."""

    def error(self, seen: TurnObservation, feed_forward: float, info: Any) -> float:
        """Commanded less true curvature [1/m]."""
        if info is None or "true_v_x" not in info:
            raise InputError('this controller needs the true state: make the environment with info_level="full".')
        speed = max(math.hypot(info["true_v_x"], info["true_v_y"]), 0.02)
        return float(feed_forward - info["true_yaw_rate"] / speed)
