"""Where a robot is by its own filter, from a known start on.

The inertial filter carries the pose along, and a network may correct it; of the others the estimated velocities are
integrated.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.estimation.columns import stack_columns
from ddagr_gym.estimation.filter import Filter
from ddagr_gym.estimation.filter_model import FilterModel
from ddagr_gym.estimation.inertial_filter import InertialFilter, InertialModel
from ddagr_gym.estimation.inertial_layout import GRAVITY
from ddagr_gym.estimation.layout import CHANNELS, COMMANDS, PARAMETER, PARAMETER_SIZE
from ddagr_gym.estimation.learned_filter import LearnedFilter, LearnedModel

Array = NDArray[np.float64]


class Reckoned(NamedTuple):
    """What dead reckoning tells.

    Attributes:
        x, y: position of the body origin [m].
        yaw: heading, continuous [rad].
        v_x, v_y: velocity of the body origin [m/s].
        yaw_rate: [rad/s].
        soil: (4,) a1 [N], a2 [-], b [N/rad], Rc [N].
        gravity: its pull along body x and y [m/s^2]; 0 by a filter that takes the ground for level.
    """

    x: float
    y: float
    yaw: float
    v_x: float
    v_y: float
    yaw_rate: float
    soil: Array
    gravity: tuple[float, float] = (0.0, 0.0)


def integrate_track(
    v_x: ArrayLike, v_y: ArrayLike, yaw_rate: ArrayLike, period: float, before: ArrayLike = (0.0, 0.0, 0.0)
) -> Array:
    """Pose (T, 3) x, y, yaw after each sample, from (0, 0, 0), by the trapezoidal rule.

    Args:
        v_x, v_y: velocity of the body origin after each sample (T,) [m/s].
        yaw_rate: likewise [rad/s].
        period: between samples [s].
        before: v_x, v_y, yaw rate at the start; at rest by default.
    """
    motion = np.column_stack([v_x, v_y, yaw_rate]).astype(float)
    middle = 0.5 * (motion + np.vstack([before, motion[:-1]]))
    yaw = np.cumsum(middle[:, 2]) * period
    half = yaw - 0.5 * middle[:, 2] * period
    x = np.cumsum(middle[:, 0] * np.cos(half) - middle[:, 1] * np.sin(half)) * period
    y = np.cumsum(middle[:, 0] * np.sin(half) + middle[:, 1] * np.cos(half)) * period
    return np.column_stack([x, y, yaw])


def led_on(pose: Array, motion: Array, before: Array, period: float) -> Array:
    """Pose (3,) to which velocities lead.

    Args:
        pose: x, y [m], yaw [rad] at the start.
        motion: v_x, v_y [m/s] and yaw rate [rad/s] after each sample (K, 3).
        before: likewise at the start (3,).
        period: between samples [s].
    """
    return placed(pose, integrate_track(motion[:, 0], motion[:, 1], motion[:, 2], period, before)[-1])


def placed(start: Array, pose: Array) -> Array:
    """Pose (3,) in the world of one that is seen from a start (3,): x, y [m], yaw [rad]."""
    x, y, turned = pose
    cosine, sine = math.cos(start[2]), math.sin(start[2])
    return start + np.array([cosine * x - sine * y, sine * x + cosine * y, turned])


def settled(own: Array, filtered: Array, time: float, settling: float) -> Array:
    """Pose (3,) that has approached the filter's for a time [s]; ``settling`` as of :class:`DeadReckoning`."""
    kept = math.exp(-time / settling) if settling > 0.0 else 0.0
    return (1.0 - kept) * filtered + kept * own


def _filter_of(model: FilterModel | InertialModel | LearnedModel) -> Filter | InertialFilter | LearnedFilter:
    if isinstance(model, LearnedModel):
        return LearnedFilter(model)
    return Filter(model) if isinstance(model, FilterModel) else InertialFilter(model)


def _motion(own: Filter | InertialFilter | LearnedFilter, command: Array, samples: Array) -> Array:
    """Estimated velocities (K, 3) after each sample."""
    if not isinstance(own, Filter):
        return own.run(np.atleast_2d(command), np.ascontiguousarray(samples))[0][:, :3]
    motion = np.empty((len(samples), 3))
    for k, sample in enumerate(samples):
        own.step(command if command.ndim == 1 else command[k], sample)
        motion[k] = own.state[:3]
    return motion


