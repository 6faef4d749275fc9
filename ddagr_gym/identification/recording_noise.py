"""What one recording says about its own errors: noise of each channel, lateness of its poses, bias of its gyro."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.noise import INSTRUMENT_NOISE, ChannelNoise, noise_about_lines
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.recordings.checks.clock_offsets import Offset, pose_offset, unwrapped_heading
from ddagr_gym.recordings.checks.noise import noise_at_rest
from ddagr_gym.recordings.checks.signals import integral
from ddagr_gym.recordings.checks.silences import heard_spans
from ddagr_gym.recordings.schema import Recording

Array = NDArray[np.float64]

TIMING_PIECE = 10.0
"""Length of the pieces in which poses are compared with the integrated gyro [s] (ours)."""

LEAST_CORRELATION = 0.5
"""Correlation of gyro and poses below which nothing is known of their clocks (ours)."""

SURE = 2.0
"""Standard deviations by which the growth of a heading's error with the yaw rate must stand out (ours)."""

WIDEST_LATENESS = 0.8
"""Width of the interval of the poses' lateness [s] beyond which it is not known (ours)."""


@dataclass(frozen=True)
class RecordingNoise:
    """Noise of a recording.

    Attributes:
        channels: by name of CHANNELS.
        pose_lateness: by which poses come behind the gyro [s]; 0 where it cannot be told.
        pose_jitter: scatter of that lateness [s].
        gyro_bias: mean gyro reading at rest [rad/s] and its standard deviation, None where the robot never stood.
        opposed: whether poses and gyro clearly turn opposite ways, so that one of them has the wrong sign.
        lateness_interval: 99 % interval of the poses' lateness [s]; None where it cannot be told.
    """

    channels: dict[str, ChannelNoise]
    pose_lateness: float
    pose_jitter: float
    gyro_bias: tuple[float, float] | None
    opposed: bool = False
    lateness_interval: tuple[float, float] | None = None

    @property
    def sigma(self) -> Array:
        """(8,) in the order of CHANNELS."""
        return np.array([self.channels[name].sigma for name in CHANNELS])


def recording_noise(recording: Recording, rng: np.random.Generator) -> RecordingNoise:
    """Noise of every channel that the simulator predicts.

    Args:
        recording: as recorded, with poses where they came.
        rng: for the interval of the poses' lateness.
    """
    channels = noise_about_lines(recording)
    offset = pose_offset(recording, rng) if recording.has("pose_yaw", "yaw_rate") else None
    lateness = pose_lateness(offset)
    jitter, heading = _timing(recording, lateness)
    speed = _typical_speed(recording)
    for name in ("pose_x", "pose_y"):
        channels[name] = ChannelNoise(max(INSTRUMENT_NOISE[name], jitter * speed))
    channels["pose_yaw"] = ChannelNoise(max(INSTRUMENT_NOISE["pose_yaw"], heading))
    opposed = offset is not None and offset.correlation < -LEAST_CORRELATION
    interval = offset.interval if offset is not None and lateness > 0.0 else None
    return RecordingNoise(channels, lateness, jitter, _gyro_bias(recording), opposed, interval)


def dead_channels(recording: Recording) -> tuple[str, ...]:
    """Channels of CHANNELS that hold one and the same value while the robot moves: stuck, or zeros logged as data."""
    present = [name for name in CHANNELS if recording.has(name)]
    ranges = {name: float(np.ptp(recording[name][np.isfinite(recording[name])])) for name in present}
    return tuple(name for name in present if ranges[name] == 0.0) if any(ranges.values()) else ()


def pose_lateness(offset: Offset | None) -> float:
    """Lateness to correct for [s]: 0 unless the clocks' correlation is clear; poses do not come early."""
    if offset is None or abs(offset.correlation) < LEAST_CORRELATION:
        return 0.0
    if not offset.interval[1] - offset.interval[0] <= WIDEST_LATENESS:
        return 0.0
    return max(offset.lag, 0.0)


def _timing(recording: Recording, lateness: float) -> tuple[float, float]:
    """Scatter of the poses' lateness [s], and of their heading against the gyro [rad], inside pieces of spans."""
    heading, turned = unwrapped_heading(recording), integral(recording, recording["yaw_rate"])
    misfits, rates = [], []
    for span in _pieces(recording, TIMING_PIECE):
        rows = span.start + np.flatnonzero(np.isfinite(heading[span]))
        if rows.size < 4:
            continue
        at = np.clip(recording.t[rows] - lateness, recording.t[span.start], recording.t[span.stop - 1])
        gyro = np.interp(at, recording.t[span], turned[span])
        misfit = heading[rows] - gyro
        misfits.append(misfit - misfit.mean())
        rates.append(np.interp(at, recording.t[span], np.nan_to_num(recording["yaw_rate"][span])))
    if not misfits:
        return 0.0, 0.0
    square, rate = np.concatenate(misfits) ** 2, np.concatenate(rates)
    return _jitter(square, rate), float(np.sqrt(np.mean(square)))


def _jitter(square: Array, rate: Array) -> float:
    """Scatter of the time of headings [s]: errors that it makes grow with the yaw rate, those of a compass do not.

    0 where the yaw rate hardly varies, or the growth is not sure: in a straight drive a heading's noise would pass for
    any scatter of its time.

    Args:
        square: (n,) squared errors of the heading [rad^2].
        rate: (n,) yaw rates [rad/s].
    """
    turning = rate**2 - np.mean(rate**2)
    power = float(turning @ turning)
    if square.size < 4 or power == 0.0:
        return 0.0
    slope = float(turning @ square) / power
    rest = square - square.mean() - slope * turning
    deviation = float(np.sqrt(((turning * rest) ** 2).sum())) / power
    return float(np.sqrt(slope)) if slope > SURE * deviation else 0.0


def _pieces(recording: Recording, seconds: float) -> Iterator[slice]:
    """Pieces of heard spans, so short that a gyro's bias does not turn the heading within them."""
    length = max(round(seconds / recording.period), 2)
    for span in heard_spans(recording):
        for start in range(span.start, span.stop, length):
            yield slice(start, min(start + length, span.stop))


def _typical_speed(recording: Recording) -> float:
    """Root mean square speed between successive poses a second or more apart [m/s]."""
    speeds = []
    for span in recording.spans():
        known = np.isfinite(recording["pose_x"][span]) & np.isfinite(recording["pose_y"][span])
        t = recording.t[span][known]
        if t.size < 2:
            continue
        grid = np.arange(t[0], t[-1], 1.0)
        x, y = (np.interp(grid, t, recording[name][span][known]) for name in ("pose_x", "pose_y"))
        speeds.append(np.hypot(np.diff(x), np.diff(y)))
    joined = np.concatenate(speeds) if speeds else np.empty(0)
    return float(np.sqrt(np.mean(joined**2))) if joined.size else 0.0


def _gyro_bias(recording: Recording) -> tuple[float, float] | None:
    at_rest = noise_at_rest(recording, "yaw_rate")
    if at_rest is None:
        return None
    scatter = float(np.std(at_rest.means)) if at_rest.means.size > 1 else 0.0
    return float(at_rest.means.mean()), math.hypot(scatter, at_rest.sigma / math.sqrt(at_rest.samples))
