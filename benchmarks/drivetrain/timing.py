"""When the wheels answer: encoders against the IMU."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.drivetrain.stretches import BANKS
from ddagr_gym.recordings.schema import Recording

Array = NDArray[np.float64]

RISE = 0.3
"""Share of an answer whose time is compared: early, where ground and load have changed the least (ours)."""
SMALLEST = {"turn": 0.5, "straight": 1.0}
"""Answers that are used: yaw rate [rad/s], speed [m/s]; several times what noise and slopes make of them."""
BEFORE, FROM, UNTIL = 0.15, 1.0, 1.5
"""An answer goes from the mean before BEFORE to the mean between FROM and UNTIL after the start of the step [s]."""
GRAVITY_FROM = 3.0
"""From this time of a step on, the accelerometer's median is its offset: the speed has settled [s]."""


def _rise(t: Array, y: Array, smallest: float) -> float:
    """Time at which a step's answer has reached RISE of itself; NaN where it is small or starts at once."""
    first, last = y[t < BEFORE].mean(), y[(t > FROM) & (t < UNTIL)].mean()
    if abs(last - first) < smallest:
        return np.nan
    share = (y - first) / (last - first)
    row = int(np.argmax(share > RISE))
    if row == 0:
        return np.nan
    return float(t[row - 1] + (RISE - share[row - 1]) / (share[row] - share[row - 1]) * (t[row] - t[row - 1]))


def imu_timing(recording: Recording, gyro_sign: float = 1.0) -> dict[str, Any]:
    """By how much the encoders' answer lies after the IMU's, over the steps of a recording in the steps layout.

    Args:
        recording: one step per span.
        gyro_sign: -1 where the gyro is known to be reversed.

    Returns:
        For turns (encoder difference, gyro) and straight driving (mean of the encoders, integrated accelerometer):
        median of the lateness [s], half its interquartile range over the root of the number, that number, and the
        correlation of the two times.
    """
    rows: dict[str, list[tuple[float, float]]] = {"turn": [], "straight": []}
    assert recording.meta.geometry is not None
    radius, track = recording.meta.geometry.wheel_radius, 2.0 * recording.meta.geometry.half_track
    for span in recording.spans():
        t = recording.t[span] - recording.t[span.start]
        encoders = []
        for bank in BANKS:
            values = recording[f"encoder_{bank}"][span]
            known = np.isfinite(values)
            if known.sum() < 2:
                break
            # a value became new between this row and the one before
            encoders.append(np.interp(t, t[known] - 0.5 * recording.period, values[known]))
        if len(encoders) < 2 or t[-1] < GRAVITY_FROM + 1.0:
            continue
        right, left = encoders
        force = recording["specific_force_x"][span]
        speed = np.cumsum(force - np.median(force[t > GRAVITY_FROM])) * recording.period
        turn, straight = SMALLEST["turn"], SMALLEST["straight"]
        scale = track / radius
        rows["turn"].append(
            (_rise(t, right - left, turn * scale), _rise(t, gyro_sign * recording["yaw_rate"][span], turn))
        )
        rows["straight"].append((_rise(t, 0.5 * (right + left), straight / radius), _rise(t, speed, straight)))
    return {kind: _lateness(np.array(pairs)) for kind, pairs in rows.items()}


def _lateness(pairs: Array) -> dict[str, float]:
    pairs = pairs[np.isfinite(pairs).all(axis=1) & (pairs < FROM).all(axis=1)]
    late = pairs[:, 0] - pairs[:, 1]
    quarter = np.percentile(late, [25, 75])
    return {
        "median": float(np.median(late)),
        "error": float(0.93 * (quarter[1] - quarter[0]) / np.sqrt(len(late))),
        "steps": len(late),
        "correlation": float(np.corrcoef(pairs.T)[0, 1]),
    }
