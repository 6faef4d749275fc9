"""B2: PID on the yaw rate. Naive on purpose: it restores the yaw rate, not the speed, so the radius suffers."""

from __future__ import annotations

from typing import Any

from ddagr_gym.control.observation import TurnObservation
from ddagr_gym.control.pid import Pid, PidGains
from ddagr_gym.control.row_turn import Phase
from ddagr_gym.control.timing import CONTROL_PERIOD
from ddagr_gym.control.turn_controller import TurnController
from ddagr_gym.parameters import Robot


class YawRatePid(TurnController):
    """Kinematic feed-forward plus PID on the error of the yaw rate against speed over radius.

    Args:
        robot: nominal robot.
        gains: the loop's output is a curvature [1/m], its error a yaw rate [rad/s].
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
        """Feed-forward, corrected in the turn by the yaw rate's error."""
        feed_forward = super().curvature(seen, phase, info)
        if phase != Phase.TURN:
            return feed_forward
        target = seen.side * seen.target_speed / seen.target_radius
        return feed_forward + self._pid.update(target - seen.yaw_rate)