class DeadReckoning:
    """A filter of one robot and the pose that it leads to; deployable, it sees samples and commands alone.

    Args:
        model: what the filter knows; its kind chooses the filter.
        settling: time in which what the inertial filter, or a network beside it, learns later of the way so far comes
            into the pose [s]: a controller would follow each correction at once, and a circle with a step in it is none
            (ours). 0: at once, the pose is the filter's; infinite: never, the velocities are integrated as they come.
    """

    def __init__(self, model: FilterModel | InertialModel | LearnedModel, settling: float = 0.0) -> None:
        if not settling >= 0.0:
            raise InputError(f"settling is {settling:g}: give a time of 0 s or more.")
        flat = model if isinstance(model, FilterModel) else model.flat
        self._filter = _filter_of(model)
        self._settling = settling
        self._period = flat.sample_period
        self.reset(0.0, 0.0, 0.0)

    def reset(self, x: float, y: float, yaw: float, gravity: ArrayLike = (0.0, 0.0)) -> None:
        """Forget everything; the robot is at rest.

        Args:
            x, y: place [m].
            yaw: heading [rad].
            gravity: its pull along body x and y [m/s^2], as the inertial filter begins with it; no other knows any.
        """
        self._pose = np.array([x, y, yaw])
        self._start = self._pose.copy()
        if isinstance(self._filter, InertialFilter):
            self._filter.reset(self._pose, gravity)
        else:
            self._filter.reset()

    def pushed(self, push: ArrayLike) -> None:
        """From now on the inertial filter takes a push (3,) for known: F_x/m, F_y/m [m/s^2], M/I [rad/s^2].

        Raises:
            InputError: another filter, which has no place for it.
        """
        if not isinstance(self._filter, InertialFilter):
            raise InputError("only the inertial filter can be told of a push: give an InertialModel.")
        self._filter.known_push[:] = push

    def update(self, command: ArrayLike, samples: ArrayLike) -> Reckoned:
        """Through samples (K, 5) in the order of ``CHANNELS`` under one command (2,), or one each (K, 2) [rad/s]."""
        drive, readings = np.asarray(command, dtype=np.float64), np.asarray(samples, dtype=np.float64)
        before = self._filter.state[:3].copy()
        self._pose = led_on(self._pose, _motion(self._filter, drive, readings), before, self._period)
        carried = self._carried()
        if carried is not None:
            self._pose = settled(self._pose, carried, len(readings) * self._period, self._settling)
        return self.present()

    def _carried(self) -> Array | None:
        """Pose (3,) that the filter or its network carries along; None of one that knows velocities alone."""
        if isinstance(self._filter, InertialFilter):
            return self._filter.pose
        if isinstance(self._filter, LearnedFilter) and self._filter.model.network.description.place:
            return placed(self._start, self._filter.pose)
        return None

    def present(self) -> Reckoned:
        """What is known now."""
        state = self._filter.state
        soil = np.exp(state[PARAMETER : PARAMETER + PARAMETER_SIZE])
        pull = (0.0, 0.0)
        if not isinstance(self._filter, Filter):
            pull = (float(state[GRAVITY]), float(state[GRAVITY + 1]))
        x, y, yaw = self._pose.tolist()
        v_x, v_y, yaw_rate = state[:3].tolist()
        return Reckoned(x, y, yaw, v_x, v_y, yaw_rate, soil, pull)


def reckoned_track(model: LearnedModel, columns: Mapping[str, ArrayLike], start: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """Pose (T, 3) x, y [m], yaw [rad] after each sample by a learned estimator, on a line within a block.

    After the last whole block the pose stays.

    Args:
        model: of the estimator.
        columns: of a recording at the sensors' rate, whose commands change at every block.
        start: pose at rest before the first sample.
    """
    commands, readings = stack_columns(columns, COMMANDS, np.nan), stack_columns(columns, CHANNELS, np.nan)
    size = model.network.description.samples
    ends = np.arange(size, len(readings) + 1, size)
    reckoning, first = DeadReckoning(model), np.asarray(start, dtype=np.float64)
    reckoning.reset(*first.tolist())
    poses = [first, *(reckoning.update(commands[end - size], readings[end - size : end])[:3] for end in ends)]
    instants = np.arange(1, len(readings) + 1)
    return np.column_stack([np.interp(instants, [0, *ends], series) for series in np.array(poses).T])
