"""Clocks that drift: whether the offset of a pair of channels changes along the drive, and whose clock it is.

The offset of a pair is tau(t) = tau_0 + drift (t - t_middle); both are those at which the correlation over all blocks
is largest. A clock that drifts shows in every pair that holds it, which tells whose clock it is.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ddagr_gym.recordings.checks.blocks import FEWEST_BLOCKS, interval_of, resample
from ddagr_gym.recordings.checks.clock_offsets import (
    ENCODER,
    LAGS,
    LEAST_CORRELATION,
    POSE,
    RESPONSE,
    lag_profiles,
    moving_blocks,
)
from ddagr_gym.recordings.checks.findings import CheckFinding, Interval, Question, not_testable
from ddagr_gym.recordings.schema import FloatArray, Recording

CHECK = "clock_drift"

DRIFT = Question(
    CHECK,
    (-0.1, 0.1),
    "s",
    "Take the stamps of one clock for all sensors, or stretch the times of the channel that drifts.",
    ("sensor_hold",),
)
"""Change of an offset from the drive's beginning to its end [s]: 0.1 s is 170 ppm over ten minutes, beyond any quartz
(20 to 100 ppm), and no drive of the open recordings shows more beyond doubt."""
DRIFTS = np.arange(-1.0, 1.0001, 0.05)
"""Changes over the drive that are tried [s]; intervals are found between them."""
WIDEST = 0.8
"""Interval [s] beyond which a drift counts as not testable."""
SHORTEST = 30.0
"""Drive below which nothing is asked [s] (ours): a clock that drifts visibly in it would be off by percents."""
TESTED_LAGS = LAGS[::2]
"""Mean offsets that are tried [s]: every second one, which the drift's interpolation does not miss."""
CHANCE_DRIFT = 0.05
"""Standard deviation of an offset's change by the motions that a drive happens to hold [s] (ours)."""
CLEAR = 6.63
"""Chi-square by which a clock has to explain the drifts better than another: 99 % at one degree of freedom."""
_SIGNS = {
    "the gyro": {ENCODER: -1.0, POSE: -1.0},
    "the encoders": {ENCODER: 1.0, RESPONSE: 1.0},
    "the pose": {POSE: 1.0},
    "the commands": {RESPONSE: -1.0},
}
"""Sign with which the lateness of each clock counts in the offset of each pair."""
MOST_BLOCKS = 200
"""Pieces of a drive between which a drift is looked for (ours): 13 MB of moments, whatever the drive's length."""
_NAMES = {ENCODER: ("the gyro", "the encoders"), POSE: ("the gyro", "the pose"), RESPONSE: ("commands", "encoders")}


@dataclass(frozen=True)
class Drift:
    """Change of a pair's offset along the drive.

    Attributes:
        change: from the drive's first to its last instant [s].
        interval: its 99 % interval [s].
        error: its standard error [s].
        seconds: length of the drive [s].
        correlation: of the pair with the drift [-].
    """

    change: float
    interval: Interval
    error: float
    seconds: float
    correlation: float

    @property
    def visible(self) -> bool:
        """Whether it is beyond what clocks do, for certain."""
        return self.interval[0] > DRIFT.expected[1] or self.interval[1] < DRIFT.expected[0]

    @property
    def known(self) -> bool:
        """Whether the drive can tell."""
        return abs(self.correlation) >= LEAST_CORRELATION and self.interval[1] - self.interval[0] <= WIDEST


def clock_drift(recording: Recording, rng: np.random.Generator) -> list[CheckFinding]:
    """Findings on drifting clocks of every pair; the sentence names the clock at fault.

    Args:
        recording: any.
        rng: of the resampling.
    """
    found = {pair: drift_of(recording, pair, rng) for pair in (ENCODER, POSE, RESPONSE)}
    known = {pair: drift for pair, drift in found.items() if drift is not None and drift.known}
    culprits = drifting_clock(known)
    return [_finding(pair, known.get(pair), culprits) for pair in (ENCODER, POSE, RESPONSE)]


def drift_of(recording: Recording, pair: str, rng: np.random.Generator) -> Drift | None:
    """Drift of one pair; None for a short drive, a missing channel or too few blocks with motion."""
    seconds = float(recording.t[-1] - recording.t[0])
    if seconds < SHORTEST or (pair == POSE and not recording.has("pose_yaw", "yaw_rate")):
        return None
    profiles = lag_profiles(recording, pair)
    moving = moving_blocks(profiles.sums)
    sums, t = _grouped(profiles.sums[moving], profiles.t[moving])
    if len(sums) < FEWEST_BLOCKS:
        return None
    share = (t - recording.t[0]) / seconds - 0.5
    shifted = _along_drifts(sums, share)
    values, resampled = resample(shifted, _best_drift, rng)
    error = float(np.nanstd(resampled[:, 0]))
    return Drift(float(values[0]), interval_of(float(values[0]), resampled[:, 0], len(sums)), error, seconds,
                 math.sqrt(max(float(values[1]), 0.0)))  # fmt: skip


