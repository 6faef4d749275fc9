"""Slope of each ground, by what accelerometers read beside the motion that wheel speeds and gyro tell.

The joint fit leaves the accelerometers out, and on ground that slopes by some per cent its robot is none that they
agree with: gravity turns round in their readings with the heading, and pulls the robot downhill. With the gradient s of
the ground along the world's axes, the heading psi, the speed v of the rims, the yaw rate r and what the sensors of
drive d read too much, b_d, means over a second of the specific force are (theory: wheel model, eq. (23))

    f = [dv/dt, v r] + g R(-psi) s + b_d.                                                                            (1)

Side slip and slip errors do not turn with the heading and stay in the rest. The gradient is fitted with a robust loss;
its covariance is that of a jackknife over the quarters of all drives. It is kept where it is surely there and large
enough to matter, and only on grounds whose drives have headings in one frame.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.change.ground_slope import GroundSlope
from ddagr_gym.identification.data_split import parts_of_time
from ddagr_gym.identification.least_squares import huber_roots
from ddagr_gym.identification.residual_weights import MAD_TO_DEVIATION
from ddagr_gym.identification.windows import CHANNELS, STATE, WindowSet
from ddagr_gym.parameters import STANDARD_GRAVITY
from ddagr_gym.recordings.pose_frames import in_one_frame
from ddagr_gym.recordings.schema import Recording

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

BLOCK = 1.0
"""Over which readings are averaged [s] (ours): vibration and the differences of wheel speeds go."""

FEWEST = 40
"""Block means below which a ground says nothing (ours)."""

QUARTERS = 4
"""Parts of each drive that are left out in turn."""

LIMIT = 1.5
"""Residual from which the loss is linear, in deviations (ours: Huber's 95 % efficiency is at 1.35)."""

ITERATIONS = 20
"""Of the weights of the robust loss (ours): they settle in five."""

CONFIDENCE = 0.99
"""With which a gradient must differ from none (ours): a slope that is kept is in every later comparison."""


@dataclass(frozen=True, eq=False)
class Readings:
    """Block means on one ground.

    Attributes:
        force: (N, 2) specific force beside the motion [m/s^2].
        heading: (N,) [rad].
        drive: (N,) number of the drive.
        part: (N,) which part is left out in the jackknife, all drives counted through.
    """

    force: Array
    heading: Array
    drive: Integers
    part: Integers


def slopes_of(
    recordings: Sequence[Recording], windows: WindowSet, grounds: Mapping[str, Sequence[int]], radius: float
) -> dict[str, GroundSlope]:
    """Slopes of the grounds that surely do; none of the others.

    Args:
        recordings: drives.
        windows: of them.
        grounds: numbers of the drives by ground.
        radius: of the wheels, hub to tread [m].
    """
    found = {}
    for ground, drives in grounds.items():
        if not in_one_frame([recordings[number] for number in drives]):
            continue
        slope = slope_from(readings_of(windows.subset(np.isin(windows.recording, drives)), radius))
        if slope is not None:
            found[ground] = slope
    return found


def readings_of(windows: WindowSet, radius: float) -> Readings:
    """Block means of windows, where wheel speeds, gyro and accelerometer have all samples.

    Args:
        windows: on one ground.
        radius: of the wheels, hub to tread [m].
    """
    channel = {name: windows.measured[..., k] for k, name in enumerate(CHANNELS)}
    speed = 0.5 * radius * (channel["encoder_right"] + channel["encoder_left"])
    rate, step = channel["yaw_rate"], windows.period
    start = windows.initial[:, STATE.index("yaw")]
    heading = start[:, None] + step * (np.cumsum(np.nan_to_num(rate), axis=1) - 0.5 * np.nan_to_num(rate))
    length = max(2, round(BLOCK / step))
    starts = range(0, windows.samples - length + 1, length)
    force, headings = [], []
    for first in starts:
        rows = slice(first, first + length)
        gained = (speed[:, first + length - 1] - speed[:, first]) / ((length - 1) * step)
        forward = channel["specific_force_x"][:, rows].mean(axis=1) - gained
        sideways = (channel["specific_force_y"][:, rows] - speed[:, rows] * rate[:, rows]).mean(axis=1)
        force.append(np.stack([forward, sideways], axis=1))
        headings.append(heading[:, rows].mean(axis=1))
    if not force:
        return Readings(np.zeros((0, 2)), np.zeros(0), np.zeros(0, np.int64), np.zeros(0, np.int64))
    all_force, all_headings = np.concatenate(force), np.concatenate(headings)
    drive, part = (np.tile(item, len(force)) for item in (windows.recording, _parts(windows)))
    known = np.isfinite(all_force).all(axis=1) & np.isfinite(all_headings)
    return Readings(all_force[known], all_headings[known], drive[known], part[known])


def _parts(windows: WindowSet) -> Integers:
    """(W,) quarter of its drive that a window is in, all drives counted through."""
    found = np.zeros(windows.count, dtype=np.int64)
    for number in np.unique(windows.recording):
        rows = windows.recording == number
        time = windows.time[rows]
        found[rows] = QUARTERS * number + parts_of_time(time, time, QUARTERS)
    return found


def slope_from(readings: Readings) -> GroundSlope | None:
    """Slope by block means; None where it is not surely there, or too small to matter.

    Args:
        readings: on one ground.
    """
    from scipy.special import fdtri

    parts = np.unique(readings.part)
    if len(readings.heading) < FEWEST or len(parts) < QUARTERS:
        return None
    whole = _gradient(readings, np.ones(len(readings.heading), dtype=bool))
    left_out = np.array([_gradient(readings, readings.part != part) for part in parts])
    count = len(parts)
    away = left_out - left_out.mean(axis=0)
    covariance = (count - 1.0) / count * away.T @ away
    # Hotelling's T^2 of two components with count - 1 degrees of freedom
    size = float(whole @ np.linalg.solve(covariance + np.diag([1e-12, 1e-12]), whole))
    limit = 2.0 * (count - 1.0) / (count - 2.0) * float(fdtri(2, count - 2, CONFIDENCE))
    found = GroundSlope.estimated(whole.tolist(), np.sqrt(np.diag(covariance)).tolist())
    return found if size > limit and found.matters else None


def _gradient(readings: Readings, rows: NDArray[np.bool_]) -> Array:
    """(2,) gradient by some block means, equation (1) by iteratively weighted least squares."""
    heading, drive = readings.heading[rows], readings.drive[rows]
    cosine, sine = STANDARD_GRAVITY * np.cos(heading), STANDARD_GRAVITY * np.sin(heading)
    numbers = np.unique(drive)
    own = (drive[:, None] == numbers).astype(np.float64)
    none = np.zeros_like(own)
    forward = np.column_stack([cosine, sine, own, none])
    sideways = np.column_stack([-sine, cosine, none, own])
    matrix, right = np.concatenate([forward, sideways]), readings.force[rows].T.ravel()
    root = np.ones(len(right))
    values = np.zeros(matrix.shape[1])
    for _ in range(ITERATIONS):
        values = np.linalg.lstsq(root[:, None] * matrix, root * right, rcond=None)[0]
        rest = right - matrix @ values
        scale = MAD_TO_DEVIATION * float(np.median(np.abs(rest)))
        if scale == 0.0:
            break
        root = huber_roots(rest / scale, LIMIT)
    return values[:2]
