"""Errors at the end of a window: how far a prediction has drifted after so many seconds.

Headings and yaw rates are judged by the gyro, which is exact over seconds; position, speed and once more heading by
the poses, whose time is uncertain; bank speeds by the encoders. A window starts at the state that the samples around
its start suggest, the same for every model. Where poses have no headings, such as fixes of a satellite receiver, the
start's heading is their course.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.frames import rotation_matrix, wrap_angle
from ddagr_gym.identification.windows import CHANNELS, WindowSet

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

HORIZONS = (1.0, 5.0, 30.0)
"""[s] (ours): a manoeuvre's beginning, a turn, and a row; each about five times the one before."""

METRICS = {
    "heading": ("rad", "change of heading, by the integrated gyro"),
    "yaw_rate": ("rad/s", "mean yaw rate over the last 0.5 s, by the gyro"),
    "heading_pose": ("rad", "change of heading, by the poses"),
    "position": ("m", "distance from the pose"),
    "speed": ("m/s", "mean speed over the last second, by the poses"),
    "wheel_speed": ("rad/s", "bank speeds over the last 0.5 s, by the encoders, root mean square of both"),
}
"""Unit and meaning of every metric."""

LAST = 0.5
"""Time before a horizon over which rates are averaged [s] (ours): vibration averages out."""
SPEED_TIME = 1.0
"""Time over which a speed is taken from poses [s] (ours): five poses at 5 Hz."""
LEAST_GYRO_SHARE = 0.9
"""Of the samples of the window with the most, what an integral of the gyro needs (ours)."""
LEAST_WAY = 0.5
"""On which a course is the heading [m] (ours): twenty times the scatter of a good satellite fix."""

_GYRO = CHANNELS.index("yaw_rate")
_ENCODERS = [CHANNELS.index("encoder_right"), CHANNELS.index("encoder_left")]
_XY = [CHANNELS.index("pose_x"), CHANNELS.index("pose_y")]
_YAW = CHANNELS.index("pose_yaw")


def horizon_errors(windows: WindowSet, prediction: Array) -> dict[str, Array]:
    """Errors (W,) by name of METRICS, prediction less measurement; NaN where nothing measures them.

    Args:
        windows: as long as the horizon.
        prediction: (W, T, 8), from the windows' first guess.
    """
    last = slice(-max(round(LAST / windows.period), 1), None)
    gyro = prediction[..., _GYRO] - windows.measured[..., _GYRO]
    wheels = (prediction - windows.measured)[:, last][..., _ENCODERS]
    return {
        "heading": integrated(gyro, windows.period),
        "yaw_rate": _mean(gyro[:, last]),
        **_pose_errors(windows, prediction),
        "wheel_speed": np.sqrt(_mean((wheels**2).reshape(windows.count, -1))),
    }


def integrated(rate: Array, period: float) -> Array:
    """Integral over each window (W,) of rates (W, T), NaN where too many are missing."""
    return np.asarray(_turned(rate, period)[:, -1])


def heading_growth(windows: WindowSet, prediction: Array) -> Array:
    """Root mean square heading error over the windows after each sample, (T,) [rad], by the gyro."""
    errors = _turned(prediction[..., _GYRO] - windows.measured[..., _GYRO], windows.period)
    known = np.isfinite(errors[:, -1])
    if not known.any():
        return np.full(windows.samples, np.nan)
    return np.asarray(np.sqrt(np.mean(errors[known] ** 2, axis=0)))


def _turned(rate: Array, period: float) -> Array:
    """Integral of rates (W, T) until each sample; between samples they change evenly, NaN where too many are missing.

    A sensor that is slower than the rows has its own rate in every window.
    """
    known = np.isfinite(rate)
    count = known.sum(axis=1)
    turned = np.full(rate.shape, np.nan)
    for w in np.flatnonzero((count > 0) & (count >= LEAST_GYRO_SHARE * count.max(initial=0))):
        places = np.flatnonzero(known[w])
        turned[w] = period * np.cumsum(np.interp(np.arange(rate.shape[1]), places, rate[w, places]))
    return turned


