"""Readings relative to what the robot's other sensors say, so that what a model gets wrong in common drops out.

Where the model of a real robot is off, it is off in all sensors at once: a wrong yaw rate shows in gyro, headings,
places and wheel speeds alike, and hides that two sensors contradict each other, which they do by far less. With the
recording's own wheel speeds w and gyro g, the angle and the place that they lead to,

    phi(t) = int g dt,    v = r (w_r + w_l)/2,    D(t) = int v (cos phi, sin phi) dt,

the readings of gyro, lateral accelerometer, heading and place are compared as

    g - c (w_r - w_l),    f_y - v g,    psi - phi,    p - R(psi_0) D,

measured and predicted alike, with the predicted speed v and heading psi_0 at the start of a window. The map from the
readings to these is one to one: it takes nothing away and says only which errors come together. It is the first factor
of their covariance, as a triangular factor of a covariance is, but for its sizes, which are those of the residuals.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.block_means import BlockedWindows, sample_windows
from ddagr_gym.identification.windows import CHANNELS, WindowSet

Array = NDArray[np.float64]

_RIGHT, _LEFT, _GYRO = (CHANNELS.index(name) for name in ("encoder_right", "encoder_left", "yaw_rate"))
_SIDEWAYS, _YAW = CHANNELS.index("specific_force_y"), CHANNELS.index("pose_yaw")
_PLACE = [CHANNELS.index("pose_x"), CHANNELS.index("pose_y")]
_FILLED = (_RIGHT, _LEFT, _GYRO)

_STEP = 1e-4
"""Share of a change by which its derivative is taken (ours): predictions are smooth in it."""


@dataclass(frozen=True, eq=False)
class Between:
    """Linear interpolation between the known samples of wheel speeds and gyro, one operator for all predictions.

    Attributes:
        lower: (W, T, 3) rows of the known samples before.
        upper: (W, T, 3) after.
        share: (W, T, 3) of the later one.
        known: (W, 1, 3) 1 where a window has any.
    """

    lower: NDArray[np.int64]
    upper: NDArray[np.int64]
    share: Array
    known: Array

    @classmethod
    def of(cls, measured: Array) -> Between:
        """Operator of readings (W, T, 8); outside the known samples the next one holds."""
        finite = np.isfinite(measured[..., _FILLED])
        samples = finite.shape[1]
        rows = np.arange(samples)[None, :, None]
        lower = np.maximum.accumulate(np.where(finite, rows, -1), axis=1)
        upper = np.minimum.accumulate(np.where(finite, rows, samples)[:, ::-1], axis=1)[:, ::-1]
        lower, upper = np.where(lower < 0, upper, lower), np.where(upper >= samples, lower, upper)
        lower, upper = np.clip(lower, 0, samples - 1), np.clip(upper, 0, samples - 1)
        share = np.clip((rows - lower) / np.maximum(upper - lower, 1), 0.0, 1.0)
        return cls(lower, upper, share, np.asarray(finite.any(axis=1, keepdims=True), dtype=np.float64))

    def fill(self, values: Array) -> Array:
        """(W, T, 3) wheel speeds right and left and yaw rate of readings (W, T, 8); 0 where a window has none."""
        chosen = values[..., _FILLED]
        before = np.take_along_axis(chosen, self.lower, axis=1)
        after = np.take_along_axis(chosen, self.upper, axis=1)
        return np.asarray(np.where(self.known > 0.0, (1.0 - self.share) * before + self.share * after, 0.0))


@dataclass(frozen=True, eq=False)
class Course:
    """Where wheel speeds and gyro lead from the start of each window.

    Attributes:
        turning: (W, T) difference of the wheel speeds [rad/s].
        yaw_rate: (W, T) [rad/s].
        speed: (W, T) of the rims [m/s].
        angle: (W, T) turned [rad].
        place: (W, T, 2) in the frame of the start [m].
    """

    turning: Array
    yaw_rate: Array
    speed: Array
    angle: Array
    place: Array

    @classmethod
    def of(cls, values: Array, between: Between, radius: float, period: float) -> Course:
        """Course of readings (W, T, 8)."""
        right, left, rate = np.moveaxis(between.fill(values), 2, 0)
        speed = 0.5 * radius * (right + left)
        angle = _integral(rate, period)
        steps = np.stack([speed * np.cos(angle), speed * np.sin(angle)], axis=2)
        return cls(right - left, rate, speed, angle, _integral(steps, period))


def _integral(values: Array, period: float) -> Array:
    """From the first sample on, by trapezoids along the second axis."""
    found = np.zeros(values.shape)
    np.cumsum(0.5 * period * (values[:, 1:] + values[:, :-1]), axis=1, out=found[:, 1:])
    return found


@dataclass(frozen=True, eq=False)
class RelativeWindows(BlockedWindows):
    """Samples of windows that are compared relative to the recording's own wheel speeds and gyro.

    Attributes:
        radius: hub to tread [m].
        turning: yaw rate per difference of the wheel speeds that is usual, c [-].
    """

    radius: float
    turning: float

    @cached_property
    def between(self) -> Between:
        """Of the measured readings."""
        return Between.of(self.windows.measured)

    @cached_property
    def course(self) -> Course:
        """Measured."""
        return Course.of(np.nan_to_num(self.windows.measured), self.between, self.radius, self.windows.period)

    def differences(self, prediction: Array) -> Array:
        """(W, T, 8) measured less predicted, NaN where there is no sample; headings compared on the circle."""
        difference = self._measured - self._relative(prediction)
        difference[..., _YAW] = np.angle(np.exp(1j * difference[..., _YAW]))
        return difference

    def change(self, after: Array, before: Array) -> Array:
        """(W, M) change of predictions over sigma; what breaks down says nothing."""
        return np.nan_to_num(self.means(self._relative(after) - self._relative(before)))

    def derivative(self, changes: Array, base: Array) -> Array:
        """(W, M) or (W, M, K) of small changes (W, T, 8) or (W, T, 8, K) of a prediction, over sigma."""
        at = self._relative(base)
        if changes.ndim == 3:
            return self.means((self._relative(base + _STEP * changes) - at) / _STEP)
        each = [self.derivative(changes[..., k], base) for k in range(changes.shape[3])]
        return np.stack(each, axis=2)

    @cached_property
    def _measured(self) -> Array:
        """(W, T, 8) what is compared with :meth:`_relative`."""
        found = self.windows.measured.copy()
        found[..., _GYRO] -= self.turning * self.course.turning
        found[..., _YAW] -= self.course.angle
        return found

    def _relative(self, prediction: Array) -> Array:
        """(W, T, 8) prediction relative to its own wheel speeds and gyro."""
        own = Course.of(prediction, self.between, self.radius, self.windows.period)
        found = prediction.copy()
        found[..., _GYRO] -= self.turning * own.turning
        found[..., _SIDEWAYS] -= own.speed * (own.yaw_rate - self.course.yaw_rate)
        found[..., _YAW] -= own.angle
        start = prediction[:, :1, _YAW] - own.angle[:, :1]
        found[..., _PLACE] -= _turned(own.place - self.course.place, start)
        return found


def _turned(places: Array, angle: Array) -> Array:
    """(W, T, 2) turned by (W, 1) [rad]."""
    x, y = places[..., 0], places[..., 1]
    return np.stack([x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle)], axis=2)


def relative_windows(windows: WindowSet, sigma: Array, radius: float, turning: float) -> RelativeWindows:
    """Samples of windows, compared relative to the recording's own wheel speeds and gyro.

    Args:
        windows: all samples.
        sigma: standard deviations of the relative samples, (8,) or anything that broadcasts to (W, T, 8).
        radius: of the wheels, hub to tread [m].
        turning: usual yaw rate per difference of the wheel speeds [-].
    """
    plain = sample_windows(windows, sigma)
    return RelativeWindows(windows, plain.weights, plain.sigma, radius, turning)


def usual_turning(windows: WindowSet) -> float:
    """Yaw rate per difference of the wheel speeds, over all samples of windows (least squares); 0 without either."""
    between = Between.of(windows.measured)
    right, left, rate = np.moveaxis(between.fill(np.nan_to_num(windows.measured)), 2, 0)
    power = float(((right - left) ** 2).sum())
    return float(((right - left) * rate).sum()) / power if power > 0.0 else 0.0
