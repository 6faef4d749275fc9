"""Encoders that are wrong by far: poses and commands agree against them.

Encoders of which both edges are counted where the driver expects one, or that sit behind a gear, read a multiple of the
speed. Then poses travel a share of what wheels seem to roll, as with smaller wheels, and the banks seem to settle far
from their commands, as those of another robot would. Both at once, by the same factor, is the encoders' scale. No fit
is needed to see that, and none is possible before it is undone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.answer.verdict import Estimate, Finding
from ddagr_gym.diagnosis.preprocessing.scaled_readings import without_scales
from ddagr_gym.physics.effects.encoder_scale import EncoderScale
from ddagr_gym.recordings.checks.travel import GAIN, command_gains, rolled_and_travelled, share_with_least_slip
from ddagr_gym.recordings.checks.turning import BALANCE, effective_track
from ddagr_gym.recordings.schema import Recording

Array = NDArray[np.float64]

LEAST_SLIP = (0.97, 1.17)
"""Travelled over rolled distance where a sound robot slips least [-] (ours): 0.99 to 1.17 in three minutes of six
ordinary drives, 0.97 on simulated ice."""

FAR = 1.25
"""Mean scale of both, or one over it, from which they are found here (ours): with less, a fit finds it, and with more
there can be none, since poses travel too little or too much of what wheels seem to roll."""


def encoder_findings(
    recordings: Sequence[Recording], rng: np.random.Generator
) -> tuple[tuple[Finding, EncoderScale], ...]:
    """Scales of encoders that poses and commands both contradict in every recording, with the effect that they are.

    Args:
        recordings: with the gyro turned the right way.
        rng: of the intervals of the checks.
    """
    found = [scales for scales in (_scales(recording, rng) for recording in recordings) if scales is not None]
    if not found or len(found) < len(recordings):
        return ()
    right, left = (_together(of_bank) for of_bank in np.stack(found, axis=1))
    return ((Finding.seen(EncoderScale.name, {"right": right, "left": left}), EncoderScale(right.value, left.value)),)


def _scales(recording: Recording, rng: np.random.Generator) -> Array | None:
    """Scales of the right and the left encoder (2, 3) by poses and gyro: lowest, likeliest, highest.

    None where the encoders are not far off, or where commands do not say the same.
    """
    geometry, gains = recording.meta.geometry, command_gains(recording, rng)
    if geometry is None or gains is None:
        return None
    ratio = _left_over_right(recording, rng)
    alike = without_scales(recording, [EncoderScale(1.0, ratio)])
    share = share_with_least_slip(rolled_and_travelled(alike, rng), geometry.wheel_radius)
    if share is None or share <= 0.0:
        return None
    low, high = LEAST_SLIP
    scales = np.outer([1.0, ratio], [low, math.sqrt(low * high), high]) / share
    likely = scales[:, 1]
    if abs(np.log(likely).mean()) <= math.log(FAR):
        return None
    contradicted = not all(map(_is_usual, gains.values[:2]))
    return scales if contradicted and all(map(_is_usual, gains.values[:2] / likely)) else None


def _is_usual(gain: float) -> bool:
    low, high = GAIN.expected
    return low <= gain <= high


def _left_over_right(recording: Recording, rng: np.random.Generator) -> float:
    """Scale of the left encoder over that of the right one, by the turns that each makes; 1 where they may be alike."""
    track = effective_track(recording, rng)
    if track is None:
        return 1.0
    low, high = track.intervals[1]
    apart = low > BALANCE.expected[1] or 0.0 < high < BALANCE.expected[0]
    return float(track.values[1]) if apart else 1.0


def _together(scales: Array) -> Estimate:
    """Mean of what drives say (N, 3), with an interval that holds that of each."""
    low, likely, high = scales.T
    return Estimate(float(np.exp(np.log(likely).mean())), "-", (float(low.min()), float(high.max())))