def _mean(values: Array) -> Array:
    """Mean along the last axis without NaN; NaN where there is nothing else."""
    known = np.isfinite(values)
    count = known.sum(axis=-1)
    return np.where(count > 0, np.where(known, values, 0.0).sum(axis=-1) / np.maximum(count, 1), np.nan)


def _pose_errors(windows: WindowSet, prediction: Array) -> dict[str, Array]:
    """Heading, position and speed errors; the start's heading comes from all poses of a window through the gyro.

    Where nothing tells that heading there is no error of position.
    """
    errors = {name: np.full(windows.count, np.nan) for name in ("heading_pose", "position", "speed")}
    known = np.asarray(np.isfinite(windows.measured[..., _XY]).all(axis=-1))
    reach, back = round(LAST / windows.period), round(SPEED_TIME / windows.period)
    start_heading = start_headings(windows)
    for w in range(windows.count):
        rows = np.flatnonzero(known[w])
        if rows.size < 3 or rows[0] > reach or rows[-1] < windows.samples - 1 - reach:
            continue
        end = rows[-1]
        turn = start_heading[w] - windows.initial[w, 2]
        rotation = rotation_matrix(0.0 if np.isnan(turn) else turn)
        moved = (prediction[w][:, _XY] - windows.initial[w, :2]) @ rotation.T
        measured = windows.measured[w][:, _XY] - windows.initial[w, :2]
        if np.isfinite(turn):
            errors["position"][w] = np.hypot(*(moved[end] - measured[end]))
            change = windows.measured[w, end, _YAW] - start_heading[w]
            errors["heading_pose"][w] = wrap_angle(prediction[w, end, _YAW] - windows.initial[w, 2] - change)
        earlier = rows[np.argmin(np.abs(rows - (end - back)))]
        if end > earlier:
            distance = np.hypot(*(moved[end] - moved[earlier])) - np.hypot(*(measured[end] - measured[earlier]))
            errors["speed"][w] = distance / ((end - earlier) * windows.period)
    return errors


def start_headings(windows: WindowSet) -> Array:
    """Heading at the start (W,) [rad]: circular mean over the window's poses less what the gyro turned until them.

    Without a gyro the first guess. Where no pose has a heading, by the course; NaN where that tells none either.
    """
    yaw = windows.measured[..., _YAW]
    known = np.isfinite(yaw)
    turned = _turned(windows.measured[..., _GYRO], windows.period)
    with_gyro = np.isfinite(turned[:, -1])
    start = np.where(known, np.exp(1j * (np.nan_to_num(yaw) - np.nan_to_num(turned))), 0.0).sum(axis=1)
    heading = np.where(with_gyro, np.angle(start), windows.initial[:, 2])
    found = np.where(known.any(axis=1), heading, np.nan)
    for w in np.flatnonzero(with_gyro & ~known.any(axis=1)):
        found[w] = _start_course(windows.measured[w], turned[w])
    return found


def _start_course(measured: Array, turned: Array) -> float:
    """Heading at the start [rad] with which a robot that does not slip sideways goes from fix to fix; NaN for no way.

    Args:
        measured: (T, 8) of one window.
        turned: (T,) since the start [rad].
    """
    fixes = np.flatnonzero(np.isfinite(measured[:, _XY]).all(axis=1))
    rolled = np.nan_to_num(_mean(measured[:, _ENCODERS]))
    way = 0.0j
    for a, b in pairwise(fixes.tolist()):
        step = complex(*(measured[b, _XY] - measured[a, _XY]))
        way += np.sign(rolled[a : b + 1].sum()) * step * np.exp(-0.5j * (turned[a] + turned[b]))
    return float(np.angle(way)) if abs(way) >= LEAST_WAY else math.nan


def sample_errors(windows: WindowSet, prediction: Array, channels: Sequence[int]) -> tuple[Array, Integers]:
    """Errors of all samples of some channels, NaN where there is no reading, and the window of each.

    Args:
        windows: that were predicted.
        prediction: (W, T, 8).
        channels: their numbers.

    Returns:
        Errors and windows, both (W T C,): errors in one window belong together.
    """
    errors = (prediction - windows.measured)[..., list(channels)].reshape(windows.count, -1)
    return errors.ravel(), np.repeat(np.arange(windows.count), errors.shape[1])
