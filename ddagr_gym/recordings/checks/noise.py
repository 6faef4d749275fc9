"""Noise of the inertial channels while the robot stands: level, correlation, bias."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from ddagr_gym.recordings.checks.blocks import CONFIDENCE, mean_interval
from ddagr_gym.recordings.checks.findings import CheckFinding, Interval, Question, judge, not_testable
from ddagr_gym.recordings.checks.signals import standstills
from ddagr_gym.recordings.schema import FloatArray, Recording

NOISE_RANGES = {
    "yaw_rate": (1e-5, 0.05),
    "specific_force_x": (1e-4, 0.5),
    "specific_force_y": (1e-4, 0.5),
    "specific_force_z": (1e-4, 0.5),
}
"""Standard deviation of one sample at rest, in SI: from the quietest to the poorest of sensors (data sheets)."""
CORRELATION = Question(
    "correlation",
    (-0.5, 0.95),
    "-",
    "The channel is filtered or repeats old readings: use fewer samples, or model its correlation.",
    ("sensor_hold",),
)
"""AR(1) coefficient at rest [-]: beyond it the channel is filtered, repeats old readings or oscillates."""
BIAS = Question("bias", (-0.02, 0.02), "rad/s", "Subtract the bias, or fit gyro_bias.", ("gyro_bias",))
"""Gyro reading at rest [rad/s]."""


@dataclass(frozen=True)
class Noise:
    """Noise of one channel at rest.

    Attributes:
        sigma: standard deviation of one sample about the mean of its piece, SI.
        sigma_interval: 99 % interval.
        correlation: AR(1) coefficient [-].
        correlation_interval: 99 % interval.
        quantum: smallest difference between two values, SI.
        means: mean of each piece, SI.
        samples: number of samples.
    """

    sigma: float
    sigma_interval: Interval
    correlation: float
    correlation_interval: Interval
    quantum: float
    means: FloatArray
    samples: int


def noise_at_rest(recording: Recording, name: str) -> Noise | None:
    """Noise of a channel over all pieces in which the robot stands; None where there are fewer than 20 samples."""
    pieces = [recording[name][s][np.isfinite(recording[name][s])] for s in standstills(recording)]
    pieces = [p for p in pieces if p.size >= 8]
    samples = sum(p.size for p in pieces)
    if samples < 20:
        return None
    rest = [p - p.mean() for p in pieces]
    power = math.fsum(float(r @ r) for r in rest)
    correlation = math.fsum(float(r[1:] @ r[:-1]) for r in rest) / power if power > 0 else 0.0
    sigma = math.sqrt(power / (samples - len(pieces)))
    # Correlated samples count for less (Bartlett's formula for the variance of a variance).
    effective = max(2.0, samples * (1 - correlation**2) / (1 + correlation**2))
    z = float(ndtri((1 + CONFIDENCE) / 2))
    wide, around = z / math.sqrt(2 * effective), z * math.sqrt(max(1 - correlation**2, 1e-3) / samples)
    levels = np.unique(np.concatenate(pieces))
    return Noise(
        sigma,
        (sigma * max(0.0, 1 - wide), sigma * (1 + wide)),
        correlation,
        (correlation - around, correlation + around),
        float(np.min(np.diff(levels))) if levels.size > 1 else 0.0,
        np.array([p.mean() for p in pieces]),
        samples,
    )


def noise(recording: Recording) -> list[CheckFinding]:
    """Findings on level, correlation and bias of the inertial channels at rest."""
    findings = []
    for name, expected in NOISE_RANGES.items():
        if not recording.has(name):
            continue
        found = noise_at_rest(recording, name)
        if found is None:
            why = "The robot never stands for long enough."
            findings.append(not_testable("noise", name, why, "Let the robot stand for 10 s before and after a drive."))
            continue
        findings += [_level(name, found, expected), _correlation(name, found)]
        if name == "yaw_rate":
            findings.append(_bias(found))
    return findings


def _level(name: str, found: Noise, expected: Interval) -> CheckFinding:
    unit = "rad/s" if name == "yaw_rate" else "m/s^2"
    return judge(
        "noise",
        name,
        found.sigma,
        found.sigma_interval,
        expected,
        unit,
        meaning=(
            f"At rest one sample scatters by {found.sigma:.3g} {unit} "
            f"({found.samples} samples, quantum {found.quantum:.2g})."
        ),
        remedy="No noise at all means a dead, filtered or repeated channel; very much means vibration or a wrong unit.",
        suspects=("sensor_hold",) if found.sigma < expected[0] else (),
    )


def _correlation(name: str, found: Noise) -> CheckFinding:
    return CORRELATION.answer(
        name,
        found.correlation,
        found.correlation_interval,
        meaning=f"At rest successive samples correlate by {found.correlation:.2f}.",
    )


def _bias(found: Noise) -> CheckFinding:
    bias, interval = mean_interval(found.means)
    if found.means.size < 2:
        scatter = found.sigma * math.sqrt((1 + found.correlation) / (1 - min(found.correlation, 0.99)) / found.samples)
        half = float(ndtri((1 + CONFIDENCE) / 2)) * scatter
        interval = (bias - half, bias + half)
    return BIAS.answer("yaw_rate", bias, interval, meaning=f"The gyro reads {bias:.2g} rad/s at rest.")