def _grouped(sums: FloatArray, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Moments and times of at most :data:`MOST_BLOCKS` blocks, neighbours summed."""
    if len(sums) <= MOST_BLOCKS:
        return sums, t
    starts = np.arange(MOST_BLOCKS) * len(sums) // MOST_BLOCKS
    count = np.diff(np.append(starts, len(sums)))
    return np.add.reduceat(sums, starts), np.add.reduceat(t, starts) / count


def _along_drifts(sums: FloatArray, share: FloatArray) -> FloatArray:
    """Moments of each block at every mean lag and drift (blocks, lags, drifts, 3), interpolated between lags.

    Args:
        sums: at every lag (blocks, lags, 3).
        share: of the drive at which a block lies, -1/2 to 1/2 (blocks,).
    """
    step = float(LAGS[1] - LAGS[0])
    wanted = TESTED_LAGS[None, :, None] + share[:, None, None] * DRIFTS
    place = np.clip((wanted - LAGS[0]) / step, 0.0, len(LAGS) - 1.0)
    low = np.minimum(place.astype(np.int64), len(LAGS) - 2)
    weight = (place - low)[..., None]
    block = np.arange(len(sums))[:, None, None]
    return np.asarray((1 - weight) * sums[block, low] + weight * sums[block, low + 1])


def _best_drift(totals: FloatArray) -> FloatArray:
    """Drift of the largest squared correlation with a parabola through its neighbours, and that square, (m, 2)."""
    square = totals[..., 1] ** 2 / (totals[..., 0] * totals[..., 2])
    by_drift = square.max(axis=1)
    best = np.clip(np.argmax(by_drift, axis=1), 1, len(DRIFTS) - 2)
    rows = np.arange(len(totals))
    left, middle, right = by_drift[rows, best - 1], by_drift[rows, best], by_drift[rows, best + 1]
    bend = left - 2 * middle + right
    shift = np.where(bend < 0, np.clip(0.5 * (left - right) / np.where(bend < 0, bend, 1.0), -1.0, 1.0), 0.0)
    return np.stack([DRIFTS[best] + shift * (DRIFTS[1] - DRIFTS[0]), middle], axis=1)


def drifting_clock(drifts: Mapping[str, Drift]) -> tuple[str, ...]:
    """Clocks of which one drifts; several where the drive cannot tell them apart, none where nothing drifts.

    Each clock that drifts by d predicts a change of every pair that holds it: d where it is the second of the pair,
    -d where it is the first. Least squares over all pairs gives d and a chi-square for each clock.

    Args:
        drifts: that the drive can tell, by pair.
    """
    if not any(drift.visible for drift in drifts.values()):
        return ()
    change = np.array([drift.change for drift in drifts.values()])
    weight = 1.0 / (np.array([drift.error for drift in drifts.values()]) ** 2 + CHANCE_DRIFT**2)
    chi_square = {}
    for clock, signs in _SIGNS.items():
        sign = np.array([signs.get(pair, 0.0) for pair in drifts])
        power = float(np.sum(weight * sign**2))
        if power > 0:
            size = float(np.sum(weight * sign * change)) / power
            chi_square[clock] = float(np.sum(weight * (change - size * sign) ** 2))
    least = min(chi_square.values())
    return tuple(clock for clock, value in chi_square.items() if value - least < CLEAR)


def _finding(pair: str, drift: Drift | None, culprits: tuple[str, ...]) -> CheckFinding:
    if drift is None:
        why = "Whether the clocks drift cannot be determined: the drive is short or the pair shares too little motion."
        return not_testable(CHECK, pair, why, "Drive turns that begin and end, for some minutes.")
    reference, other = _NAMES[pair]
    rate = 1e6 * drift.change / drift.seconds
    meaning = (
        f"Between {reference} and {other} the offset changes by {drift.change:.2f} s in {drift.seconds:.0f} s "
        f"({rate:.0f} ppm, standard error {drift.error:.2g} s)."
    )
    if drift.visible and len(culprits) == 1:
        meaning += f" The clock of {culprits[0]} drifts: it alone explains what all pairs of channels do."
    elif drift.visible:
        meaning += f" The clock of {' or '.join(culprits)} drifts; this drive cannot tell which."
    return DRIFT.answer(pair, drift.change, drift.interval, meaning=meaning)
