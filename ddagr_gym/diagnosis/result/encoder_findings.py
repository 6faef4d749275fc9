"""Encoders that are wrong by far: poses and commands both contradict them.

Encoders of which both edges are counted where the driver expects one, or that sit behind a gear, read a multiple of the
speed. Poses then travel a share of what wheels seem to roll, as with smaller wheels, and the banks seem to settle far
from their commands. Where both are beyond what slip and motors may do, and undoing the factor that the poses ask for
leaves the banks near their commands, it is the encoders' scale. No fit is needed to see that, and none is possible
before it is undone.

Commands that were computed from the body's motion with a wrong wheel radius, and wheels of that radius, look the same.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.answer.verdict import Estimate, Finding
from ddagr_gym.diagnosis.preprocessing.known_errors import with_readings_over
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.encoder_scale import EncoderScale
from ddagr_gym.recordings.checks.command_gains import GAIN, command_gains
from ddagr_gym.recordings.checks.travel import LEAST_SLIP, drive_share_with_least_slip
from ddagr_gym.recordings.checks.turning import left_over_right
from ddagr_gym.recordings.schema import Recording

Array = NDArray[np.float64]

FAR = 1.25
"""Mean scale of both encoders, or one over it, from which they are found here (ours): less may be slip, tyres and
motors."""

_LIMITS = EncoderScale.parameter("right").metadata

Named = tuple[Finding | None, Effect]
"""A finding, None where it is not worth a name, with the effect that it is."""

BANKS = ("right", "left")


def encoder_findings(
    recordings: Sequence[Recording], rng: np.random.Generator
) -> tuple[tuple[Finding, EncoderScale], ...]:
    """Scales of the encoders where every recording that tells them finds both encoders far off, by the same factors.

    Args:
        recordings: with the gyro turned the right way.
        rng: of the intervals of the checks.
    """
    told = [item for item in (_scales_and_gains(recording, rng) for recording in recordings) if item is not None]
    if not told or not all(_far_off(scales, gains) for scales, gains in told):
        return ()
    low, likely, high = np.stack([scales for scales, _ in told], axis=-1).transpose(1, 0, 2)
    scales = np.exp(np.log(likely).mean(axis=1))
    agree = bool(np.all(low.max(axis=1) <= high.min(axis=1)))
    if not agree or scales.min() < _LIMITS["low"] or scales.max() > _LIMITS["high"]:
        return ()
    ends = zip(low.min(axis=1).tolist(), high.max(axis=1).tolist(), strict=True)
    sizes = {name: Estimate(value, "-", end) for name, value, end in zip(BANKS, scales.tolist(), ends, strict=True)}
    return ((Finding.seen(EncoderScale.name, sizes), EncoderScale(*scales.tolist())),)


def with_encoders(encoders: Sequence[tuple[Finding, EncoderScale]], sensors: Sequence[Named]) -> tuple[Named, ...]:
    """Findings of a fit with encoders that were undone before it; what it found of them on top goes into their scales.

    Args:
        encoders: of :func:`encoder_findings`.
        sensors: of the fit, with their effects.
    """
    if not encoders:
        return tuple(sensors)
    left = [effect for _, effect in sensors if isinstance(effect, EncoderScale)]
    others = [item for item in sensors if not isinstance(item[1], EncoderScale)]
    return (*others, *(_refined(finding, seen, left) for finding, seen in encoders))


def _refined(finding: Finding, seen: EncoderScale, fitted: Sequence[EncoderScale]) -> tuple[Finding, EncoderScale]:
    """Scales times those of a fit, as far as a simulator has them."""
    products = {name: math.prod(getattr(effect, name) for effect in (seen, *fitted)) for name in BANKS}
    scales = {name: min(max(product, _LIMITS["low"]), _LIMITS["high"]) for name, product in products.items()}
    sizes = {name: _at(size, scales[name]) for name, size in finding.parameters.items()}
    return replace(finding, parameters=sizes), EncoderScale(**scales)


def or_wheel_radius(scale: EncoderScale, robot: str) -> str:
    """What else encoders that read alike may be, for a warning.

    Args:
        scale: of both.
        robot: name of its data sheet.
    """
    return (
        f"poses and commands say that the encoders read {scale.right:.2f} times the wheels' speed. If commands were "
        f"computed with another wheel radius than that of {robot}, or if this is another robot, it is the radius: give "
        "the robot's own data sheet with --robot FILE.yaml."
    )


def _at(size: Estimate, value: float) -> Estimate:
    """Another value in an interval that holds it, too."""
    low, high = size.interval or (value, value)
    return Estimate(value, size.unit, (min(low, value), max(high, value)))


def _scales_and_gains(recording: Recording, rng: np.random.Generator) -> tuple[Array, Array] | None:
    """Scales of the right and the left encoder by the poses (2, 3): lowest, likeliest, highest; and gains (2,).

    The gains are bank speeds by the encoders over commands. None where a drive cannot tell them.
    """
    gains = command_gains(recording, rng)
    if recording.meta.geometry is None or gains is None:
        return None
    ratio = left_over_right(recording, rng) or 1.0
    alike = recording if ratio == 1.0 else with_readings_over(recording, {"encoder_left": ratio})
    share = drive_share_with_least_slip(alike, rng)
    if share is None or share <= 0.0:
        return None
    low, high = LEAST_SLIP
    return np.outer([1.0, ratio], [low, math.sqrt(low * high), high]) / share, gains.values[:2]


def _far_off(scales: Array, gains: Array) -> bool:
    """Whether encoders are far off by the poses, and commands say so too: without the scales they are as usual."""
    likely = scales[:, 1]
    far = abs(np.log(likely).mean()) > math.log(FAR)
    return bool(far and not _usual(gains) and _usual(gains / likely))


def _usual(gains: Array) -> bool:
    low, high = GAIN.expected
    return bool(np.all((gains >= low) & (gains <= high)))
