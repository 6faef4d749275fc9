"""A gyro whose scale or bias rests or the headings of the poses contradict: no simulator is needed to see that.

Beside a real robot's drivetrain no gate of simulated drives holds, so that effects of the library have no name there.
What two channels say of the same turns, or one of a robot that stands, is judged by the recording alone, with the
limits of ``ddagr check``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.special import ndtri

from ddagr_gym.diagnosis.answer.verdict import Estimate, Finding
from ddagr_gym.diagnosis.result.uncertainty import student_quantile
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.gyro_bias import GyroBias
from ddagr_gym.physics.effects.gyro_scale import GyroScale
from ddagr_gym.recordings.checks.blocks import CONFIDENCE
from ddagr_gym.recordings.checks.findings import CheckFinding, Status
from ddagr_gym.recordings.checks.noise import BIAS, noise
from ddagr_gym.recordings.checks.turning import GYRO_SCALE, against_poses
from ddagr_gym.recordings.schema import Recording

_FIELDS: dict[str, tuple[type[Effect], str]] = {
    GYRO_SCALE.check: (GyroScale, "scale"),
    BIAS.check: (GyroBias, "bias"),
}
"""Effect and its field by family of checks."""

_NARROWER = student_quantile(math.inf) / float(ndtri(0.5 + 0.5 * CONFIDENCE))
"""Of an interval of an answer over that of the checks, which are surer."""


def gyro_findings(recordings: Sequence[Recording], rng: np.random.Generator) -> tuple[tuple[Finding, Effect], ...]:
    """Scale and bias of the gyro where every recording that tells them is beyond what counts as sound, to one side.

    Each with the effect that it is. A gyro that turns the wrong way has no scale.

    Args:
        recordings: with the gyro turned the right way.
        rng: of the resampled intervals.
    """
    said = [finding for recording in recordings for finding in _told(recording, rng)]
    found = []
    for check, (kind, field) in _FIELDS.items():
        told = [item for item in said if item.check == check and item.value is not None and item.interval is not None]
        size, limits = _size(told) if _beyond(told) else None, kind.parameter(field).metadata
        if size is not None and limits["low"] <= size.value <= limits["high"]:
            found.append((Finding.seen(kind.name, {field: size}), kind(**{field: size.value})))
    return tuple(found)


def _told(recording: Recording, rng: np.random.Generator) -> list[CheckFinding]:
    """Of the scale by the poses, of the bias at rest and by the poses only where the robot never stands."""
    at_rest = [finding for finding in noise(recording) if finding.check == BIAS.check]
    left = [finding for finding in against_poses(recording, rng) if not (at_rest and finding.check == BIAS.check)]
    return [*at_rest, *left]


def _beyond(told: Sequence[CheckFinding]) -> bool:
    """Whether all of them are suspicious, and all too large or all too small."""
    sides = {item.value > item.expected[1] for item in told if item.value is not None and item.expected is not None}
    return len(sides) == 1 and all(item.status is Status.SUSPICIOUS for item in told)


def _size(told: Sequence[CheckFinding]) -> Estimate:
    """Mean of what the recordings tell, with an interval that holds that of each."""
    values = np.array([item.value for item in told])
    ends = values[:, None] + _NARROWER * (np.array([item.interval for item in told]) - values[:, None])
    return Estimate(float(values.mean()), told[0].unit, (float(ends.min()), float(ends.max())))
