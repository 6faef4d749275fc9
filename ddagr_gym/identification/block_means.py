"""Windows thinned to block means, with the standard deviation of each mean.

Means over about 0.1 s keep what a robot of this size can do (its motors take 0.2 s), cost a fifth of the samples at
50 Hz, average the rounding of a differenced counter away and leave little of the correlation between samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.noise import ChannelNoise
from ddagr_gym.identification.signals import interpolated, on_lines
from ddagr_gym.identification.timing_repair import POSE_CHANNELS
from ddagr_gym.identification.windows import CHANNELS, STATE, WindowSet
from ddagr_gym.recordings.row_times import GAP_IN_PERIODS, in_bursts
from ddagr_gym.recordings.schema import Recording

Array = NDArray[np.float64]

BLOCK = 0.1
"""Length of a block [s]."""

TRACKING_ERROR = {
    "encoder_right": 0.06,
    "encoder_left": 0.06,
    "yaw_rate": 0.015,
    "specific_force_x": 0.07,
    "specific_force_y": 0.07,
}
"""Error of the nominal model per difference between command and bank speed [unit of the channel/(rad/s)].

Real speed loops are not first-order lags: on null drives of the project's own blind generator (a PI loop on torque) the
residuals of refitted encoders are 5 to 7 percent of the difference, those of the gyro 1.5 percent.
"""

YAW = CHANNELS.index("pose_yaw")


@dataclass(frozen=True, eq=False)
class BlockedWindows:
    """Windows and what is compared of them: M = B * 8 block means per window.

    Attributes:
        windows: all samples.
        weights: (W, B, n, 8) of the samples in each mean, 0 where there is none; they add up to 1 or 0.
        sigma: (W, B, 8) standard deviation of each mean, infinite where there is no sample.
    """

    windows: WindowSet
    weights: Array
    sigma: Array

    @property
    def mask(self) -> Array:
        """(W, M) 1 where a mean exists."""
        return np.isfinite(self.sigma).astype(float).reshape(self.windows.count, -1)

    def means(self, values: Array) -> Array:
        """Block means over sigma, (W, M) or (W, M, K), of values (W, T, 8) or (W, T, 8, K); 0 where there is none."""
        count, blocks, length, channels = self.weights.shape
        kept = values[:, : blocks * length].reshape(count, blocks, length, *values.shape[2:])
        shape = self.weights.shape + (1,) * (values.ndim - 3)
        mean = (self.weights.reshape(shape) * kept).sum(axis=2)
        sigma = self.sigma.reshape(self.sigma.shape + (1,) * (values.ndim - 3))
        return np.asarray((mean / sigma).reshape(count, blocks * channels, *values.shape[3:]))

    def means_of_all(self, values: Array) -> Array:
        """Block means (W, B, 8) of values (W, T, 8) in their unit; of all samples where a channel has none."""
        _, blocks, length, _ = self.weights.shape
        kept = values[:, : blocks * length].reshape(self.weights.shape)
        known = (self.weights * kept).sum(axis=2)
        return np.asarray(np.where(self.weights.sum(axis=2) > 0.0, known, kept.mean(axis=2)))

    def change(self, after: Array, before: Array) -> Array:
        """(W, M) block means over sigma of a change of predictions (W, T, 8); what breaks down says nothing."""
        return np.nan_to_num(self.means(after - before))

    def derivative(self, changes: Array, base: Array) -> Array:
        """The same of small changes (W, T, 8) or (W, T, 8, K) of a prediction (W, T, 8), (W, M) or (W, M, K)."""
        return self.means(changes)

    def residual(self, prediction: Array) -> Array:
        """(W, M) block means of measured less predicted over sigma; headings compared on the circle."""
        return self.means(np.nan_to_num(self.differences(prediction)))

    def differences(self, prediction: Array) -> Array:
        """(W, T, 8) measured less predicted, NaN where there is no sample; headings compared on the circle."""
        difference = self.windows.measured - prediction
        difference[..., YAW] = np.angle(np.exp(1j * difference[..., YAW]))
        return difference

    def by_channel(self, values: Array) -> Array:
        """(W, B, 8) of rows (W, M + S): without those of the local unknowns' priors."""
        return values[:, : self.sigma.shape[1] * self.sigma.shape[2]].reshape(self.sigma.shape)

    def subset(self, chosen: NDArray[np.int64] | NDArray[np.bool_]) -> BlockedWindows:
        """Only the chosen windows."""
        return replace(
            self, windows=self.windows.subset(chosen), weights=self.weights[chosen], sigma=self.sigma[chosen]
        )


