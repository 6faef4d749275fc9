"""A gyro whose scale or bias the headings of the poses contradict: no simulator is needed to see that.

Beside a real robot's drivetrain no gate of simulated drives holds, so that effects of the library have no name there.
What two channels say of the same turns is judged by the recording alone, with the limits of ``ddagr check``.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import ndtri

from ddagr_gym.diagnosis.answer.verdict import Estimate, Finding
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.gyro_bias import GyroBias
from ddagr_gym.physics.effects.gyro_scale import GyroScale
from ddagr_gym.recordings.checks.blocks import CONFIDENCE
from ddagr_gym.recordings.checks.findings import CheckFinding, Status
from ddagr_gym.recordings.checks.turning import GYRO_BIAS, GYRO_SCALE, against_poses
from ddagr_gym.recordings.schema import Recording

_FIELDS: dict[str, tuple[type[Effect], str]] = {
    GYRO_SCALE.check: (GyroScale, "scale"),
    GYRO_BIAS.check: (GyroBias, "bias"),
}
"""Effect and its field by family of checks."""

_NARROWER = float(ndtri(0.95) / ndtri(0.5 + 0.5 * CONFIDENCE))
"""Of an interval of 90 % over that of the checks."""


def gyro_findings(recordings: Sequence[Recording], rng: np.random.Generator) -> tuple[tuple[Finding, Effect], ...]:
    """Scale and bias of the gyro where every recording that tells them is outside what counts as sound.

    Each with the effect that it is.

    Args:
        recordings: with the gyro turned the right way.
        rng: of the resampled intervals.
    """
    said = [finding for recording in recordings for finding in against_poses(recording, rng)]
    found = []
    for check, (kind, field) in _FIELDS.items():
        told = [item for item in said if item.check == check and item.status is not Status.NOT_TESTABLE]
        if told and all(item.status is Status.SUSPICIOUS for item in told):
            size = _size(told)
            finding = Finding(kind.name, {field: size}, 0.0, 0.0, 0.0, 0.0, {}, {kind.name: 1.0})
            found.append((finding, kind(**{field: size.value})))
    return tuple(found)


def _size(told: Sequence[CheckFinding]) -> Estimate:
    """Mean of what the recordings tell, with an interval as wide as the widest to either side."""
    values = [item.value for item in told if item.value is not None]
    ends = [_NARROWER * (end - item.value) for item in told if item.value and item.interval for end in item.interval]
    value = float(np.mean(values))
    return Estimate(value, told[0].unit, (value + min(ends), value + max(ends)))
