"""Noise of a channel, and the two ways to learn it from recordings.

:func:`noise_from_differences` measures the sensor's noise as it enters block means: level, growth with speed,
correlation, quantisation. Differences over one and two samples leave the motion out and keep the noise. For a
first-order autoregressive noise with standard deviation s and correlation r, var(x[k+1] - x[k]) = 2 s^2 (1 - r) and
var(x[k+2] - x[k]) = 2 s^2 (1 - r^2), so that their ratio is 1 + r. Poses come seldom and are differenced three times
(variance 20 s^2) instead. What slower components add to means over several samples is measured on differences of such
means over three (variance 2 s^2). A diagnosis weighs with it.

:func:`noise_about_lines` measures what a rigid model on even ground cannot explain: the scatter about lines through
pieces of steady driving, vibration included, never below a good instrument's. A replay on field data weighs with it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.signals import steady_rows, travel_speed
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.recordings.checks.noise import noise_at_rest
from ddagr_gym.recordings.checks.signals import filled
from ddagr_gym.recordings.schema import Recording

Array = NDArray[np.float64]

SPARSE_SHARE = 0.6
"""Share of the rows below which a channel counts as sparse and is differenced three times (ours)."""

_CENTRAL = 0.8
"""Share of the differences that is used: command steps move the others (ours)."""

_COARSE = 1.5
"""Quanta by which successive samples of a channel differ at most (rms) if its rounding is what limits it (ours)."""

_NO_COUNTER = 1.7
"""Standard deviation of means of ten over that of a differenced counter above which a channel is none: with rounding
that is independent from sample to sample it is 3."""

_OPPOSITE = -0.25
"""Correlation of successive samples below which they are a counter's, half of what rounding gives."""

_JITTERING = 1.3
"""Standard deviation of its samples over that of its rounding above which a counter jitters (ours)."""

_STEPS = 6.0
"""Quanta between two samples at steady speed beyond which the speed was not steady (ours)."""

_AT_REST = 0.1
"""Standard deviation at rest over that at the quietest speeds where the line over speed ends at 0 (ours)."""

_FEWEST = 40
"""Differences that a level needs (ours)."""


PIECE = 1.0
"""Length of the pieces in which steady driving is judged [s]: five time constants of a bank."""

STEADY_SHARE = 0.1
"""Change of both bank speeds inside a piece over the larger one below which driving counts as steady (ours)."""

LEAST_PIECES = 5
"""Pieces below which their scatter is not taken (ours)."""

INSTRUMENT_NOISE = {
    "specific_force_x": 0.02, "specific_force_y": 0.02, "yaw_rate": 1e-3, "encoder_right": 0.01, "encoder_left": 0.01,
    "pose_x": 0.01, "pose_y": 0.01, "pose_yaw": 0.005,
}  # fmt: skip
"""Least standard deviations [SI], from good instruments' data sheets: an ideal recording must not get infinite weight.

MPU 6050 accelerometer and gyro, encoder quantisation at 0.2 m/s, RTK GNSS compass (thesis section 6.2)."""


@dataclass(frozen=True)
class ChannelNoise:
    """Noise of one channel.

    Attributes:
        sigma: standard deviation of one sample at rest, in the channel's unit.
        per_speed: further standard deviation per travel speed [unit/(m/s)]; both add in quadrature.
        correlation: of successive samples [-], -0.5 (a differenced counter) to 0.95.
        quantum: smallest step between values, 0 where none was found.
        inflation: standard deviation of means over what the correlation predicts [-].
        counter: whether only successive samples are correlated, as by the rounding of a differenced counter.
    """

    sigma: float
    per_speed: float = 0.0
    correlation: float = 0.0
    quantum: float = 0.0
    inflation: float = 1.0
    counter: bool = False

    def of_mean(self, samples: int, speed: Array | float = 0.0) -> Array:
        """Standard deviation of the mean of ``samples`` successive samples at a travel speed [m/s].

        Theory: identification, eq. (4).
        """
        lags = np.arange(1, samples)
        powers = np.where(lags == 1, self.correlation, 0.0) if self.counter else self.correlation**lags
        factor = (1.0 + 2.0 * np.sum((1.0 - lags / samples) * powers)) / samples
        factor *= self.inflation**2 if samples > 1 else 1.0
        variance = self.sigma**2 + (self.per_speed * np.asarray(speed)) ** 2
        return np.asarray(np.sqrt(np.maximum(factor, 0.0) * variance))


