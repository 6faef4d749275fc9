"""Dead reckoning of N turns from the filter's speed and yaw rate and the sideslip, and the reference to be followed.

Coordinates: metres, the turn goes to the left, the row ends at x = 0; the row's direction is +x.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.control.row_turn import project_left_turn
from ddagr_gym.control.timing import CONTROL_INTERVAL, CONTROL_PERIOD
from ddagr_gym.estimation.sideslip import SideslipFilter
from ddagr_gym.parameters import Sensors

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

_TURNED = 0.05
"""Heading change after which the sideslip may change [rad] (ours)."""

_LEAST_SPEED = 0.02
"""Forward speed that slip angles are divided by at least [m/s] (ours)."""


class PathErrors(NamedTuple):
    """Of a pose against the commanded path, each (n,): to its left [m], of direction [rad], path to go [m]."""

    offset: Array
    direction: Array
    to_go: Array


class Reckoning:
    """Where N robots are by dead reckoning, and where their references are.

    The reference starts on the commanded path and moves as far as the robot does. In the turn it bends by the commanded
    curvature plus the policy's correction: so a correction lasts, while everything else that pushes the robot off is
    worked against.

    Args:
        sensors: nominal sensors.
        count: N.

    Attributes:
        poses: (N, 3) x, y, heading without sideslip.
        positions: (N, 2) x, y with sideslip.
        references: (N, 3) x, y, direction of the reference.
        distances: (N,) gone since the end of the run-in, negative before [m].
        slip_angles: (N,) angle from heading to course [rad].
    """

    def __init__(self, sensors: Sensors, count: int) -> None:
        self.sideslip = SideslipFilter(sensors.imu, CONTROL_INTERVAL, CONTROL_PERIOD, count)
        self.poses = np.zeros((count, 3))
        self.positions = np.zeros((count, 2))
        self.references = np.zeros((count, 3))
        self.distances = np.zeros(count)
        self.slip_angles = np.zeros(count)
        self._last_rates = np.zeros(count)

    def memories(self) -> tuple[NDArray[Any], ...]:
        """The arrays that are remembered between steps."""
        own = (self.poses, self.positions, self.references, self.distances, self.slip_angles, self._last_rates)
        return (*own, self.sideslip.states, self.sideslip.covariances, self.sideslip.last_rates)

    def start(self, rows: Rows, run_in: Array) -> None:
        """Put ``rows`` at the start of their run-in [m]."""
        for array in self.memories()[:6]:
            array[rows] = 0.0
        self.poses[rows, 0] = self.positions[rows, 0] = self.references[rows, 0] = self.distances[rows] = -run_in
        self.sideslip.reset(rows)

    def advance(self, rows: Rows, forward: Array, rate: Array, lateral: Array, curvature: Array) -> None:
        """One control step of ``rows``.

        Args:
            rows: (n,).
            forward: (n,) v_x by the filter [m/s].
            rate: (n,) yaw rate by the filter, to the left [rad/s].
            lateral: (n,) specific force to the left [m/s^2].
            curvature: (n,) of the reference in the turn [1/m].
        """
        turning = np.abs(self.poses[rows, 2]) > _TURNED
        side = self.sideslip.update(rows, lateral, forward, rate, turning)
        turned = 0.5 * (rate + self._last_rates[rows]) * CONTROL_PERIOD
        heading = self.poses[rows, 2] + 0.5 * turned
        ahead = forward * CONTROL_PERIOD * np.stack([np.cos(heading), np.sin(heading)])
        aside = side * CONTROL_PERIOD * np.stack([-np.sin(heading), np.cos(heading)])
        self.poses[rows, :2] += ahead.T
        self.poses[rows, 2] += turned
        self.positions[rows] += (ahead + aside).T
        self.slip_angles[rows] = side / np.maximum(forward, _LEAST_SPEED)
        self._last_rates[rows] = rate
        self._move_references(rows, np.hypot(forward, side) * CONTROL_PERIOD, curvature)

    def _move_references(self, rows: Rows, way: Array, curvature: Array) -> None:
        before = self.distances[rows]
        self.distances[rows] += way
        in_turn = np.clip(before + way, 0.0, way)  # the part of the way beyond the end of the run-in
        direction = self.references[rows, 2]
        after = np.clip(direction + in_turn * np.maximum(curvature, 0.0), 0.0, math.pi)
        middle = 0.5 * (direction + after)
        self.references[rows, 0] += way * np.cos(middle)
        self.references[rows, 1] += way * np.sin(middle)
        self.references[rows, 2] = after

    def courses(self, rows: Rows) -> Array:
        """Direction of travel (n,) [rad]."""
        return np.asarray(self.poses[rows, 2] + self.slip_angles[rows])

    def reference_errors(self, rows: Rows) -> tuple[Array, Array]:
        """Offset to the left of the reference [m] and course error against it [rad], each (n,)."""
        x, y, direction = self.references[rows].T
        away = self.positions[rows] - np.stack([x, y], axis=1)
        offset = -np.sin(direction) * away[:, 0] + np.cos(direction) * away[:, 1]
        return offset, self.courses(rows) - direction

    def path_errors(self, rows: Rows, radius: Array, with_sideslip: bool) -> PathErrors:
        """Errors against the commanded path itself, of the position with or without sideslip."""
        if with_sideslip:
            x, y = self.positions[rows].T
            return path_errors(x, y, self.courses(rows), radius)
        x, y, heading = self.poses[rows].T
        return path_errors(x, y, heading, radius)


def path_errors(x: Array, y: Array, direction: Array, radius: Array) -> PathErrors:
    """Errors of poses against the commanded path."""
    distance, offset = project_left_turn(x, y, radius)
    error = direction - np.clip(distance / radius, 0.0, math.pi)
    return PathErrors(offset, error, math.pi * radius - distance)
