"""Upper bound, never deployable: PI on the true curvature."""

from __future__ import annotations

import math
from typing import Any

from ddagr_gym.control.observation import TurnObservation
from ddagr_gym.control.pid import Pid, PidGains
from ddagr_gym.control.row_turn import Phase
from ddagr_gym.control.timing import CONTROL_PERIOD
from ddagr_gym.control.turn_controller import TurnController
from ddagr_gym.errors import InputError
from ddagr_gym.parameters import Robot


class TrueCurvature(TurnController):
    """Feed-forward plus PI on curvature from the true speed and yaw rate (``info_level="full"``).

    Args:
        robot: nominal robot.
        gains: the loop's output and error are curvatures [1/m].
        track_ratio: see :class:`TurnController`.
        lead: see there.
    """

    def __init__(self, robot: Robot, gains: PidGains, track_ratio: float = 1.0, lead: float = 0.0) -> None:
        super().__init__(robot, track_ratio, lead)
        self._pid = Pid(gains, CONTROL_PERIOD)

    def reset(self) -> None:
        """Forget the integral."""
        self._pid.reset()

    def curvature(self, seen: TurnObservation, phase: Phase, info: Any) -> float:
        """Feed-forward, corrected in the turn by the error of the true curvature."""
        feed_forward = super().curvature(seen, phase, info)
        if phase != Phase.TURN:
            return feed_forward
        if info is None or "true_v_x" not in info:
            raise InputError('this controller needs the true state: make the environment with info_level="full".')
        speed = max(math.hypot(info["true_v_x"], info["true_v_y"]), 0.02)
        return feed_forward + self._pid.update(feed_forward - info["true_yaw_rate"] / speed)
