"""Where residuals of left-out drives are: their spectrum, and their share under each condition of the drive."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.calibration.forecast_errors import Forecasts
from ddagr_gym.calibration.result import CALIBRATED, DATA_SHEET, Spectrum, Unexplained
from ddagr_gym.identification.residual_weights import residuals
from ddagr_gym.identification.signals import on_lines
from ddagr_gym.identification.windows import CHANNELS, WindowSet
from ddagr_gym.recordings.channels import CHANNELS as SCHEMA

Array = NDArray[np.float64]
Booleans = NDArray[np.bool_]

SHARP_CHANGE = 0.2
"""Change of a bank's command that counts as a step [rad/s] (ours)."""

AFTER_STEP = (0.0, 0.5, 1.0, 2.0, 4.0)
"""Edges of the times since a step of the commands in which residuals are compared [s] (ours)."""

TURNING = 0.5
"""Difference of the banks' commands over the larger one from which a robot counts as turning [-] (ours)."""

GROUPS = {"wheel_speed": ("encoder_right", "encoder_left"), "yaw_rate": ("yaw_rate",)}
"""Channels that are looked at."""

FEWEST = 8
"""Samples of a channel in a window from which its spectrum is taken (ours)."""


def spectra(forecasts: Sequence[Forecasts]) -> tuple[Spectrum, ...]:
    """Power spectral densities of the residuals before and after, mean over windows of all left-out drives.

    A channel that comes more seldom than the rows is taken along lines between its samples, up to half its own rate.
    """
    found = []
    for name in ("yaw_rate", "encoder_right", "encoder_left"):
        channel = CHANNELS.index(name)
        both = [
            [_density(item.windows, item.predictions[model], channel) for item in forecasts]
            for model in (DATA_SHEET, CALIBRATED)
        ]
        if not any(density.size for density in both[0]):
            continue
        before, after = (np.concatenate([d for d in one if d.size]).mean(axis=0) for one in both)
        windows = forecasts[0].windows
        frequency = np.fft.rfftfreq(windows.samples, windows.period)[1:]
        kept = frequency <= 0.5 * _rate(forecasts, channel)
        lists = (tuple(values[kept].tolist()) for values in (frequency, before, after))
        found.append(Spectrum(name, SCHEMA[name].unit, *lists))
    return tuple(found)


def _rate(forecasts: Sequence[Forecasts], channel: int) -> float:
    """Samples per second of a channel."""
    known = sum(int(np.isfinite(item.windows.measured[..., channel]).sum()) for item in forecasts)
    return known / sum(item.windows.count * item.windows.duration for item in forecasts)


def _density(windows: WindowSet, prediction: Array, channel: int) -> Array:
    """(W, F) periodograms [unit^2/Hz] with a Hann window, without the mean."""
    left = residuals(windows, prediction)[..., channel]
    rows = np.arange(windows.samples, dtype=np.float64)
    kept = [on_lines(rows, values) for values in left if np.isfinite(values).sum() >= FEWEST]
    if not kept:
        return np.zeros((0, windows.samples // 2))
    taper = np.hanning(windows.samples)
    values = np.stack(kept)
    spectrum = np.fft.rfft((values - values.mean(axis=1, keepdims=True)) * taper, axis=1)[:, 1:]
    return np.asarray(2.0 * windows.period * np.abs(spectrum) ** 2 / float(taper @ taper))


def unexplained(forecasts: Sequence[Forecasts], sigma: Array) -> tuple[Unexplained, ...]:
    """Shares of the calibrated simulator's squared residuals by condition.

    Args:
        forecasts: of all left-out drives.
        sigma: (8,) noise of the channels.
    """
    found = []
    for name, channels in GROUPS.items():
        columns = [CHANNELS.index(channel) for channel in channels]
        squares = [residuals(f.windows, f.predictions[CALIBRATED])[..., columns] ** 2 for f in forecasts]
        whole = sum(float(np.nansum(s)) for s in squares)
        samples = sum(int(np.isfinite(s).sum()) for s in squares)
        noise = float(sigma[columns].max())
        conditions = [list(_conditions(f.windows)) for f in forecasts]
        for k, (text, _) in enumerate(conditions[0]):
            inside = [
                s[np.broadcast_to(c[k][1][..., None], s.shape) & np.isfinite(s)]
                for s, c in zip(squares, conditions, strict=True)
            ]
            values = np.concatenate(inside)
            if values.size and whole > 0.0:
                size = float(np.sqrt(values.mean()))
                found.append(Unexplained(name, text, float(values.sum()) / whole, values.size / samples, size, noise))
    return tuple(found)


def _conditions(windows: WindowSet) -> Iterator[tuple[str, Booleans]]:
    """Conditions in words and where they hold (W, T)."""
    commands = windows.commands[:, windows.history : windows.history + windows.samples]
    since = _since_step(windows)
    for low, high in pairwise(AFTER_STEP):
        yield f"{low:g} to {high:g} s after a step of the commands", (since >= low) & (since < high)
    yield f"more than {AFTER_STEP[-1]:g} s after a step", since >= AFTER_STEP[-1]
    turning = np.abs(commands[..., 0] - commands[..., 1]) > TURNING * np.abs(commands).max(axis=-1)
    yield "turning", turning
    yield "going straight", ~turning


def _since_step(windows: WindowSet) -> Array:
    """(W, T) time since the last step of a command [s], from the kept past on."""
    every = windows.commands[:, : windows.history + windows.samples]
    changed = np.zeros(every.shape[:2], dtype=bool)
    changed[:, 1:] = (np.abs(np.diff(every, axis=1)) > SHARP_CHANGE).any(axis=2)
    rows = np.arange(every.shape[1])
    last = np.maximum.accumulate(np.where(changed, rows, -(10**6)), axis=1)
    return np.asarray(((rows - last) * windows.period)[:, windows.history :])
