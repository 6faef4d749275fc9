"""B6, the path tracker: feed-forward by the force balance, feedback of the estimated place and course on the path."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.control.observation import TurnObservation, decode
from ddagr_gym.control.pid import Pid, PidGains
from ddagr_gym.control.row_turn import Phase, RowTurn
from ddagr_gym.control.timing import CONTROL_PERIOD
from ddagr_gym.control.turn_controller import TurnController, commanded_turn
from ddagr_gym.errors import InputError
from ddagr_gym.frames import wrap_angle
from ddagr_gym.parameters import Robot

SteadyArc = Callable[["MotionEstimate", float, float], tuple[float, float] | None]
"""(estimate, speed, curvature) -> right and left bank speeds [rad/s], or None where the soil does not carry the arc."""

_LEAST_SPEED = 0.05
"""Estimated forward speed below which heading counts as course [m/s] (ours): at rest a course means nothing."""

_SPEED_SHARES = tuple(round(1.0 - 0.1 * k, 1) for k in range(6))
"""Of the commanded speed (ours): a bank at its limit steers no more, so that the robot rather drives more slowly."""

_LARGEST_CORRECTION = 2.0
"""Of the curvature, over that of the commanded turn (ours): a tighter turn stops the robot where it has little grip."""


class MotionEstimate(Protocol):
    """Pose and motion by dead reckoning, and the soil."""

    @property
    def x(self) -> float:
        """Position of the body origin [m]."""

    @property
    def y(self) -> float:
        """Position of the body origin [m]."""

    @property
    def yaw(self) -> float:
        """Heading, continuous [rad]."""

    @property
    def v_x(self) -> float:
        """Forward velocity of the body origin [m/s]."""

    @property
    def v_y(self) -> float:
        """Velocity of the body origin to the left [m/s]."""

    @property
    def yaw_rate(self) -> float:
        """[rad/s]."""

    @property
    def soil(self) -> NDArray[np.float64]:
        """Parameters (4,) of the filter's force law."""

    @property
    def gravity(self) -> tuple[float, float]:
        """Its pull along body x and y [m/s^2], 0 on the level."""


class MotionEstimator(Protocol):
    """What tells the tracker where it is, from sensors alone."""

    def reset(self, x: float, y: float, yaw: float) -> None:
        """Start at rest at a pose."""

    def update(self, command: ArrayLike, samples: ArrayLike) -> MotionEstimate:
        """Estimate after the command (2,) [rad/s] has held over the samples (K, 5)."""

    def present(self) -> MotionEstimate:
        """The estimate as it stands."""


class PathTracker(TurnController):
    """Follows the commanded path by the estimated pose; theory: control, eq. (7).

    Needs the raw samples (``info_level="full"``), of which it reads nothing but sensors and its own command.

    Args:
        robot: nominal robot.
        gains: the loop's output is a curvature [1/m], its error the cross-track error [m].
        course_gain: curvature per course error [1/(m rad)].
        estimator: of the pose.
        steady_arc: steady bank speeds by the estimate.
        track_ratio: see :class:`TurnController`; serves where the estimated soil has no solution.
        lead: heading by which the feed-forward runs ahead, for the motors' lag [rad].
        standing: control periods for which the robot stands before it drives, so that the estimator knows gravity.
    """

    def __init__(
        self, robot: Robot, gains: PidGains, course_gain: float, estimator: MotionEstimator, steady_arc: SteadyArc,
        track_ratio: float = 1.0, lead: float = 0.0, standing: int = 0,
    ) -> None:  # fmt: skip
        super().__init__(robot, track_ratio, lead, course_gain)
        self._pid = Pid(gains, CONTROL_PERIOD)
        self._estimator, self._steady_arc = estimator, steady_arc
        self._standing = standing
        self.reset()

    def reset(self) -> None:
        """Forget the integral, the path and the pose."""
        self._pid.reset()
        self._stood = 0
        self._turn: RowTurn | None = None
        self._estimate: MotionEstimate | None = None

    def __call__(self, observation: ArrayLike, info: Any = None) -> NDArray[np.float32]:
        """Action (2,), right and left bank speed over the robot's maximum."""
        if info is None or "samples" not in info:
            raise InputError('this controller needs the raw samples: make the environment with info_level="full".')
        seen = decode(observation)
        if self._turn is None:
            self._turn = commanded_turn(seen)
            self._estimator.reset(-self._turn.run_in, 0.0, 0.0)
            self._estimate = self._estimator.present()
        else:
            self._estimate = self._estimator.update(info["command"], info["samples"])
        if self._stood < self._standing:
            self._stood += 1
            return np.zeros(2, dtype=np.float32)
        curvature = self.curvature(seen, self.phase(seen), info)
        speeds = self._within_limits(self._estimate, seen.target_speed, curvature)
        return np.clip(np.array(speeds) / self.robot.maximum_wheel_speed, -1.0, 1.0).astype(np.float32)

    def _within_limits(self, at: MotionEstimate, speed: float, curvature: float) -> tuple[float, float]:
        """Bank speeds for a curvature at the fastest of some speeds up to ``speed`` that the motors reach."""
        for share in _SPEED_SHARES:
            speeds = self._steady_arc(at, share * speed, curvature) or self.bank_speeds(share * speed, curvature)
            if max(abs(speeds[0]), abs(speeds[1])) <= self.robot.maximum_wheel_speed:
                break
        return speeds

    def curvature(self, seen: TurnObservation, phase: Phase, info: Any) -> float:
        """Curvature of the path a little ahead, corrected by the estimated errors [1/m]."""
        at = self._estimate
        assert self._turn is not None
        assert at is not None
        distance, lateral = self._turn.project(at.x, at.y)
        course = at.yaw + (math.atan2(at.v_y, at.v_x) if at.v_x > _LEAST_SPEED else 0.0)
        error = wrap_angle(float(course - self._turn.heading(distance)))
        feed_forward = float(self._turn.curvature(distance + self.lead * seen.target_radius))
        correction = self._pid.update(-float(lateral)) - self.heading_gain * error
        largest = _LARGEST_CORRECTION / seen.target_radius
        return feed_forward + min(max(correction, -largest), largest)
