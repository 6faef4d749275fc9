"""Signals that several estimates need: missing samples on lines, travel speed, rows of steady commands."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.recordings.schema import Recording

Array = NDArray[np.float64]

_STEADY = 0.8
"""Time without a change of command after which a robot's motion counts as steady [s]: four time constants."""

_STEADY_CHANGE = 0.02
"""Change of a bank's command that still counts as none [rad/s] (ours)."""

_FARTHEST_SAMPLE = 0.6
"""Time to the next wheel speed up to which one in between is interpolated [s] (ours: encoders that come at 1 Hz)."""

_GUESS_ROWS = 12
"""Rows to either side of a start from which its state is guessed (ours: poses at 5 Hz come every ten rows at 50 Hz)."""


def travel_speed(recording: Recording, wheel_radius: float) -> Array:
    """Rim speed (n,) averaged over the banks [m/s], from the encoders or else the commands; 0 where unknown.

    Encoders that come more seldom than the rows are taken along lines between their samples.
    """
    names = ("encoder_right", "encoder_left")
    has_encoders = recording.has(*names)
    banks = [interpolated(recording, name) for name in names] if has_encoders else recording.held_commands()
    return np.nan_to_num(wheel_radius * 0.5 * (np.abs(banks[0]) + np.abs(banks[1])))


def on_lines(t: Array, values: Array) -> Array:
    """Values (n,) at times (n,) with the missing ones on lines between the others; 0 where all are missing."""
    known = np.isfinite(values)
    if known.all():
        return values
    return np.interp(t, t[known], values[known]) if known.any() else np.zeros(len(values))


def interpolated(recording: Recording, name: str) -> Array:
    """Channel (n,) with its missing samples on lines between the others of their span; 0 where a span has none."""
    values = np.zeros(len(recording))
    for span in recording.spans():
        values[span] = on_lines(recording.t[span], recording[name][span])
    return values


def steady_rows(recording: Recording) -> NDArray[np.bool_]:
    """(n,) rows at which the commands have not changed for a while, so that what changes in a reading is noise."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    size = max(round(_STEADY / recording.period), 1)
    steady = np.ones(len(recording), dtype=bool)
    for command in recording.held_commands():
        known = np.nan_to_num(command)
        highest = maximum_filter1d(known, size, origin=(size - 1) // 2)
        lowest = minimum_filter1d(known, size, origin=(size - 1) // 2)
        steady &= highest - lowest < _STEADY_CHANGE
    return steady


def bank_speeds(recording: Recording) -> Array:
    """(n, 2) speeds of both banks, right and left, on lines between their samples; NaN where unknown [rad/s]."""
    return np.stack([_near_samples(recording, name) for name in ("encoder_right", "encoder_left")], axis=1)


def _near_samples(recording: Recording, name: str) -> Array:
    """Channel with missing samples filled linearly inside spans; NaN far from a sample."""
    filled = np.full(len(recording), np.nan)
    for span in recording.spans():
        values, t = recording[name][span], recording.t[span]
        known = np.isfinite(values)
        if not known.any():
            continue
        near = np.abs(t[:, None] - t[known][np.searchsorted(t[known], t).clip(1, known.sum() - 1)[:, None] + [-1, 0]])
        line = np.interp(t, t[known], values[known])
        filled[span] = np.where(near.min(axis=1) <= _FARTHEST_SAMPLE, line, np.nan)
    return filled
