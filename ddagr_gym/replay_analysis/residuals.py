"""Residuals of a prediction: per channel, and in bins of slip, yaw rate, speed, heading and time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.frames import wrap_angle
from ddagr_gym.identification.residual_weights import successive_correlation
from ddagr_gym.identification.windows import CHANNELS, WindowSet
from ddagr_gym.physics import layout
from ddagr_gym.recordings.channels import CHANNELS as SCHEMA

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

BIN_QUANTITIES = {
    "slip": ("-", "mean size of the four wheels' slip ratios, predicted"),
    "yaw_rate": ("rad/s", "predicted"),
    "speed": ("m/s", "forward, predicted"),
    "heading": ("rad", "predicted, in the pose's frame"),
    "time": ("s", "of the recording"),
}
"""Quantities in whose bins residuals are averaged: unit and meaning."""

RECORDED = (*range(layout.SLIP_RATIO, layout.SLIP_RATIO + 4), layout.YAW_RATE, layout.V_X, layout.YAW)
"""Entries of the simulator's row that :func:`bin_values` needs from :meth:`WindowModel.predict_recorded`."""

BINS = 12
"""Most bins of a quantity (ours): as many as a small panel shows."""
LEAST_IN_BIN = 20
"""Fewest residuals in a bin (ours)."""


@dataclass(frozen=True)
class ChannelResidual:
    """Residual of one channel, measurement less prediction, over windows with free initial states.

    Attributes:
        channel: of CHANNELS.
        unit: of the channel.
        count: samples.
        rms: root mean square.
        bias: mean.
        correlation: of successive samples in a window [-].
        noise: standard deviation of the sensor and of vibration.
        relative: rms over noise; 1 where nothing is left to explain.
    """

    channel: str
    unit: str
    count: int
    rms: float
    bias: float
    correlation: float
    noise: float
    relative: float


@dataclass(frozen=True)
class ResidualBins:
    """Mean residual of a channel in bins of one quantity of the drive; all bins hold about as many samples.

    Attributes:
        channel: of CHANNELS.
        against: the quantity, of BIN_QUANTITIES.
        unit: of ``against``.
        centres: median of the quantity in each bin.
        means: mean residual in each bin.
        deviations: standard errors of the means, clustered by window.
        counts: samples in each bin.
    """

    channel: str
    against: str
    unit: str
    centres: tuple[float, ...]
    means: tuple[float, ...]
    deviations: tuple[float, ...]
    counts: tuple[int, ...]


def channel_residuals(residual: Array, sigma: Array, left_out: tuple[str, ...] = ()) -> tuple[ChannelResidual, ...]:
    """Table of the channels that have samples.

    Args:
        residual: (W, T, 8), see :func:`residuals`.
        sigma: (8,) noise.
        left_out: channels without information about the prediction.
    """
    table = []
    for k, name in enumerate(CHANNELS):
        values = residual[..., k]
        known = np.isfinite(values)
        if name in left_out or known.sum() < 2:
            continue
        size = float(np.sqrt(np.mean(values[known] ** 2)))
        unit, bias = SCHEMA[name].unit, float(values[known].mean())
        correlation, noise = successive_correlation(values), float(sigma[k])
        table.append(ChannelResidual(name, unit, int(known.sum()), size, bias, correlation, noise, size / noise))
    return tuple(table)


def bin_values(windows: WindowSet, record: Array) -> Mapping[str, Array]:
    """Values (W, T) of every quantity of BIN_QUANTITIES, from ``record`` (W, T, 7), the entries RECORDED."""
    has_heading = np.isfinite(windows.measured[..., CHANNELS.index("pose_yaw")]).any(axis=1, keepdims=True)
    return {
        "slip": np.abs(record[..., :4]).mean(axis=-1),
        "yaw_rate": record[..., 4],
        "speed": record[..., 5],
        "heading": np.where(has_heading, wrap_angle(record[..., 6]), np.nan),
        "time": windows.time[:, None] + windows.period * np.arange(1, windows.samples + 1),
    }


def binned_residuals(
    residual: Array, values: Mapping[str, Array], left_out: tuple[str, ...] = ()
) -> tuple[ResidualBins, ...]:
    """Mean residuals in bins, without the pose channels, whose errors depend on where a window starts.

    Args:
        residual: (W, T, 8).
        values: (W, T) by name of BIN_QUANTITIES.
        left_out: channels without information about the prediction.
    """
    made = []
    for k, name in enumerate(CHANNELS):
        if name.startswith("pose") or name in left_out or not np.isfinite(residual[..., k]).any():
            continue
        for against in BIN_QUANTITIES:
            bins = _bins(name, residual[..., k], against, values[against])
            if bins is not None:
                made.append(bins)
    return tuple(made)


def _bins(channel: str, residual: Array, against: str, values: Array) -> ResidualBins | None:
    window, sample = np.nonzero(np.isfinite(residual) & np.isfinite(values))
    r, x = residual[window, sample], values[window, sample]
    if r.size < LEAST_IN_BIN or np.ptp(x) == 0.0:
        return None
    bins = min(BINS, r.size // LEAST_IN_BIN)
    edges = np.unique(np.quantile(x, np.linspace(0.0, 1.0, bins + 1)))
    index = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, max(len(edges) - 2, 0))
    rows = [index == b for b in range(max(len(edges) - 1, 1)) if (index == b).any()]
    return ResidualBins(
        channel,
        against,
        BIN_QUANTITIES[against][0],
        tuple(float(np.median(x[b])) for b in rows),
        tuple(float(r[b].mean()) for b in rows),
        tuple(_standard_error(r[b], window[b]) for b in rows),
        tuple(int(b.sum()) for b in rows),
    )


def _standard_error(values: Array, window: Integers) -> float:
    """Standard error of a mean clustered by window: root of the summed squared cluster totals, over the count."""
    totals = np.bincount(np.unique(window, return_inverse=True)[1], values - values.mean())
    return float(np.sqrt((totals**2).sum() * totals.size / max(totals.size - 1, 1)) / values.size)
