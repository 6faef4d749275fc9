"""What the controllers of a row turn share: parts of the turn, feed-forward speeds, bank speeds as an action."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.control.observation import TurnObservation, decode
from ddagr_gym.control.pid import Pid, PidGains
from ddagr_gym.control.row_turn import SIDES, Phase, RowTurn
from ddagr_gym.control.timing import CONTROL_PERIOD
from ddagr_gym.parameters import Robot

_LEAST_SPEED_SHARE = 0.25
"""Of the commanded speed, below which a curvature means nothing."""


def commanded_turn(seen: TurnObservation) -> RowTurn:
    """The manoeuvre that an episode's first observation commands; the run-out is not observed."""
    side = next(name for name, sign in SIDES.items() if sign == (1 if seen.side > 0.0 else -1))
    return RowTurn(radius=seen.target_radius, side=side, run_in=seen.run_in_to_go, speed=seen.target_speed)


def curvature_error(commanded: float, yaw_rate: float, speed: float, target_speed: float) -> float:
    """Commanded less driven curvature [1/m].

    Args:
        commanded: curvature [1/m].
        yaw_rate: driven [rad/s].
        speed: driven [m/s]; at least a share of the commanded one counts.
        target_speed: commanded [m/s].
    """
    return float(commanded - yaw_rate / max(speed, _LEAST_SPEED_SHARE * target_speed))


class TurnController:
    """Base of the closed-loop controllers; a subclass turns an observation into a curvature.

    The speed is the reference speed; curvature becomes bank speeds by the kinematics without slip times
    ``track_ratio``, the effective over the geometric track (theory: control, eq. (2)).

    Args:
        robot: nominal robot.
        track_ratio: effective over geometric track [-]; 1 is rolling without slip.
        lead: heading before the end of the turn at which it straightens [rad].
        heading_gain: curvature per heading error on the run-out [1/(m rad)].
    """

    def __init__(self, robot: Robot, track_ratio: float = 1.0, lead: float = 0.0, heading_gain: float = 1.0) -> None:
        self.robot = robot
        self.track_ratio = track_ratio
        self.lead = lead
        self.heading_gain = heading_gain

    def reset(self) -> None:
        """Forget the last episode."""

    def phase(self, seen: TurnObservation) -> Phase:
        """Part of the manoeuvre, from the odometer and the integrated gyro."""
        if seen.run_in_to_go > 0.0:
            return Phase.RUN_IN
        return Phase.TURN if seen.heading_to_go > self.lead else Phase.RUN_OUT

    def curvature(self, seen: TurnObservation, phase: Phase, info: Any) -> float:
        """Commanded curvature [1/m], counter-clockwise positive; feed-forward and, on straights, heading hold."""
        if phase == Phase.TURN:
            return seen.side / seen.target_radius
        heading_error = seen.side * (seen.heading_to_go - (math.pi if phase == Phase.RUN_IN else 0.0))
        return self.heading_gain * heading_error

    def bank_speeds(self, speed: float, curvature: float) -> tuple[float, float]:
        """Right and left bank speeds [rad/s] for a body speed [m/s] and a curvature [1/m]."""
        radius = self.robot.wheels[0].outer_radius
        difference = self.track_ratio * self.robot.half_track * curvature
        return speed * (1.0 + difference) / radius, speed * (1.0 - difference) / radius

    def __call__(self, observation: ArrayLike, info: Any = None) -> NDArray[np.float32]:
        """Action (2,), right and left bank speed over the robot's maximum."""
        seen = decode(observation)
        curvature = self.curvature(seen, self.phase(seen), info)
        speeds = np.array(self.bank_speeds(seen.target_speed, curvature)) / self.robot.maximum_wheel_speed
        return np.clip(speeds, -1.0, 1.0).astype(np.float32)


class FeedbackController(TurnController, ABC):
    """Feed-forward plus one control loop that acts in the turn; a subclass names the error that the loop removes.

    Args:
        robot: nominal robot.
        gains: of the loop, whose output corrects the curvature [1/m].
        track_ratio: effective over geometric track [-]; 1 is rolling without slip.
        lead: heading before the end of the turn at which it straightens [rad].
    """

    def __init__(self, robot: Robot, gains: PidGains, track_ratio: float = 1.0, lead: float = 0.0) -> None:
        super().__init__(robot, track_ratio, lead)
        self._pid = Pid(gains, CONTROL_PERIOD)

    def reset(self) -> None:
        """Forget the integral."""
        self._pid.reset()

    def curvature(self, seen: TurnObservation, phase: Phase, info: Any) -> float:
        """Feed-forward [1/m], corrected in the turn by the loop."""
        feed_forward = super().curvature(seen, phase, info)
        if phase != Phase.TURN:
            return feed_forward
        return feed_forward + self._pid.update(self.error(seen, feed_forward, info))

    @abstractmethod
    def error(self, seen: TurnObservation, feed_forward: float, info: Any) -> float:
        """Error that the loop removes, positive where more curvature is needed.

        Args:
            seen: the observation.
            feed_forward: commanded curvature [1/m].
            info: the environment's; only controllers that see the truth read it.
        """
