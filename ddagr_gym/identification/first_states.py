"""First guess of the state at which a window starts, from the readings around its start."""

from __future__ import annotations

from bisect import bisect_right

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.recordings.continued import RowsOfSegment
from ddagr_gym.recordings.schema import Recording

Array = NDArray[np.float64]

ROWS = 12
"""Rows to either side of a start from which its state is guessed (ours): poses at 5 Hz come every ten rows at 50 Hz."""

_POSE = ("pose_x", "pose_y", "pose_yaw")


def guess_state(
    recording: Recording, row: int, rows: RowsOfSegment, drive: Array, wheel_radius: float, half_track: float
) -> Array:
    """State (8,) at a row, in the order of ``STATE``; without encoders the banks turn as they are driven.

    Args:
        recording: that the row is of.
        row: at which a window starts.
        rows: of its segment, with those before it, whose wheel speeds count too.
        drive: (2,) right and left speeds that drive the simulator there [rad/s].
        wheel_radius: [m].
        half_track: for the yaw rate where no gyro is [m].
    """
    near = _rows_near(recording, row)
    x, y, yaw = (_near(recording, name, row, near) for name in _POSE)
    banks = [_speed_near(recording, f"encoder_{bank}", row, rows, near) for bank in ("right", "left")]
    right, left = (speed if np.isfinite(speed) else drive[n] for n, speed in enumerate(banks))
    yaw_rate = _near(recording, "yaw_rate", row, near)
    if not np.isfinite(yaw_rate):
        yaw_rate = wheel_radius * (right - left) / (2.0 * half_track) / 1.5
    speed = wheel_radius * (right + left) / 2.0
    return np.nan_to_num(np.array([x, y, yaw, speed, 0.0, yaw_rate, right, left], dtype=np.float64))


def _speed_near(recording: Recording, name: str, row: int, rows: RowsOfSegment, near: slice) -> float:
    """A bank speed at ``row``; where the drive went on from an earlier step, between its reading and the first here."""
    around = np.arange(row - ROWS, row + ROWS + 1)
    if around[0] >= rows.segment.start or not len(rows.before):
        return _near(recording, name, row, near)
    at, known = rows.at(around)
    known &= around < rows.segment.stop
    at[1:] = np.where(at[1:] == at[:-1], -1, at[1:])
    known &= at >= 0
    values = recording[name][at[known]]
    read = np.isfinite(values)
    return float(np.interp(row, around[known][read], values[read])) if read.any() else np.nan


def _near(recording: Recording, name: str, row: int, rows: slice) -> float:
    """Channel at ``row``, interpolated between its samples in ``rows``; NaN without any."""
    if name not in recording.channels:
        return np.nan
    values, t = recording.channels[name][rows], recording.t[rows]
    known = np.isfinite(values)
    return float(np.interp(recording.t[row], t[known], values[known])) if known.any() else np.nan


def _rows_near(recording: Recording, row: int) -> slice:
    """Rows of the span near ``row``."""
    starts = [a for a, _ in recording.meta.spans]
    first, stop = recording.meta.spans[bisect_right(starts, row) - 1]
    return slice(max(first, row - ROWS), min(stop, row + ROWS + 1))