def block_windows(
    windows: WindowSet, noise: Sequence[ChannelNoise | None], wheel_radius: float, block: float = BLOCK
) -> BlockedWindows:
    """Blocks of windows with the noise of each channel at the speed of each block.

    Args:
        windows: at least one block long.
        noise: of the eight channels; an absent one is left out.
        wheel_radius: hub to tread [m].
        block: length of a block [s].
    """
    length = max(round(block / windows.period), 1)
    count = windows.samples // length
    measured = windows.measured[:, : count * length].reshape(windows.count, count, length, len(CHANNELS))
    known = np.isfinite(measured)
    present = known.sum(axis=2)
    weights = known / np.maximum(present, 1)[:, :, None]
    driven = windows.commands[:, windows.history : windows.history + count * length]
    driven = np.abs(driven).mean(axis=2).reshape(windows.count, count, length).mean(axis=2)
    sigma = np.full((windows.count, count, len(CHANNELS)), np.inf)
    for channel, found in enumerate(noise):
        if found is None:
            continue
        for samples in np.unique(present[..., channel]):
            if samples > 0:
                chosen = present[..., channel] == samples
                sigma[..., channel][chosen] = found.of_mean(int(samples), wheel_radius * driven)[chosen]
    behind = _tracking(windows, count, length)
    for name, share in TRACKING_ERROR.items():
        channel = CHANNELS.index(name)
        sigma[..., channel] = np.hypot(sigma[..., channel], share * behind)
    return BlockedWindows(windows, weights, sigma)


def sample_windows(windows: WindowSet, sigma: Array) -> BlockedWindows:
    """Every sample a block of its own.

    Args:
        windows: all samples.
        sigma: standard deviations of the samples, (8,) or anything that broadcasts to (W, T, 8); infinite for channels
            that are left out.
    """
    known = np.isfinite(windows.measured)
    widths = np.where(known, np.broadcast_to(sigma, known.shape), np.inf)
    return BlockedWindows(windows, known[:, :, None].astype(float), widths)


def _tracking(windows: WindowSet, blocks: int, length: int) -> Array:
    """Largest difference between command and bank speed of each block (W, B) [rad/s]; 0 without encoders."""
    kept = slice(windows.history, windows.history + blocks * length)
    banks = [CHANNELS.index("encoder_right"), CHANNELS.index("encoder_left")]
    driven, measured = windows.commands[:, kept], windows.measured[:, : blocks * length, banks]
    rows = np.arange(blocks * length, dtype=np.float64)
    difference = np.zeros(driven.shape)
    for w in range(windows.count):
        for bank in range(2):
            # banks may be read in different rows, and more seldom than once in a block
            if np.isfinite(measured[w, :, bank]).any():
                difference[w, :, bank] = driven[w, :, bank] - on_lines(rows, measured[w, :, bank])
    mean = np.nan_to_num(difference).reshape(windows.count, blocks, length, 2).mean(axis=2)
    return np.asarray(np.abs(mean).max(axis=2))


def located(windows: WindowSet, recordings: Sequence[Recording], wheel_radius: float) -> WindowSet:
    """Windows whose first guess has a heading and a place also where there is no pose.

    Without a receiver the heading is the integral of the gyro and the place that of the rim speed, from the origin of
    each recording on: enough to tell directions and places of one drive apart, not those of two drives.
    """
    initial = windows.initial.copy()
    for number, recording in enumerate(recordings):
        if recording.has(*POSE_CHANNELS):
            continue
        step, rows = recording.period, _periods(recording)
        yaw = np.cumsum(interpolated(recording, "yaw_rate") * rows) * step
        banks = [interpolated(recording, name) * rows for name in ("encoder_right", "encoder_left")]
        travel = wheel_radius * 0.5 * (banks[0] + banks[1]) * step
        path = np.stack([np.cumsum(travel * np.cos(yaw)), np.cumsum(travel * np.sin(yaw)), yaw], axis=1)
        chosen = windows.recording == number
        initial[np.ix_(chosen, [STATE.index(name) for name in ("x", "y", "yaw")])] = path[windows.start[chosen]]
    return replace(windows, initial=initial)


def _periods(recording: Recording) -> Array:
    """(n,) periods since the row before: 1, but for gaps inside a span, whose time is known."""
    periods = np.ones(len(recording))
    for span in recording.spans():
        steps = np.diff(recording.t[span])
        if not in_bursts(steps):
            late = steps / recording.period
            periods[span][1:] = np.where(late > GAP_IN_PERIODS, late, 1.0)
    return periods