def _central_square(differences: Array) -> float:
    """Mean square of a normal variable, from the central part of a sample of it."""
    if len(differences) < _FEWEST:
        return np.nan
    from scipy.special import ndtri

    size = np.abs(differences)
    limit = np.quantile(size, _CENTRAL)
    inside = size[size <= limit]
    z = float(ndtri(0.5 + 0.5 * _CENTRAL))
    kept = 1.0 - 2.0 * z * np.exp(-0.5 * z * z) / np.sqrt(2.0 * np.pi) / _CENTRAL
    return float(np.mean(inside**2) / kept)


def _quantum(values: Array) -> float:
    """Step of a channel whose values repeat a ladder; 0 for a continuous one."""
    levels = np.unique(values)
    if len(levels) < 3 or len(levels) > 0.3 * len(values):
        return 0.0
    return float(np.quantile(np.diff(levels), 0.1))


def _pairs(values: list[Array], speeds: list[Array], lag: int) -> tuple[Array, Array]:
    """Differences over ``lag`` rows and the speed in between, pieces joined; missing samples left out."""
    differences = [v[lag:] - v[:-lag] for v in values]
    between = [0.5 * (s[lag:] + s[:-lag]) for s in speeds]
    both = np.concatenate(differences), np.concatenate(between)
    known = np.isfinite(both[0])
    return both[0][known], both[1][known]


def channel_noise_from_differences(
    values: Sequence[Array], speeds: Sequence[Array], sparse: bool
) -> ChannelNoise | None:
    """Noise of one channel from pieces without gaps.

    Args:
        values: pieces (n,), NaN where there is no sample.
        speeds: travel speed at the same rows [m/s].
        sparse: difference the samples that exist three times instead of neighbouring rows.

    Returns:
        None where there are too few samples, or where they show no noise that a residual could be compared with.
    """
    known = np.concatenate([v[np.isfinite(v)] for v in values] or [np.empty(0)])
    if len(known) < _FEWEST:
        return None
    quantum = 0.0 if sparse else _quantum(known)
    if sparse:
        thirds = np.concatenate([np.diff(v[np.isfinite(v)], 3) for v in values])
        square = _central_square(thirds) / 20.0
        return ChannelNoise(float(np.sqrt(square)), 0.0, 0.0, 0.0) if square > 0.0 else None
    one, _ = _pairs(list(values), list(speeds), 1)
    if quantum > 0.0 and _central_square(one) < (_COARSE * quantum) ** 2:
        found: ChannelNoise | None = _rounded(list(values), list(speeds), quantum)
    else:
        found = _coloured(list(values), list(speeds))
    return replace(found, quantum=quantum) if found is not None and found.sigma > 0.0 else None


def _rounded(values: list[Array], speeds: list[Array], quantum: float) -> ChannelNoise:
    """Noise of a channel that its rounding limits: a differenced counter, or a reading rounded by itself.

    The rounding of a counter's position enters two successive samples with opposite signs, so that means over several
    are far better than samples; that of a reading, or a jitter of either, does not. Means of the data themselves tell.
    """
    counter = ChannelNoise(float(quantum / np.sqrt(6.0)), 0.0, -0.5, quantum, counter=True)
    if _inflation(counter, values, speeds, samples=10) < _NO_COUNTER:
        return counter
    (first, _), (second, _) = (_pairs(values, speeds, lag) for lag in (1, 2))
    limit = _STEPS * quantum
    squares = [float(np.mean(d[np.abs(d) < limit] ** 2)) for d in (first, second)]
    # correlated over one sample at most: var(x[k+1] - x[k]) = 2 s^2 (1 - r), var(x[k+2] - x[k]) = 2 s^2
    correlation = float(np.clip(1.0 - squares[0] / max(squares[1], 1e-12), -0.5, 0.5))
    sigma = float(np.sqrt(0.5 * squares[1]))
    if correlation < _OPPOSITE:
        # few steady samples scatter more than a counter's; a jittering counter far more
        return counter if sigma < _JITTERING * counter.sigma else replace(counter, sigma=sigma)
    plain = ChannelNoise(sigma, 0.0, correlation, quantum, counter=True)
    return replace(plain, inflation=max(_inflation(plain, values, speeds), 1.0))


