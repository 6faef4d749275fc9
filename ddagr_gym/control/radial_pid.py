"""B3: feed-forward plus PID on the radial error of dead reckoning by encoders and gyro."""

from __future__ import annotations

import math
from typing import Any

from ddagr_gym.control.observation import TurnObservation
from ddagr_gym.control.pid import Pid, PidGains
from ddagr_gym.control.row_turn import Phase
from ddagr_gym.control.timing import CONTROL_PERIOD
from ddagr_gym.control.turn_controller import TurnController
from ddagr_gym.parameters import Robot


class RadialPid(TurnController):
    """Dead reckons the path (mean wheel speed, gyro) and steers back to the commanded circle.

    Args:
        robot: nominal robot.
        gains: the loop's output is a curvature [1/m], its error a distance [m].
        track_ratio: see :class:`TurnController`.
        speed_ratio: travelled over rolled speed in the turn [-].
        lead: see there.
    """

    def __init__(
        self, robot: Robot, gains: PidGains, track_ratio: float = 1.0, speed_ratio: float = 1.0, lead: float = 0.0
    ) -> None:
        super().__init__(robot, track_ratio, lead)
        self._speed_ratio = speed_ratio
        self._pid = Pid(gains, CONTROL_PERIOD)
        self.reset()

    def reset(self) -> None:
        """Back to the start of the turn."""
        self._pid.reset()
        self._x = self._y = 0.0

    def curvature(self, seen: TurnObservation, phase: Phase, info: Any) -> float:
        """Feed-forward, corrected in the turn by the distance from the commanded circle."""
        feed_forward = super().curvature(seen, phase, info)
        if phase != Phase.TURN:
            return feed_forward
        turned = math.pi - seen.heading_to_go
        rolled = 0.5 * (seen.encoder_right + seen.encoder_left) * self.robot.wheels[0].outer_radius
        step = self._speed_ratio * rolled * CONTROL_PERIOD
        # coordinates in which the turn goes to the left, from the start of the turn
        self._x += step * math.cos(turned)
        self._y += step * math.sin(turned)
        error = math.hypot(self._x, self._y - seen.target_radius) - seen.target_radius
        return feed_forward + seen.side * self._pid.update(error)
