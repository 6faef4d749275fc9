"""B6, the path tracker: feed-forward by the force balance, feedback of the estimated place and course on the path."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

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


def carried(at: MotionEstimate, time: float) -> tuple[float, float, float]:
    """Pose x [m], y [m], yaw [rad] after a time [s] of the same motion: a command acts on that and not on the present.

    Without it a command that comes 0.1 s late makes the loop swing.
    """
    middle = at.yaw + 0.5 * time * at.yaw_rate
    cosine, sine = math.cos(middle), math.sin(middle)
    x = at.x + time * (cosine * at.v_x - sine * at.v_y)
    y = at.y + time * (sine * at.v_x + cosine * at.v_y)
    return x, y, at.yaw + time * at.yaw_rate


def aligning_path(to_go: float, length: float) -> tuple[float, float]:
    """How far aside of the path a robot that slips sideways should be, per side slip, and the derivative (ours).

    On a slope the nose points uphill while the robot goes straight, and the front wheels would miss the furrow. So it
    comes up to the row a little uphill, and the nose turns into the row while the robot slips down to it.

    Args:
        to_go: distance to the next row's start line [m], negative behind it.
        length: scale of the manoeuvre [m]; 0 for none.

    Returns:
        ``d exp(-(d/length)^2)`` [m/rad], 0 behind the line, and its derivative by d [1/rad]: 1 at the line, where the
        wanted course is off the row by the whole side slip and the nose is not.
    """
    if length == 0.0:
        return 0.0, 0.0
    squared = (to_go / length) ** 2
    fading = math.exp(-squared)
    return max(to_go, 0.0) * fading, (1.0 - 2.0 * squared) * fading


def _side_slip(at: MotionEstimate) -> float:
    """Angle from the nose to the direction of motion [rad], counter-clockwise positive."""
    if at.v_x <= _LEAST_SPEED:
        return 0.0
    return math.atan2(at.v_y, at.v_x)


class PathErrors(NamedTuple):
    """Where a motion leads, against the commanded path.

    Attributes:
        distance: along the path [m].
        lateral: to the left of the path [m].
        to_go: along the path to the next row's start line [m], negative behind it.
        yaw: heading [rad].
        direction: of the path there [rad].
        side_slip: angle from the nose to the direction of motion [rad], counter-clockwise positive.
    """

    distance: float
    lateral: float
    to_go: float
    yaw: float
    direction: float
    side_slip: float

    def course_error(self, side_slip: float) -> float:
        """Error of the course against the path (-pi, pi] [rad], where the course is that much off the nose [rad]."""
        return wrap_angle(self.yaw + side_slip - self.direction)


def path_errors(turn: RowTurn, at: MotionEstimate, ahead: float = 0.0) -> PathErrors:
    """Errors against the commanded path of a motion that goes on for a time ``ahead`` [s]."""
    x, y, yaw = carried(at, ahead)
    distance, lateral = turn.project(x, y)
    to_go = turn.run_in + turn.turn_length - float(distance)
    direction = float(turn.heading(distance))
    return PathErrors(float(distance), float(lateral), to_go, yaw, direction, _side_slip(at))


class PathFollower(TurnController):
    """Steers by an estimated motion along the commanded path; theory: control, eq. (7).

    :meth:`begin` an episode, then each control period ask for the :meth:`wanted` curvature and for the :meth:`action`
    that drives it.

    Args:
        robot: nominal robot.
        gains: the loop's output is a curvature [1/m], its error the cross-track error [m].
        course_gain: curvature per course error [1/(m rad)].
        steady_arc: steady bank speeds by the estimate.
        track_ratio: see :class:`TurnController`; serves where the estimated soil has no solution.
        lead: heading by which the feed-forward runs ahead, for the motors' lag [rad].
        standing: control periods for which the robot stands before it drives, so that the estimator knows gravity.
        ahead: time by which the errors run ahead of the estimate, for the lag of commands and motors [s].
        side_slip_share: of the angle of side slip in the course, 0 for the heading and 1 for the direction of motion.
        aligning: distance before the next row over which the nose turns into it [m], 0 for not at all; see
            :func:`aligning_path`.
        largest_side_slip: that counts [rad]: an estimate beyond is more likely wrong than true.
    """

    def __init__(
        self, robot: Robot, gains: PidGains, course_gain: float, steady_arc: SteadyArc, track_ratio: float = 1.0,
        lead: float = 0.0, standing: int = 0, ahead: float = 0.0, side_slip_share: float = 1.0, aligning: float = 0.0,
        largest_side_slip: float = math.pi,
    ) -> None:  # fmt: skip
        super().__init__(robot, track_ratio, lead, course_gain)
        self._pid = Pid(gains, CONTROL_PERIOD)
        self._steady_arc = steady_arc
        self._standing, self._ahead = standing, ahead
        self._side_slip_share, self._aligning = side_slip_share, aligning
        self._largest_side_slip = largest_side_slip
        self.reset()

    def reset(self) -> None:
        """Forget the integral, the path and the pose."""
        self._pid.reset()
        self._stood = 0
        self._turn: RowTurn | None = None
        self._estimate: MotionEstimate | None = None

    def memory(self) -> tuple[float, float, float]:
        """What it remembers besides the turn, see :meth:`restore`."""
        return (float(self._stood), *self._pid.memory())

    def restore(self, turn: RowTurn, memory: tuple[float, float, float]) -> None:
        """On a turn, back to what :meth:`memory` gave."""
        self.reset()
        self._turn, self._stood = turn, int(memory[0])
        self._pid.restore(memory[1], memory[2])

    def begin(self, seen: TurnObservation) -> RowTurn:
        """Start an episode at its first observation; the turn that this commands."""
        self.reset()
        self._turn = commanded_turn(seen)
        return self._turn

    def wanted(self, seen: TurnObservation, at: MotionEstimate) -> float | None:
        """Curvature to drive now [1/m], or None while it stands."""
        self._estimate = at
        if self._stood < self._standing:
            self._stood += 1
            return None
        return self.curvature(seen, self.phase(seen), None)

    def action(self, at: MotionEstimate, speed: float, curvature: float) -> NDArray[np.float32]:
        """Action (2,) for a speed [m/s] and a curvature [1/m], right and left bank speed over the robot's maximum."""
        speeds = self._within_limits(at, speed, curvature)
        return np.clip(np.array(speeds) / self.robot.maximum_wheel_speed, -1.0, 1.0).astype(np.float32)

    def _within_limits(self, at: MotionEstimate, speed: float, curvature: float) -> tuple[float, float]:
        """Bank speeds for a curvature at the fastest of some speeds up to ``speed`` that the motors reach."""
        for share in _SPEED_SHARES:
            speeds = self._steady_arc(at, share * speed, curvature) or self.bank_speeds(share * speed, curvature)
            if max(abs(speeds[0]), abs(speeds[1])) <= self.robot.maximum_wheel_speed:
                break
        return speeds

    def curvature(self, seen: TurnObservation, phase: Phase, info: Any) -> float:
        """Curvature of the path a little ahead, corrected by the errors that the estimate leads to [1/m]."""
        at = self._estimate
        assert self._turn is not None
        assert at is not None
        errors = path_errors(self._turn, at, self._ahead)
        aside, slope = aligning_path(errors.to_go, self._aligning)
        side_slip = min(max(errors.side_slip, -self._largest_side_slip), self._largest_side_slip)
        error = errors.course_error(self._side_slip_share * side_slip * (1.0 - slope))
        feed_forward = float(self._turn.curvature(errors.distance + self.lead * seen.target_radius))
        correction = self._pid.update(-errors.lateral - side_slip * aside) - self.heading_gain * error
        largest = _LARGEST_CORRECTION / seen.target_radius
        return feed_forward + min(max(correction, -largest), largest)


