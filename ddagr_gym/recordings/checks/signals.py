"""Signals that several checks share: readings carried forward, integrals, unwrapped headings, standstill."""

from __future__ import annotations

import numpy as np

from ddagr_gym.recordings.checks.row_steps import unbroken
from ddagr_gym.recordings.checks.silences import heard_rows, heard_spans
from ddagr_gym.recordings.row_times import in_bursts
from ddagr_gym.recordings.schema import BoolArray, FloatArray, Recording

STILL_SPEED = 0.02
"""Bank speed below which a wheel counts as at rest [rad/s] (6 mm/s at the rim of a 0.3 m wheel)."""

LONGEST_AGE = 1.0
"""Time before the first reading of a span and after its last beyond which a channel is not known [s] (ours): a sensor
that has stopped. Within it a slow sensor's next reading would come."""


def filled(recording: Recording, name: str) -> FloatArray:
    """Channel with the last reading carried forward inside each heard span.

    NaN before the first reading and after the sensor has stopped.
    """
    values = recording[name]
    out = np.full(len(recording), np.nan)
    for span in heard_spans(recording):
        rows = np.arange(span.start, span.stop)
        last = np.maximum.accumulate(np.where(np.isfinite(values[span]), rows, -1))
        told = (last >= 0) & near_known(recording.t[span], np.isfinite(values[span]))
        out[span] = np.where(told, values[last], np.nan)
    return out


def new_rows(recording: Recording, *names: str) -> BoolArray:
    """Rows with a new sample of any of the channels."""
    return np.asarray(np.any([np.isfinite(recording[name]) for name in names], axis=0))


def integral(recording: Recording, values: FloatArray) -> FloatArray:
    """Trapezoidal integral over time from the start of each heard span; missing values count as interpolated.

    Those of a sensor that has stopped are NaN.
    """
    out = np.full(len(recording), np.nan)
    for span in heard_spans(recording):
        t, known = recording.t[span], np.isfinite(values[span])
        if np.count_nonzero(known) >= 2:
            v = np.interp(t, t[known], values[span][known])
            total = np.concatenate([[0.0], np.cumsum(0.5 * (v[1:] + v[:-1]) * np.diff(t))])
            out[span] = np.where(near_known(t, known), total, np.nan)
    return out


def smoothed(recording: Recording, values: FloatArray, width: float) -> FloatArray:
    """Running mean over ``width`` seconds inside each heard span; NaN near ends, with few values, without a sensor."""
    half = max(1, round(0.5 * width / recording.period))
    out = np.full(len(recording), np.nan)
    for span in heard_spans(recording):
        known = np.isfinite(values[span])
        if np.count_nonzero(known) > max(2 * half, known.size // 2):
            t = recording.t[span]
            total = np.concatenate([[0.0], np.cumsum(np.interp(t, t[known], values[span][known]))])
            mean = (total[2 * half + 1 :] - total[: -2 * half - 1]) / (2 * half + 1)
            told = near_known(t, known)
            out[span.start + half : span.stop - half] = np.where(told[2 * half :] & told[: -2 * half], mean, np.nan)
    return out


def near_known(t: FloatArray, known: BoolArray, at: FloatArray | None = None) -> BoolArray:
    """Times from the first known row of a span to the last, and as far beyond as :data:`LONGEST_AGE`.

    Args:
        t: of the rows (n,) [s].
        known: rows with a reading (n,).
        at: times that are asked for, the rows' own by default [s].
    """
    read, at = t[known], t if at is None else at
    if not read.size:
        return np.zeros(at.shape, dtype=bool)
    return np.asarray((at >= read[0] - LONGEST_AGE) & (at <= read[-1] + LONGEST_AGE))


def slope(recording: Recording, values: FloatArray) -> FloatArray:
    """Central difference over time inside each heard span [per s]; NaN beside missing values.

    Rows of a burst were read a period apart, whatever their stamps.
    """
    out = np.full(len(recording), np.nan)
    for span in heard_spans(recording):
        if span.stop - span.start >= 3:
            t = recording.t[span]
            out[span] = np.gradient(values[span], np.linspace(t[0], t[-1], t.size) if in_bursts(np.diff(t)) else t)
    return out


def wrap(angle: FloatArray) -> FloatArray:
    """Angle in [-pi, pi)."""
    return (angle + np.pi) % (2 * np.pi) - np.pi


def standstills(recording: Recording, margin: float = 0.5, shortest: float = 1.0) -> list[slice]:
    """Pieces of segments in which both banks stand still.

    Args:
        recording: any.
        margin: time after and before motion that is left out [s], for the body to come to rest.
        shortest: least length of a piece [s].

    Returns:
        Slices; none where the recording has no encoders.
    """
    if not recording.has("encoder_right", "encoder_left"):
        return []
    moving = ~_still(recording) | ~heard_rows(recording)
    pieces = []
    for segment in unbroken(recording):
        pieces.extend(_quiet(recording.t, moving, segment, margin, shortest))
    return pieces


def _still(recording: Recording) -> BoolArray:
    """Rows in which both banks stand (n,): by the encoders, or where these are not known by what is commanded.

    In the second before the first reading of a span, which a slow encoder may take, that reading tells too.
    """
    right, left = filled(recording, "encoder_right"), filled(recording, "encoder_left")
    known = np.isfinite(right) & np.isfinite(left)
    still = (np.abs(right) < STILL_SPEED) & (np.abs(left) < STILL_SPEED)
    early = np.zeros(len(recording), dtype=bool)
    for span in heard_spans(recording):
        first = span.start + int(np.argmax(known[span]))
        early[span.start : first] = still[first] & (recording.t[span.start : first] >= recording.t[first] - LONGEST_AGE)
    commands = np.abs(np.stack(recording.held_commands()))
    return np.where(known, still, np.all(commands == 0.0, axis=0) | (early & ~np.any(commands > 0.0, axis=0)))


def _quiet(t: FloatArray, moving: BoolArray, segment: slice, margin: float, shortest: float) -> list[slice]:
    edges = np.flatnonzero(np.diff(np.concatenate([[True], moving[segment], [True]]).astype(int)))
    pieces = []
    for start, stop in zip(edges[::2] + segment.start, edges[1::2] + segment.start, strict=True):
        low = t[start] + (margin if start > segment.start else 0.0)
        high = t[stop - 1] - (margin if stop < segment.stop else 0.0)
        a, b = int(np.searchsorted(t, low)), int(np.searchsorted(t, high, side="right"))
        if b - a >= 8 and t[b - 1] - t[a] >= shortest:
            pieces.append(slice(a, b))
    return pieces


def moving_mask(recording: Recording) -> BoolArray:
    """Rows in which a bank turns or the gyro shows a turn well above its noise at rest.

    Those in which a sensor of a robot that is commanded to move is silent count with them.
    """
    right, left = filled(recording, "encoder_right"), filled(recording, "encoder_left")
    turning = np.nan_to_num(np.maximum(np.abs(right), np.abs(left))) >= STILL_SPEED
    return turning | (np.nan_to_num(np.abs(recording["yaw_rate"])) > 0.1) | ~heard_rows(recording)