def _coloured(values: list[Array], speeds: list[Array]) -> ChannelNoise | None:
    """AR(1) noise whose variance grows with the square of the speed."""
    one, speed = _pairs(values, speeds, 1)
    two, _ = _pairs(values, speeds, 2)
    first, second = _central_square(one), _central_square(two)
    if not (first > 0.0 and second > 0.0):
        return None
    correlation = float(np.clip(second / first - 1.0, -0.5, 0.95))
    edges = np.unique(np.quantile(speed, np.linspace(0.0, 1.0, 7)))
    which = np.clip(np.searchsorted(edges, speed, side="right") - 1, 0, max(len(edges) - 2, 0))
    rows = [
        (np.mean(speed[which == k] ** 2), _central_square(one[which == k]))
        for k in range(max(len(edges) - 1, 1))
        if np.count_nonzero(which == k) >= _FEWEST
    ]
    rest, growth = _line([r for r in rows if np.isfinite(r[1])], first)
    scale = 2.0 * (1.0 - correlation)
    plain = ChannelNoise(float(np.sqrt(rest / scale)), float(np.sqrt(growth / scale)), correlation, 0.0)
    return replace(plain, inflation=_inflation(plain, values, speeds))


def _inflation(plain: ChannelNoise, values: list[Array], speeds: list[Array], samples: int = 5) -> float:
    """How much more than predicted means over ``samples`` scatter, 0.5 to 3."""
    standardised = []
    for value, speed in zip(values, speeds, strict=True):
        rows = len(value) // samples * samples
        means = value[:rows].reshape(-1, samples).mean(axis=1)
        expected = plain.of_mean(samples, speed[:rows].reshape(-1, samples).mean(axis=1))
        spread = np.hypot(expected[3:], expected[:-3])
        third = (means[3:] - means[:-3]) / np.maximum(spread, 1e-12)
        standardised.append(third[np.isfinite(third)])
    square = _central_square(np.concatenate(standardised))
    return float(np.clip(np.sqrt(square), 0.5, 3.0)) if np.isfinite(square) else 1.0


def _line(rows: list[tuple[float, float]], fallback: float) -> tuple[float, float]:
    """Positive intercept and non-negative slope of variance over squared speed, fitted to relative errors."""
    from scipy.optimize import nnls

    if len(rows) < 2:
        return fallback, 0.0
    square, variance = np.array(rows).T
    if np.ptp(square) <= 0.0 or (variance <= 0.0).all():
        return fallback, 0.0
    floor = np.maximum(variance, 1e-3 * variance.max())
    found, _ = nnls(np.stack([1.0 / floor, square / floor], axis=1), variance / floor)
    rest = found[0] if found[0] > 0.0 else _AT_REST**2 * variance[variance > 0.0].min()
    return (float(rest), float(found[1])) if found.any() else (fallback, 0.0)


def noise_from_differences(recordings: Sequence[Recording], wheel_radius: float) -> tuple[ChannelNoise | None, ...]:
    """Noise of the eight channels of :data:`ddagr_gym.identification.windows.CHANNELS`; None for an absent one.

    Args:
        recordings: of one robot and one set of sensors.
        wheel_radius: hub to tread [m].
    """

    speeds, steady = _cut(recordings, lambda r: travel_speed(r, wheel_radius)), _cut(recordings, steady_rows)
    found = []
    for name in CHANNELS:
        pieces, sparse = _cut(recordings, itemgetter(name)), _is_sparse(recordings, name)
        if name == "pose_yaw":
            pieces = [_unwrapped(piece) for piece in pieces]
        if not sparse:
            pieces = _where_steady(pieces, steady)
        found.append(channel_noise_from_differences(pieces, speeds, sparse))
    return tuple(found)


