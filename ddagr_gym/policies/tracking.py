"""The path tracker of N robots by the observation: what a policy that sees the path corrects.

The estimated motion comes from the observation's entries, so that training, validation and driving run the same code.
The gains are those of the policy's design. Where the estimated soil has no solution, and for the lead, numbers of two
constant speeds on the nominal soil stand in place of those that B6 has calibrated for each turn.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.control.observation import OBSERVATION, PLACES, TurnObservation
from ddagr_gym.control.path_tracker import MotionEstimate, PathFollower
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.control.tracker_settings import STANDING, TrackerSettings
from ddagr_gym.estimation import InertialModel, Reckoned
from ddagr_gym.estimation.force_balance import arc_bank_speeds
from ddagr_gym.parameters import Robot, Sensors

Array = NDArray[np.float64]

_LEAD = 0.057
"""Heading before the end of the turn at which two constant speeds straighten [rad]: 0.056 to 0.057 on the nominal soil
at radii of 0.66 to 1.1 m (:func:`ddagr_gym.evaluation.controllers.nominal_constants`)."""
_TRACK_RATIO = 1.3
"""Effective over geometric track [-]: 1.26 to 1.34 there."""

_BASE = len(OBSERVATION)
_LOGS = slice(PLACES["log_traction_limit"], PLACES["log_motion_resistance"] + 1)
_MOTION = [PLACES[name] for name in ("estimated_x", "estimated_y", "estimated_yaw", "estimated_v_x", "estimated_v_y",
                                      "estimated_yaw_rate")]  # fmt: skip
_GRAVITY = slice(PLACES["gravity_x"], PLACES["gravity_y"] + 1)


class TrackedPaths:
    """Path trackers of N robots.

    Args:
        settings: gains.
        robot: nominal robot.
        sensors: nominal sensors.
        count: N.

    Attributes:
        curvatures: (N,) that the trackers want [1/m], 0 while they stand.
        standing: (N,) whether they stand.
    """

    def __init__(self, settings: TrackerSettings, robot: Robot, sensors: Sensors, count: int) -> None:
        flat = InertialModel.of(robot, sensors).flat
        self._prior = flat.soil_prior.logs(flat.wheel_load)[0]

        def steady_arc(at: MotionEstimate, speed: float, curvature: float) -> tuple[float, float] | None:
            return arc_bank_speeds(flat, at.soil, speed, curvature, at.gravity)

        lead = settings.loop.lead_factor * _LEAD
        self._followers = [
            PathFollower(
                robot, settings.loop.gains, settings.course, steady_arc, _TRACK_RATIO, lead, STANDING, settings.ahead,
                settings.side_slip, settings.aligning, settings.largest_slip,
            )
            for _ in range(count)
        ]  # fmt: skip
        self.curvatures = np.zeros(count)
        self.standing = np.ones(count, dtype=np.bool_)
        self._turns = [RowTurn()] * count
        self._at: list[Reckoned | None] = [None] * count

    def memory(self) -> list[Any]:
        """Copies of everything that is remembered between steps; see :meth:`restore`."""
        return [
            self.curvatures.copy(), self.standing.copy(), list(self._turns), list(self._at),
            [follower.memory() for follower in self._followers],
        ]  # fmt: skip

    def restore(self, memory: list[Any]) -> None:
        """Back to what :meth:`memory` gave."""
        self.curvatures[:], self.standing[:] = memory[0], memory[1]
        self._turns, self._at = list(memory[2]), list(memory[3])
        for follower, turn, own in zip(self._followers, self._turns, memory[4], strict=True):
            follower.restore(turn, own)

    def start(self, rows: NDArray[np.int64], seen: Array) -> None:
        """Begin episodes of ``rows`` at their first observations (n, entries) in SI units."""
        for n, values in zip(rows.tolist(), seen[:, :_BASE].tolist(), strict=True):
            self._turns[n] = self._followers[n].begin(TurnObservation(*values))

    def observe(self, rows: NDArray[np.int64], seen: Array) -> None:
        """See ``rows`` once a control period (n, entries) in SI units, and note the curvature that each wants."""
        self.follow(rows, seen, [self._motion(values) for values in seen])

    def follow(self, rows: NDArray[np.int64], seen: Array, motions: Sequence[Reckoned]) -> None:
        """As :meth:`observe`, by the motions of ``rows`` in place of those that the observations say."""
        for n, values, at in zip(rows.tolist(), seen[:, :_BASE].tolist(), motions, strict=True):
            self._at[n] = at
            wanted = self._followers[n].wanted(TurnObservation(*values), at)
            self.standing[n] = wanted is None
            self.curvatures[n] = 0.0 if wanted is None else wanted

    def _motion(self, values: Array) -> Reckoned:
        """Estimated motion of one observation (entries,) in SI units."""
        x, y, yaw, v_x, v_y, rate = values[_MOTION].tolist()
        pull_x, pull_y = values[_GRAVITY].tolist()
        return Reckoned(x, y, yaw, v_x, v_y, rate, np.exp(self._prior + values[_LOGS]), (pull_x, pull_y))

    def act(self, speeds: Array, curvatures: Array) -> NDArray[np.float32]:
        """Actions (N, 2) for speeds (N,) [m/s] and curvatures (N,) [1/m]; 0 while a robot stands."""
        actions = np.zeros((len(speeds), 2), dtype=np.float32)
        for n, (speed, curvature) in enumerate(zip(speeds.tolist(), curvatures.tolist(), strict=True)):
            at = self._at[n]
            if not self.standing[n] and at is not None:
                actions[n] = self._followers[n].action(at, speed, curvature)
        return actions