class PathTracker(PathFollower):
    """B6: a :class:`PathFollower` with an estimator of its own.

    Needs the raw samples (``info_level="full"``), of which it reads nothing but sensors and its own command.

    Args:
        robot: nominal robot.
        gains: as of :class:`PathFollower`, like ``course_gain``, ``steady_arc`` and ``options``.
        course_gain: likewise.
        estimator: of the pose.
        steady_arc: likewise.
        options: likewise.
    """

    def __init__(
        self, robot: Robot, gains: PidGains, course_gain: float, estimator: MotionEstimator, steady_arc: SteadyArc,
        *options: Any, **named: Any,
    ) -> None:  # fmt: skip
        super().__init__(robot, gains, course_gain, steady_arc, *options, **named)
        self._estimator = estimator

    def __call__(self, observation: ArrayLike, info: Any = None) -> NDArray[np.float32]:
        """Action (2,), right and left bank speed over the robot's maximum."""
        if info is None or "samples" not in info:
            raise InputError('this controller needs the raw samples: make the environment with info_level="full".')
        seen = decode(observation)
        if self._turn is None:
            self._estimator.reset(-self.begin(seen).run_in, 0.0, 0.0)
            at = self._estimator.present()
        else:
            at = self._estimator.update(info["command"], info["samples"])
        curvature = self.wanted(seen, at)
        if curvature is None:
            return np.zeros(2, dtype=np.float32)
        return self.action(at, seen.target_speed, curvature)
