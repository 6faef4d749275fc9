"""From observation to policy inputs, and from policy outputs to bank speeds, for N robots at a time.

Training (:mod:`ddagr_gym.wrappers.policy_view`) and driving (:mod:`ddagr_gym.policies.controller`) run this code. It
knows the observation only: nothing true.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.control.observation import FEATURE_SCALES, OBSERVATION, SCALES
from ddagr_gym.control.turn_controller import CONTROL_PERIOD
from ddagr_gym.envs.constants import CONTROL_INTERVAL
from ddagr_gym.estimation import FilterModel
from ddagr_gym.estimation.force_balance import arc_bank_speed_rows
from ddagr_gym.estimation.sideslip import SideslipFilter
from ddagr_gym.parameters import Robot, Sensors
from ddagr_gym.policies.design import PolicyDesign

Array = NDArray[np.float64]
Inputs = NDArray[np.float32]

INPUT_LIMIT = 10.0
"""Inputs are clipped to this range."""

_LEAST_SPEED = 0.25
"""Share of the reference speed below which an estimated speed is not divided by [-] (ours)."""

_TURNED = 0.05
"""Heading change after which the sideslip may change [rad] (ours)."""

_BASE = len(OBSERVATION)
_FORCE_SCALE = 1.0  # [m/s^2]


class PolicyView:
    """Memory and wiring of N policies of one design.

    Args:
        design: wiring.
        robot: nominal robot.
        sensors: nominal sensors.
        count: N.
    """

    def __init__(self, design: PolicyDesign, robot: Robot, sensors: Sensors, count: int = 1) -> None:
        self.design = design
        self.count = count
        self._limit = robot.maximum_wheel_speed
        self._radius = robot.wheels[0].outer_radius
        self._model = FilterModel.of(robot, sensors)
        self._prior = self._model.soil_prior.logs(self._model.wheel_load)[0]
        depth = (design.frames - 1) * design.frame_interval + 1
        self._fresh = np.ones(count, dtype=np.bool_)
        self._outputs = np.zeros((count, 2))
        self._pose = np.zeros((count, 3))
        self._course_position = np.zeros((count, 2))
        self._sideslip = SideslipFilter(sensors.imu, CONTROL_INTERVAL, CONTROL_PERIOD, count)
        self._last_rate = np.zeros(count)
        self._integral = np.zeros(count)
        self._frames = np.zeros((count, depth, len(design.frame_inputs)))

    def _memories(self) -> tuple[NDArray[Any], ...]:
        filter_ = self._sideslip
        own = (self._fresh, self._outputs, self._pose, self._course_position, self._last_rate, self._integral)
        return (*own, self._frames, filter_.states, filter_.covariances, filter_.last_rates)

    def memory(self) -> tuple[NDArray[Any], ...]:
        """Copies of everything that is remembered between steps; see :meth:`restore`."""
        return tuple(array.copy() for array in self._memories())

    def restore(self, memory: tuple[NDArray[Any], ...]) -> None:
        """Back to what :meth:`memory` gave."""
        for array, saved in zip(self._memories(), memory, strict=True):
            array[...] = saved

    def reset(self, chosen: NDArray[np.int64] | None = None) -> None:
        """Forget the episodes of ``chosen`` rows, all by default."""
        self._fresh[slice(None) if chosen is None else chosen] = True

    def observe(self, observations: NDArray[np.floating], chosen: NDArray[np.int64] | None = None) -> Inputs:
        """Inputs of the ``chosen`` rows (all by default) after a step or a reset.

        Args:
            observations: (n, entries) of these rows, as the environment scales them.

        Returns:
            (n, inputs).
        """
        rows = np.arange(self.count) if chosen is None else chosen
        given = np.asarray(observations, dtype=np.float64)
        seen = given[:, :_BASE] * SCALES
        features = given[:, _BASE:] * FEATURE_SCALES if self.design.needs_filter else None
        self._start(rows, seen)
        frame = self._frame(rows, seen, features)
        self._frames[rows, 1:] = self._frames[rows, :-1]
        self._frames[rows, 0] = frame
        fresh = rows[self._fresh[rows]]
        self._frames[fresh] = self._frames[fresh, :1]
        self._fresh[rows] = False
        stacked = self._frames[rows, :: self.design.frame_interval].reshape(len(rows), -1)
        return np.clip(stacked, -INPUT_LIMIT, INPUT_LIMIT).astype(np.float32)

    def _start(self, rows: NDArray[np.int64], seen: Array) -> None:
        new = self._fresh[rows]
        started = rows[new]
        self._outputs[started] = 0.0
        self._pose[started] = 0.0
        self._pose[started, 0] = -seen[new, 11]
        self._course_position[started] = self._pose[started, :2]
        self._sideslip.reset(started)
        self._last_rate[started] = 0.0
        self._integral[started] = 0.0

    def _frame(self, rows: NDArray[np.int64], seen: Array, features: Array | None) -> Array:
        side, radius, speed = seen[:, 7], seen[:, 8], seen[:, 9]
        rim, rate = self._radius / speed, radius / speed
        columns = [
            seen[:, 0] / _FORCE_SCALE,
            side * seen[:, 1] / _FORCE_SCALE,
            side * seen[:, 2] * rate,
            *(rim * bank for bank in _outer_inner(side, seen[:, 3], seen[:, 4])),
            *(rim * self._limit * bank for bank in _outer_inner(side, seen[:, 5], seen[:, 6])),
            *self._outputs[rows].T,
            *self._task(seen),
        ]
        if features is not None:
            columns += self._filtered(rows, seen, features)
        return np.stack(columns, axis=1)

    def _task(self, seen: Array) -> list[Array]:
        turning, leaving = self._phases(seen)
        return [turning.astype(float), leaving.astype(float), seen[:, 10] / math.pi, seen[:, 11] / seen[:, 8]]

    def _phases(self, seen: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Whether in the turn, and whether in the run-out, as the classical controllers decide it."""
        lead = self.design.lead_time * seen[:, 9]
        entered = seen[:, 11] <= lead
        to_turn = seen[:, 10] > lead / seen[:, 8]
        return entered & to_turn, entered & ~to_turn

    def _filtered(self, rows: NDArray[np.int64], seen: Array, features: Array) -> list[Array]:
        side, radius, speed = seen[:, 7], seen[:, 8], seen[:, 9]
        forward, rate = features[:, 0], side * features[:, 1]
        turning, _ = self._phases(seen)
        curvature = radius * rate / np.maximum(forward, _LEAST_SPEED * speed)
        error = np.where(turning, curvature - 1.0, curvature)
        self._integral[rows] += np.where(turning, error, 0.0) * CONTROL_PERIOD
        turning_body = np.abs(self._pose[rows, 2]) > _TURNED
        side_speed = self._sideslip.update(rows, side * seen[:, 1], forward, rate, turning_body)
        side_speed = np.where(self._fresh[rows], 0.0, side_speed)
        self._dead_reckon(rows, forward, side_speed, rate)
        heading = self._pose[rows, 2]
        cross_track, heading_error, to_go = _path_errors(*self._pose[rows, :2].T / radius, heading)
        slip_angle = side_speed / np.maximum(forward, _LEAST_SPEED * speed)
        course = _path_errors(*self._course_position[rows].T / radius, heading + slip_angle)
        outer, inner = _outer_inner(side, features[:, 6], features[:, 7])
        return [
            forward / speed,
            rate * radius / speed,
            *features[:, 2:6].T,
            outer,
            inner,
            *features[:, 8:12].T,
            error,
            self._integral[rows],
            # a hundredth of R* and half a degree are what matters
            10.0 * cross_track,
            10.0 * heading_error,
            (math.pi - heading) / math.pi,
            to_go,
            10.0 * slip_angle,
            100.0 * np.sqrt(self._sideslip.covariances[rows, 0, 0]),
            10.0 * course[0],
            10.0 * course[1],
        ]

    def _dead_reckon(self, rows: NDArray[np.int64], forward: Array, side_speed: Array, rate: Array) -> None:
        """Pose by the filter's speed and yaw rate, and position with the sideslip, turn to the left."""
        moved = ~self._fresh[rows]
        turned = np.where(moved, 0.5 * (rate + self._last_rate[rows]) * CONTROL_PERIOD, 0.0)
        heading = self._pose[rows, 2] + 0.5 * turned
        step = np.where(moved, forward * CONTROL_PERIOD, 0.0)
        aside = np.where(moved, side_speed * CONTROL_PERIOD, 0.0)
        ahead = np.column_stack([step * np.cos(heading), step * np.sin(heading)])
        self._pose[rows, :2] += ahead
        self._pose[rows, 2] += turned
        self._course_position[rows] += ahead + np.column_stack([-aside * np.sin(heading), aside * np.cos(heading)])
        self._last_rate[rows] = rate

    def act(self, outputs: NDArray[np.floating], observations: NDArray[np.floating]) -> NDArray[np.float32]:
        """Actions of the environment (N, 2), right and left, for the policy's outputs (N, 2) in [-1, 1].

        Args:
            outputs: of the policy; values beyond the range are clipped, changes limited.
            observations: (N, entries) that the policy saw.
        """
        wanted = np.clip(np.asarray(outputs, dtype=np.float64), -1.0, 1.0)
        change = np.clip(wanted - self._outputs, -self.design.rate_limit, self.design.rate_limit)
        self._outputs += change
        given = np.asarray(observations, dtype=np.float64)
        seen = given[:, :_BASE] * SCALES
        if self.design.action == "absolute":
            right, left = _outer_inner(seen[:, 7], self._outputs[:, 0], self._outputs[:, 1])
            return np.stack([right, left], axis=1).astype(np.float32)
        banks = self._feed_forward(seen, given) / self._limit
        return np.clip(banks, -1.0, 1.0).astype(np.float32)

    def _feed_forward(self, seen: Array, given: Array) -> Array:
        """Bank speeds (N, 2) right, left [rad/s] of the corrected arc at the estimated, or the nominal, soil."""
        side, radius, speed = seen[:, 7], seen[:, 8], seen[:, 9]
        turning, leaving = self._phases(seen)
        heading_hold = self.design.heading_gain * (seen[:, 10] - np.where(leaving, 0.0, math.pi))
        curvature = np.where(turning, 1.0 / radius, heading_hold)
        curvature = side * (curvature + self.design.curvature_scale * self._outputs[:, 0] / radius)
        logs = given[:, _BASE + 2 : _BASE + 6] * FEATURE_SCALES[2:6] if self.design.needs_filter else 0.0
        parameters = np.exp(np.broadcast_to(self._prior + logs, (len(seen), 4)))
        corrected = speed * (1.0 + self.design.speed_scale * self._outputs[:, 1])
        return arc_bank_speed_rows(self._model, parameters, corrected, curvature)


def _path_errors(x: Array, y: Array, heading: Array) -> tuple[Array, Array, Array]:
    """Distance to the left of the path of R* = 1, heading error, and angle to go, for a turn to the left."""
    from_centre = y - 1.0
    on_circle, leaving = x >= 0.0, from_centre > 0.0
    angle = np.arctan2(np.abs(x), -from_centre)
    distance = np.where(on_circle, angle, np.where(leaving, math.pi - x, x))
    offset = np.where(on_circle, 1.0 - np.hypot(x, from_centre), np.where(leaving, 1.0 - from_centre, y))
    return offset, heading - np.clip(distance, 0.0, math.pi), math.pi - distance


def _outer_inner(side: Array, right: Array, left: Array) -> tuple[Array, Array]:
    """(right, left) as (outer, inner) of the turn, and the other way round."""
    return np.where(side > 0.0, right, left), np.where(side > 0.0, left, right)
