"""Clock offsets between channels, by cross-correlation inside blocks.

For a pair (a reference signal x sampled often, samples y_k at times t_k) the offset is the tau that maximises the
correlation of y_k with x(t_k - tau): positive when y is late. Both are centred in each block first, so that neither
biases nor a slow drift count. The interval comes from resampled blocks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from ddagr_gym.recordings.checks.blocks import FEWEST_BLOCKS, interval_of, resample
from ddagr_gym.recordings.checks.findings import CheckFinding, Interval, judge, not_testable
from ddagr_gym.recordings.checks.regression import blocks_in_spans
from ddagr_gym.recordings.checks.signals import filled, integral, new_rows, wrap
from ddagr_gym.recordings.checks.silences import heard_spans
from ddagr_gym.recordings.schema import BoolArray, FloatArray, Recording

CHECK = "clock_offset"
RESPONSE, ENCODER, POSE = "command to encoder", "yaw_rate to encoder", "yaw_rate to pose"
"""The pairs, reference first."""

LAGS = np.arange(-1.0, 1.5001, 0.025)
"""Offsets that are tried [s]."""

RESPONSE_RANGE = (0.0, 1.5)
"""Delay plus rise of a bank after a command step [s]: not before it, and slower than this is no speed control."""
ENCODER_RANGE = (-0.15, 0.25)
"""Lateness of encoders behind the gyro beyond half an encoder period [s] (ours): the body's yaw rate may follow the
wheels by 0.15 s on soft ground, and a message may take 0.25 s; 0 to 0.25 s on the open recordings."""
POSE_RANGE = (-0.15, 1.0)
"""Lateness of poses [s]: a lidar or GNSS pose is computed after its scan (0.5 to 0.75 s on the open recordings);
earlier than the gyro is not possible."""
LEAST_CORRELATION = 0.5
"""Of two signals at their best offset, below which it says nothing (ours: a quarter of the variance is common)."""
LONGEST_ENCODER_LAG = 0.5
"""Of the encoders behind the gyro [s] (ours): what seems longer is that one of the two does not tell of turns."""
WIDEST_INTERVAL = 0.8
"""Interval [s] beyond which the offset counts as not testable."""

Reference = Callable[[slice, FloatArray], FloatArray]


@dataclass(frozen=True)
class Offset:
    """Offset of one pair.

    Attributes:
        lag: tau at the largest correlation [s].
        interval: its 99 % interval [s].
        correlation: at that lag, with its sign.
        profile: correlation at every lag of :data:`LAGS`.
        blocks: blocks with information.
    """

    lag: float
    interval: Interval
    correlation: float
    profile: FloatArray
    blocks: int


def known_lag(offset: Offset | None) -> float:
    """Lag of a pair [s], 0 where the drive does not tell it: the best lag of two noises is any."""
    return 0.0 if offset is None or abs(offset.correlation) < LEAST_CORRELATION else offset.lag


def encoder_lag(offset: Offset | None) -> float:
    """Lag of the encoders behind the gyro [s], 0 where the drive does not tell it or it is none of a clock."""
    lag = known_lag(offset)
    return lag if abs(lag) < LONGEST_ENCODER_LAG else 0.0


@dataclass(frozen=True)
class LagProfiles:
    """Centred second moments of a pair at every lag of :data:`LAGS`.

    Attributes:
        t: middle of each block (blocks,) [s].
        sums: xx, xy, yy of reference x and samples y (blocks, lags, 3).
    """

    t: FloatArray
    sums: FloatArray


_KNOWN: WeakKeyDictionary[Recording, dict[str, LagProfiles]] = WeakKeyDictionary()


def clock_offsets(recording: Recording, rng: np.random.Generator) -> list[CheckFinding]:
    """Findings on the clocks of commands, encoders, gyro and pose.

    Args:
        recording: any.
        rng: for the resampling.
    """
    found = offsets(recording, rng)
    return [_response(found[RESPONSE]), _encoder(recording, found[ENCODER]), _pose(found[POSE])]


def offsets(recording: Recording, rng: np.random.Generator) -> dict[str, Offset | None]:
    """Offset of every pair, None where the recording cannot tell."""
    return {
        RESPONSE: response_offset(recording, rng),
        ENCODER: encoder_offset(recording, rng),
        POSE: pose_offset(recording, rng) if recording.has("pose_yaw", "yaw_rate") else None,
    }


def response_offset(recording: Recording, rng: np.random.Generator) -> Offset | None:
    """Time by which the banks follow their commands, both banks together."""
    return _offset(lag_profiles(recording, RESPONSE).sums, rng)


def encoder_offset(recording: Recording, rng: np.random.Generator) -> Offset | None:
    """Lateness of the encoders' speed difference behind the gyro."""
    return _offset(lag_profiles(recording, ENCODER).sums, rng)