def too_few_to_measure(recordings: Sequence[Recording]) -> dict[str, int]:
    """Samples of each channel that recordings have, but too few of to measure its noise, by name.

    Args:
        recordings: as of :func:`noise_from_differences`.
    """
    found = {}
    for name in (item for item in CHANNELS if any(r.has(item) for r in recordings)):
        counts = [int(np.isfinite(piece).sum()) for piece in _cut(recordings, itemgetter(name))]
        differences = sum(max(count - 3, 0) for count in counts) if _is_sparse(recordings, name) else sum(counts)
        if differences < _FEWEST:
            found[name] = sum(counts)
    return found


def _cut(recordings: Sequence[Recording], values: Callable[[Recording], NDArray[Any]]) -> list[NDArray[Any]]:
    """Pieces of recordings without gaps."""
    return [whole[s] for r in recordings for whole in (values(r),) for s in r.segments()]


def _is_sparse(recordings: Sequence[Recording], name: str) -> bool:
    shares = [np.isfinite(r[name]).mean() for r in recordings if r.has(name)]
    return bool(shares) and bool(max(shares) < SPARSE_SHARE or name.startswith("pose"))


def _where_steady(pieces: list[Array], steady: list[NDArray[np.bool_]]) -> list[Array]:
    """Pieces with the unsteady rows missing, unless hardly any rows would be left."""
    kept = [np.where(rows, piece, np.nan) for piece, rows in zip(pieces, steady, strict=True)]
    left = sum(int(np.isfinite(piece).sum()) for piece in kept)
    return kept if left >= 10 * _FEWEST else pieces


def _unwrapped(values: Array) -> Array:
    known = np.isfinite(values)
    result = values.copy()
    result[known] = np.unwrap(values[known])
    return result


def _steady_pieces(recording: Recording) -> Iterator[slice]:
    speeds = np.stack([filled(recording, "encoder_right"), filled(recording, "encoder_left")], axis=1)
    length = max(round(PIECE / recording.period), 4)
    for segment in recording.segments():
        for start in range(segment.start, segment.stop - length + 1, length):
            piece = speeds[start : start + length]
            if not np.isfinite(piece).all():
                continue
            mean = np.abs(piece).mean(axis=0)
            if mean.max() > 0.0 and (np.ptp(piece, axis=0) <= STEADY_SHARE * mean.max()).all():
                yield slice(start, start + length)


def noise_about_lines(recording: Recording) -> dict[str, ChannelNoise]:
    """Noise by name of CHANNELS, but of the poses: the larger one of at rest and of steady driving, with vibration.

    Args:
        recording: as recorded; a channel that neither rest nor steady driving shows has its instrument's noise.
    """
    steady = list(_steady_pieces(recording))
    return {name: _channel_about_lines(recording, name, steady) for name in CHANNELS if not name.startswith("pose")}


def _channel_about_lines(recording: Recording, name: str, steady: list[slice]) -> ChannelNoise:
    at_rest = noise_at_rest(recording, name)
    moving, correlation = _about_lines(recording, name, steady)
    if moving == 0.0 and at_rest is not None:
        correlation = at_rest.correlation
    rest = 0.0 if at_rest is None else at_rest.sigma
    return ChannelNoise(max(rest, moving, INSTRUMENT_NOISE[name]), correlation=correlation)


def _about_lines(recording: Recording, name: str, pieces: list[slice]) -> tuple[float, float]:
    """Standard deviation and correlation of successive samples about the line through each piece; 0 for too few."""
    power, product, freedom, pairs = 0.0, 0.0, 0, 0
    for piece in pieces:
        known = np.isfinite(recording[name][piece])
        if known.sum() < 4:
            continue
        t, values = recording.t[piece][known], recording[name][piece][known]
        rest = values - np.polyval(np.polyfit(t - t[0], values, 1), t - t[0])
        power += float(rest @ rest)
        product += float(rest[1:] @ rest[:-1])
        freedom += rest.size - 2
        pairs += 1
    if pairs < LEAST_PIECES or power == 0.0:
        return 0.0, 0.0
    return float(np.sqrt(power / freedom)), product / power
