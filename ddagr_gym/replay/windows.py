"""Cutting recordings into windows of equal length."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.schema import Recording

Array = NDArray[np.float64]

CHANNELS = (
    "specific_force_x",
    "specific_force_y",
    "yaw_rate",
    "encoder_right",
    "encoder_left",
    "pose_x",
    "pose_y",
    "pose_yaw",
)
"""Channels that the simulator predicts, in the order of ``layout.READINGS``."""

STATE = ("x", "y", "yaw", "v_x", "v_y", "yaw_rate", "omega_right", "omega_left")
"""Initial state of a window; the first three only shift the pose while the ground is the same everywhere."""

PERIOD_TOLERANCE = 0.02
"""Relative difference of sample periods that still counts as equal."""


@dataclass(frozen=True, eq=False)
class WindowSet:
    """W windows of T samples after their start.

    Attributes:
        period: between samples [s].
        recording: (W,) index of the recording that each came from.
        start: (W,) row of the recording at which it starts.
        time: (W,) recording time at the start [s].
        commands: (W, T + H, 2) right and left commands [rad/s]; command [H + k] is in force in the period that ends
            at sample k, the first H belong to the past (for delays).
        history: H.
        measured: (W, T, 8) in the order of CHANNELS, NaN where there is no new sample.
        initial: (W, 8) first guess of STATE at the start.
    """

    period: float
    recording: NDArray[np.int64]
    start: NDArray[np.int64]
    time: Array
    commands: Array
    history: int
    measured: Array
    initial: Array

    @property
    def count(self) -> int:
        """W."""
        return len(self.start)

    @property
    def samples(self) -> int:
        """T."""
        return int(self.measured.shape[1])

    def subset(self, chosen: NDArray[np.int64] | NDArray[np.bool_]) -> WindowSet:
        """Only the chosen windows."""
        names = ("recording", "start", "time", "commands", "measured", "initial")
        return replace(self, **{name: getattr(self, name)[chosen] for name in names})


def cut_windows(
    recordings: Sequence[Recording],
    duration: float,
    *,
    stride: float | None = None,
    wheel_radius: float,
    half_track: float,
    drive_by: str = "commands",
    history: float = 0.5,
) -> WindowSet:
    """Windows of ``duration`` inside the segments of recordings of one sample period.

    Args:
        recordings: of one robot.
        duration: of a window [s].
        stride: between starts [s]; ``duration`` by default.
        wheel_radius: for the first guess of the speed [m].
        half_track: for the first guess of the yaw rate where no gyro is [m].
        drive_by: "commands", or "encoders" to impose the recorded wheel speeds.
        history: commands kept from before the start [s].

    Raises:
        InputError: periods differ, no window fits, or commands or encoders are absent.
    """
    period = _common_period(recordings)
    samples = max(int(round(duration / period)), 2)
    step = samples if stride is None else max(int(round(stride / period)), 1)
    past = int(round(history / period))
    parts = []
    for number, recording in enumerate(recordings):
        drive = _drive(recording, drive_by)
        for segment in recording.segments():
            for first in range(segment.start, segment.stop - samples, step):
                part = _window(recording, number, drive, first, samples, past, segment.start)
                if part is not None:
                    parts.append(part)
    if not parts:
        names = ", ".join(r.meta.source for r in recordings)
        raise InputError(f"{names}: no window of {duration:g} s fits into valid {drive_by}: choose a shorter one.")
    number_, start, time, commands, measured = (np.array(column) for column in zip(*parts, strict=True))
    initial = np.stack(
        [_guess(recordings[n], int(s), wheel_radius, half_track) for n, s in zip(number_, start, strict=True)]
    )
    return WindowSet(period, number_, start, time, commands, past, measured, initial)


def _common_period(recordings: Sequence[Recording]) -> float:
    periods = np.array([recording.period for recording in recordings])
    if not len(periods) or not np.isfinite(periods).all():
        raise InputError("no recording with at least two rows was given: nothing can be replayed.")
    if np.ptp(periods) > PERIOD_TOLERANCE * periods[0]:
        raise InputError(f"the recordings have periods {periods.tolist()} s: replay those of one rate together.")
    return float(np.median(periods))


def _drive(recording: Recording, drive_by: str) -> Array:
    """(n, 2) right and left speeds that drive the simulator; NaN where unknown."""
    if drive_by == "commands":
        return np.stack(recording.held_commands(), axis=1)
    if drive_by != "encoders":
        raise InputError(f"drive_by is {drive_by!r}: give 'commands' or 'encoders'.")
    return np.stack([_interpolated(recording, name) for name in ("encoder_right", "encoder_left")], axis=1)


def _interpolated(recording: Recording, name: str, gap: float = 0.6) -> Array:
    """Channel with missing samples filled linearly inside spans; NaN beyond ``gap`` [s] from a sample."""
    filled = np.full(len(recording), np.nan)
    for span in recording.spans():
        values, t = recording[name][span], recording.t[span]
        known = np.isfinite(values)
        if not known.any():
            continue
        near = np.abs(t[:, None] - t[known][np.searchsorted(t[known], t).clip(1, known.sum() - 1)[:, None] + [-1, 0]])
        line = np.interp(t, t[known], values[known])
        filled[span] = np.where(near.min(axis=1) <= gap, line, np.nan)
    return filled


def _window(
    recording: Recording, number: int, drive: Array, first: int, samples: int, past: int, earliest: int
) -> tuple[int, int, float, Array, Array] | None:
    rows = np.arange(first + 1 - past, first + 1 + samples)
    commands = drive[np.maximum(rows, earliest)]
    if not np.isfinite(commands[past:]).all():
        return None
    # before the first known command of the segment the robot is taken to have had that one
    known = np.isfinite(commands).all(axis=1)
    commands = commands[np.maximum.accumulate(np.where(known, np.arange(len(rows)), np.argmax(known)))]
    inside = slice(first + 1, first + 1 + samples)
    measured = np.stack([recording[name][inside] for name in CHANNELS], axis=1)
    return number, first, float(recording.t[first]), commands, measured


def _guess(recording: Recording, row: int, wheel_radius: float, half_track: float) -> Array:
    """Initial state from the samples around the start."""
    value = {name: _near(recording, name, row) for name in CHANNELS}
    right, left = value["encoder_right"], value["encoder_left"]
    yaw_rate = value["yaw_rate"]
    if not np.isfinite(yaw_rate):
        yaw_rate = wheel_radius * (right - left) / (2.0 * half_track) / 1.5
    speed = wheel_radius * (right + left) / 2.0
    state = np.array(
        [value["pose_x"], value["pose_y"], value["pose_yaw"], speed, 0.0, yaw_rate, right, left], dtype=np.float64
    )
    return np.nan_to_num(state)


def _near(recording: Recording, name: str, row: int, reach: int = 12) -> float:
    """Channel at ``row``, interpolated between its samples within ``reach`` rows of the same span."""
    span = next(s for s in recording.spans() if s.start <= row < s.stop)
    rows = slice(max(span.start, row - reach), min(span.stop, row + reach + 1))
    values, t = recording[name][rows], recording.t[rows]
    known = np.isfinite(values)
    return float(np.interp(recording.t[row], t[known], values[known])) if known.any() else np.nan