def pose_offset(recording: Recording, rng: np.random.Generator) -> Offset | None:
    """Lateness of the pose's heading behind the integrated gyro."""
    return _offset(lag_profiles(recording, POSE).sums, rng)


def lag_profiles(recording: Recording, pair: str) -> LagProfiles:
    """Moments of a pair at every lag, block by block; remembered, since several checks ask for them.

    Args:
        recording: any.
        pair: :data:`RESPONSE`, :data:`ENCODER` or :data:`POSE`.
    """
    known = _KNOWN.setdefault(recording, {})
    if pair not in known:
        known[pair] = _profiles(recording, pair)
    return known[pair]


def _profiles(recording: Recording, pair: str) -> LagProfiles:
    if pair == POSE:
        turned = integral(recording, recording["yaw_rate"])
        return _lag_sums(recording, _interpolated(recording, turned), unwrapped_heading(recording))
    if pair == ENCODER:
        difference = filled(recording, "encoder_right") - filled(recording, "encoder_left")
        difference[~new_rows(recording, "encoder_right", "encoder_left")] = np.nan
        return _lag_sums(recording, _interpolated(recording, recording["yaw_rate"]), difference)
    banks = []
    for commands, bank in zip(recording.held_commands(), ("right", "left"), strict=True):
        encoder = recording[f"encoder_{bank}"]
        banks.append(_lag_sums(recording, _command_reference(recording, commands, encoder), encoder, commands))
    return LagProfiles(*(np.concatenate(parts) for parts in zip(*((b.t, b.sums) for b in banks), strict=True)))


def gyro_direction(recording: Recording) -> float:
    """Sign (+1 or -1) by which heading and integrated gyro go together, from changes of less than a radian."""
    turned = integral(recording, recording["yaw_rate"])
    product = 0.0
    for span in heard_spans(recording):
        rows = span.start + np.flatnonzero(np.isfinite(recording["pose_yaw"][span]) & np.isfinite(turned[span]))
        change, gyro = wrap(np.diff(recording["pose_yaw"][rows])), np.diff(turned[rows])
        small = (np.abs(change) < 1.0) & (np.abs(gyro) < 1.0)
        product += float(np.sum(change[small] * gyro[small]))
    return -1.0 if product < 0 else 1.0


def unwrapped_heading(recording: Recording) -> FloatArray:
    """Heading of the pose without jumps of a turn, NaN between samples.

    Poses can be more than half a turn apart; the gyro (with the sign that the poses themselves show) says how many.
    """
    turned = gyro_direction(recording) * integral(recording, recording["yaw_rate"])
    heading = recording["pose_yaw"]
    out = np.full(len(recording), np.nan)
    for span in heard_spans(recording):
        rows = span.start + np.flatnonzero(np.isfinite(heading[span]) & np.isfinite(turned[span]))
        if rows.size >= 2:
            expected = np.diff(turned[rows])
            steps = expected + wrap(np.diff(heading[rows]) - expected)
            out[rows] = heading[rows[0]] + np.concatenate([[0.0], np.cumsum(steps)])
    return out


def _interpolated(recording: Recording, values: FloatArray) -> Reference:
    """Reference that is interpolated inside its span and unknown outside."""

    def reference(span: slice, t: FloatArray) -> FloatArray:
        known = np.isfinite(values[span])
        if np.count_nonzero(known) < 2:
            return np.full(t.shape, np.nan)
        return np.interp(t, recording.t[span][known], values[span][known], left=np.nan, right=np.nan)

    return reference


def _command_reference(recording: Recording, commands: FloatArray, encoder: FloatArray) -> Reference:
    """Command in force; before the span the bank's first speed stands for the command that it had followed.

    A silence of a sensor ends a heard span, not what is known of the commands.
    """

    def reference(heard: slice, t: FloatArray) -> FloatArray:
        span = next(s for s in recording.spans() if s.start <= heard.start < s.stop)
        rows = np.searchsorted(recording.t[span], t, side="right") - 1
        values = commands[span][np.clip(rows, 0, None)]
        first = encoder[span][np.isfinite(encoder[span])]
        return np.where(rows < 0, first[0] if first.size else np.nan, values)

    return reference


