"""From observation to policy inputs, and from policy outputs to bank speeds, for N robots at a time.

Training (:mod:`ddagr_gym.wrappers.policy_view`) and driving (:mod:`ddagr_gym.policies.controller`) run this code. It
knows the observation only: nothing true.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.control.observation import (
    FEATURE_SCALES,
    OBSERVATION,
    PATH_SCALES,
    SCALES,
    FilterColumns,
    PathColumns,
    TurnColumns,
)
from ddagr_gym.control.timing import CONTROL_PERIOD
from ddagr_gym.errors import InputError
from ddagr_gym.estimation import FilterModel
from ddagr_gym.estimation.force_balance import arc_bank_speed_rows
from ddagr_gym.parameters import Robot, Sensors
from ddagr_gym.policies.design import PolicyDesign
from ddagr_gym.policies.reckoning import Reckoning
from ddagr_gym.policies.tracking import TrackedPaths

Array = NDArray[np.float64]
Inputs = NDArray[np.float32]

INPUT_LIMIT = 10.0
"""Inputs are clipped to this range."""

_LEAST_SPEED = 0.25
"""Share of the reference speed below which an estimated speed is not divided by [-] (ours)."""

_LEAST_COMMAND = 0.1  # [rad/s] (ours): a seventh of what the reference speed takes
_LONGEST_RESPONSE = 1.5  # [s] (ours): twice that of motors with the thesis's slower loop, 1/1.4 s

_LARGEST_STEERING = 0.8
"""Curvature with which the loop steers back to the reference at most, over 1/R* [-] (ours)."""

_BASE = len(OBSERVATION)
_FILTERED = _BASE + len(FEATURE_SCALES)
_FORCE_SCALE = 1.0  # [m/s^2] (ours): inputs are then of the order of 1
_SPEED_SCALE = 0.25  # [m/s] (ours): likewise


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
        self._reckoning = Reckoning(sensors, count)
        self._integral = np.zeros(count)
        self._behind = np.zeros(count)
        self._response = np.zeros(count)
        self._frames = np.zeros((count, depth, len(design.frame_inputs)))
        self._scales = np.concatenate([SCALES, FEATURE_SCALES, PATH_SCALES])[: design.observation_size]
        self._paths = None if design.tracker is None else TrackedPaths(design.tracker, robot, sensors, count)

    @property
    def paths(self) -> TrackedPaths:
        """Path trackers of a design with features "path".

        Raises:
            InputError: another design.
        """
        if self._paths is None:
            raise InputError(f"the design has features {self.design.features!r}: only 'path' has a path tracker.")
        return self._paths

    def si(self, observations: NDArray[np.floating]) -> Array:
        """Observations (n, entries) in SI units."""
        found: Array = np.asarray(observations, dtype=np.float64) * self._scales
        return found

    def _memories(self) -> tuple[NDArray[Any], ...]:
        own = (self._fresh, self._outputs, self._integral, self._behind, self._response, self._frames)
        return (*own, *self._reckoning.memories())

    def memory(self) -> tuple[Any, ...]:
        """Copies of everything that is remembered between steps; see :meth:`restore`."""
        paths = () if self._paths is None else (self._paths.memory(),)
        return (*(array.copy() for array in self._memories()), *paths)

    def restore(self, memory: tuple[Any, ...]) -> None:
        """Back to what :meth:`memory` gave."""
        own = self._memories()
        for array, saved in zip(own, memory[: len(own)], strict=True):
            array[...] = saved
        if self._paths is not None:
            self._paths.restore(memory[len(own)])

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
        whole = self.si(observations)
        seen = _turn_columns(whole)
        self._start(rows, seen)
        if self._paths is not None:
            self._paths.start(rows[self._fresh[rows]], whole[self._fresh[rows], :_BASE])
            self._paths.observe(rows, whole)
        self._measure_response(rows, seen)
        frame = self._frame(rows, seen, whole)
        self._frames[rows, 1:] = self._frames[rows, :-1]
        self._frames[rows, 0] = frame
        fresh = rows[self._fresh[rows]]
        self._frames[fresh] = self._frames[fresh, :1]
        self._fresh[rows] = False
        stacked = self._frames[rows, :: self.design.frame_interval].reshape(len(rows), -1)
        return np.clip(stacked, -INPUT_LIMIT, INPUT_LIMIT).astype(np.float32)

    def _start(self, rows: NDArray[np.int64], seen: TurnColumns) -> None:
        new = self._fresh[rows]
        started = rows[new]
        self._outputs[started] = 0.0
        for memory in (self._integral, self._behind, self._response):
            memory[started] = 0.0
        self._reckoning.start(started, seen.run_in_to_go[new])

    def _measure_response(self, rows: NDArray[np.int64], seen: TurnColumns) -> None:
        """Time by which the encoders are behind the commands, from the start from rest to the end of the run-in."""
        command = self._limit * (0.5 * (seen.last_action_right + seen.last_action_left))
        straight = (seen.run_in_to_go > 0.0) & ~self._fresh[rows]
        behind = np.where(straight, command - 0.5 * (seen.encoder_right + seen.encoder_left), 0.0)
        self._behind[rows] += CONTROL_PERIOD * behind
        measured = self._behind[rows] / np.maximum(command, _LEAST_COMMAND)
        self._response[rows] = np.where(straight, np.clip(measured, 0.0, _LONGEST_RESPONSE), self._response[rows])

    def _frame(self, rows: NDArray[np.int64], seen: TurnColumns, whole: Array) -> Array:
        side, radius, speed = seen.side, seen.target_radius, seen.target_speed
        rim, rate = self._radius / speed, radius / speed
        columns = [
            seen.specific_force_x / _FORCE_SCALE,
            side * seen.specific_force_y / _FORCE_SCALE,
            side * seen.yaw_rate * rate,
            *(rim * bank for bank in _outer_inner(side, seen.encoder_right, seen.encoder_left)),
            *(rim * self._limit * bank for bank in _outer_inner(side, seen.last_action_right, seen.last_action_left)),
            *self._outputs[rows].T,
            self._response[rows],
            *self._task(rows, seen),
        ]
        if self._paths is not None:
            columns += self._tracked(seen, whole, self._paths.curvatures[rows])
        elif self.design.needs_filter:
            columns += self._filtered(rows, seen, _filter_columns(whole))
        return np.stack(columns, axis=1)

    def _task(self, rows: NDArray[np.int64], seen: TurnColumns) -> list[Array]:
        turning, leaving = self._phases(rows, seen)
        radius, speed = seen.target_radius, seen.target_speed
        going = [seen.heading_to_go / math.pi, seen.run_in_to_go / radius]
        return [turning.astype(float), leaving.astype(float), *going, radius, speed / _SPEED_SCALE]

    def _lead(self, rows: NDArray[np.int64], seen: TurnColumns) -> Array:
        """Way gone at the reference speed until a command has its effect [m]."""
        return np.asarray((self._response[rows] + self.design.lead_time) * seen.target_speed)

    def _phases(self, rows: NDArray[np.int64], seen: TurnColumns) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Whether in the turn, and whether in the run-out, as commanded now: ahead of the robot."""
        lead = self._lead(rows, seen)
        entered = seen.run_in_to_go <= lead
        to_turn = seen.heading_to_go > lead / seen.target_radius
        return entered & to_turn, entered & ~to_turn

    def _filtered(self, rows: NDArray[np.int64], seen: TurnColumns, known: FilterColumns) -> list[Array]:
        side, radius, speed = seen.side, seen.target_radius, seen.target_speed
        forward, rate = known.estimated_v_x, side * known.estimated_yaw_rate
        turning, _ = self._phases(rows, seen)
        curvature = radius * rate / np.maximum(forward, _LEAST_SPEED * speed)
        error = np.where(turning, curvature - 1.0, curvature)
        self._integral[rows] += np.where(turning, error, 0.0) * CONTROL_PERIOD
        self._reckon(rows, seen, forward, rate)
        heading = self._reckoning.poses[rows, 2]
        by_heading, by_course = (self._reckoning.path_errors(rows, radius, sideslip) for sideslip in (False, True))
        offset, course_error = self._reckoning.reference_errors(rows)
        return [
            forward / speed,
            rate * radius / speed,
            *_soil(side, known),
            error,
            self._integral[rows],
            # a hundredth of R* and half a degree are what matters
            10.0 * by_heading.offset / radius,
            10.0 * by_heading.direction,
            (math.pi - heading) / math.pi,
            by_heading.to_go / radius,
            10.0 * self._reckoning.slip_angles[rows],
            100.0 * np.sqrt(self._reckoning.sideslip.covariances[rows, 0, 0]),
            10.0 * by_course.offset / radius,
            10.0 * by_course.direction,
            10.0 * offset / radius,
            10.0 * course_error,
            (math.pi - self._reckoning.references[rows, 2]) / math.pi,
        ]

    @staticmethod
    def _tracked(seen: TurnColumns, whole: Array, wanted: Array) -> list[Array]:
        """Inputs of the path, see :data:`~ddagr_gym.policies.design.PATH_INPUTS`."""
        side, radius, speed = seen.side, seen.target_radius, seen.target_speed
        known, path = _filter_columns(whole), PathColumns(*whole[:, _FILTERED:].T)
        return [
            known.estimated_v_x / speed,
            side * path.estimated_v_y / speed,
            side * known.estimated_yaw_rate * radius / speed,
            *_soil(side, known),
            path.gravity_x / _FORCE_SCALE,
            side * path.gravity_y / _FORCE_SCALE,
            # a hundredth of R* and half a degree are what matters
            10.0 * side * path.cross_track_error / radius,
            10.0 * side * path.course_error,
            path.path_to_go / radius,
            side * path.path_curvature * radius,
            side * wanted * radius,
        ]

    def _reckon(self, rows: NDArray[np.int64], seen: TurnColumns, forward: Array, rate: Array) -> None:
        moved = ~self._fresh[rows]
        radius, lateral = seen.target_radius, seen.side * seen.specific_force_y
        curvature = (1.0 + self.design.curvature_scale * self._outputs[rows, 0]) / radius
        self._reckoning.advance(rows[moved], forward[moved], rate[moved], lateral[moved], curvature[moved])

    def act(self, outputs: NDArray[np.floating], observations: NDArray[np.floating]) -> NDArray[np.float32]:
        """Actions of the environment (N, 2), right and left, for the policy's outputs (N, 2) in [-1, 1].

        Args:
            outputs: of the policy; values beyond the range are clipped, changes limited.
            observations: (N, entries) that the policy saw.
        """
        wanted = np.clip(np.asarray(outputs, dtype=np.float64), -1.0, 1.0)
        change = np.clip(wanted - self._outputs, -self.design.rate_limit, self.design.rate_limit)
        self._outputs += change
        whole = self.si(observations)
        seen = _turn_columns(whole)
        if self.design.action == "absolute":
            right, left = _outer_inner(seen.side, self._outputs[:, 0], self._outputs[:, 1])
            driving = 1.0 if self._paths is None else np.where(self._paths.standing, 0.0, 1.0)
            return (np.stack([right, left]) * driving).T.astype(np.float32)
        if self._paths is not None:
            return self._corrected(self._paths, seen)
        banks = self._feed_forward(seen, whole) / self._limit
        return np.clip(banks, -1.0, 1.0).astype(np.float32)

    def _corrected(self, paths: TrackedPaths, seen: TurnColumns) -> NDArray[np.float32]:
        """The path tracker's actions (N, 2) for its curvature and speed, each corrected."""
        bend = seen.side * self.design.curvature_scale * self._outputs[:, 0] / seen.target_radius
        pace = 1.0 + self.design.speed_scale * self._outputs[:, 1]
        return paths.act(pace * seen.target_speed, paths.curvatures + bend)

    def _feed_forward(self, seen: TurnColumns, whole: Array) -> Array:
        """Bank speeds (N, 2) right, left [rad/s] of the corrected arc at the estimated, or the nominal, soil."""
        curvature = self._reference_loop(seen) if self.design.needs_filter else self._nominal(seen)
        curvature = seen.side * (curvature + self.design.curvature_scale * self._outputs[:, 0] / seen.target_radius)
        logs = np.stack(_filter_columns(whole).log_soil, axis=1) if self.design.needs_filter else 0.0
        parameters = np.exp(np.broadcast_to(self._prior + logs, (self.count, 4)))
        corrected = seen.target_speed * (1.0 + self.design.speed_scale * self._outputs[:, 1])
        return arc_bank_speed_rows(self._model, parameters, corrected, curvature)

    def _nominal(self, seen: TurnColumns) -> Array:
        """Commanded curvature, turn to the left, with heading hold by the gyro on straights [1/m]."""
        turning, leaving = self._phases(np.arange(self.count), seen)
        heading_hold = self.design.heading_gain * (seen.heading_to_go - np.where(leaving, 0.0, math.pi))
        return np.where(turning, 1.0 / seen.target_radius, heading_hold)

    def _reference_loop(self, seen: TurnColumns) -> Array:
        """Curvature that follows the reference, bent and straightened ahead of time, turn to the left [1/m]."""
        rows, radius = np.arange(self.count), seen.target_radius
        lead = self._lead(rows, seen)
        entered = self._reckoning.distances + lead > 0.0
        turning = entered & (self._reckoning.references[:, 2] + lead / radius < math.pi)
        offset, course_error = self._reckoning.reference_errors(rows)
        back = self.design.offset_gain * offset / radius + self.design.course_gain * course_error
        back = np.clip(back, -_LARGEST_STEERING, _LARGEST_STEERING)
        return (turning - back) / radius


def _turn_columns(whole: Array) -> TurnColumns:
    """What every observation (n, entries) has, in SI units."""
    return TurnColumns(*whole[:, :_BASE].T)


def _filter_columns(whole: Array) -> FilterColumns:
    """The filter's part of observations (n, entries) in SI units."""
    return FilterColumns(*whole[:, _BASE:_FILTERED].T)


def _soil(side: Array, known: FilterColumns) -> list[Array]:
    """Inputs :data:`~ddagr_gym.policies.design.SOIL_INPUTS` of what a filter knows."""
    slips = _outer_inner(side, known.estimated_slip_right, known.estimated_slip_left)
    return [*known.log_soil, *slips, *known.deviations]


def _outer_inner(side: Array, right: Array, left: Array) -> tuple[Array, Array]:
    """(right, left) as (outer, inner) of the turn, and the other way round."""
    return np.where(side > 0.0, right, left), np.where(side > 0.0, left, right)