def _lag_sums(
    recording: Recording, reference: Reference, samples: FloatArray, within: FloatArray | None = None
) -> LagProfiles:
    """Centred second moments of reference and samples.

    Args:
        recording: any.
        reference: x.
        samples: y, NaN where there is no new sample.
        within: only samples in rows where this is finite, None for all.
    """
    sums, times = [], []
    usable = np.isfinite(samples) & (True if within is None else np.isfinite(within))
    for span, block in blocks_in_spans(recording):
        rows = block.start + np.flatnonzero(usable[block])
        x = reference(span, recording.t[rows][None, :] - LAGS[:, None])
        known = np.all(np.isfinite(x), axis=0)
        x, y = x[:, known], samples[rows[known]]
        if y.size >= 5:
            x = x - x.mean(axis=1, keepdims=True)
            y = y - y.mean()
            sums.append(np.stack([np.sum(x * x, axis=1), x @ y, np.full(len(LAGS), y @ y)], axis=1))
            times.append(0.5 * float(recording.t[block.start] + recording.t[block.stop - 1]))
    return LagProfiles(np.array(times), np.array(sums) if sums else np.empty((0, len(LAGS), 3)))


def _offset(sums: FloatArray, rng: np.random.Generator) -> Offset | None:
    """Offset from lag sums; None where too few blocks hold any motion."""
    sums = sums[moving_blocks(sums)]
    if len(sums) < FEWEST_BLOCKS:
        return None
    estimate, resampled = resample(sums, _best_lag, rng)
    total = sums.sum(axis=0)
    profile = total[:, 1] / np.sqrt(total[:, 0] * total[:, 2])
    lag = float(estimate[0])
    correlation = float(np.interp(lag, LAGS, profile))
    return Offset(lag, interval_of(lag, resampled[:, 0], len(sums)), correlation, profile, len(sums))


def moving_blocks(sums: FloatArray) -> BoolArray:
    """Which blocks hold motion in the reference, at every lag, and in the samples (blocks,)."""
    return np.asarray(np.all(sums[:, :, 0] > 0, axis=1) & (sums[:, 0, 2] > 0))


def _best_lag(totals: FloatArray) -> FloatArray:
    """Lag of the largest squared correlation with a parabola through its neighbours, (m, 1)."""
    square = totals[:, :, 1] ** 2 / (totals[:, :, 0] * totals[:, :, 2])
    best = np.clip(np.argmax(square, axis=1), 1, len(LAGS) - 2)
    rows = np.arange(len(totals))
    left, middle, right = square[rows, best - 1], square[rows, best], square[rows, best + 1]
    bend = left - 2 * middle + right
    shift = np.where(bend < 0, np.clip(0.5 * (left - right) / np.where(bend < 0, bend, 1.0), -1.0, 1.0), 0.0)
    return np.asarray((LAGS[best] + shift * (LAGS[1] - LAGS[0]))[:, None])


def _finding(
    offset: Offset | None,
    pair: str,
    expected: Interval,
    sentence: str,
    remedy: str,
    drive: str,
    suspects: tuple[str, ...],
) -> CheckFinding:
    if offset is None or abs(offset.correlation) < LEAST_CORRELATION:
        found = "they share too little motion" if offset is None else f"they correlate by {offset.correlation:.2f} only"
        return not_testable(CHECK, pair, f"The offset cannot be determined: {found}.", drive)
    width = offset.interval[1] - offset.interval[0]
    if not width <= WIDEST_INTERVAL:
        return not_testable(CHECK, pair, f"The offset is uncertain by {width:.2g} s.", drive)
    meaning = sentence.format(lag=abs(offset.lag), order="behind" if offset.lag >= 0 else "ahead of")
    return judge(
        CHECK, pair, offset.lag, offset.interval, expected, "s", meaning=meaning, remedy=remedy, suspects=suspects
    )


def _response(offset: Offset | None) -> CheckFinding:
    return _finding(
        offset,
        RESPONSE,
        RESPONSE_RANGE,
        "The banks follow their commands {lag:.2f} s {order} them, delay and rise together.",
        "Look for a clock offset between command and encoder logs; if the motors are that slow, model their lag.",
        "Drive steps of the commands from and to standstill.",
        ("command_delay", "motor_lag"),
    )


def _encoder(recording: Recording, offset: Offset | None) -> CheckFinding:
    rates = [recording.rate(name) for name in ("encoder_right", "encoder_left")]
    half = 0.5 / min(rates) if min(rates) > 0 else 0.0
    return _finding(
        offset,
        ENCODER,
        (half + ENCODER_RANGE[0], half + ENCODER_RANGE[1]),
        "The encoders' speed difference runs {lag:.2f} s {order} the gyro.",
        "Shift one of the clocks by this offset before anything is fitted.",
        "Drive turns that begin and end.",
        ("sensor_hold",),
    )


def _pose(offset: Offset | None) -> CheckFinding:
    return _finding(
        offset,
        POSE,
        POSE_RANGE,
        "The pose's heading runs {lag:.2f} s {order} the gyro.",
        "Shift the pose's clock by this offset, or fit pose_latency.",
        "Record a pose with heading and drive turns that begin and end.",
        ("pose_latency",),
    )
