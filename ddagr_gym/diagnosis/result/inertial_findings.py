"""Gyro and accelerometer that rests or the poses contradict: no simulator is needed to see that.

Beside a real robot's drivetrain no gate of simulated drives holds, so that effects of the library have no name there.
What two channels say of the same turns, or one of a robot that stands, is judged by the recording alone, with the
limits of ``ddagr check``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ddagr_gym.diagnosis.answer.verdict import Estimate, Finding
from ddagr_gym.diagnosis.result.uncertainty import answer_interval
from ddagr_gym.parameters import STANDARD_GRAVITY
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.accelerometer_bias import AccelerometerBias
from ddagr_gym.physics.effects.gyro_bias import GyroBias
from ddagr_gym.physics.effects.gyro_scale import GyroScale
from ddagr_gym.physics.effects.imu_tilt import ImuTilt
from ddagr_gym.recordings.checks.findings import CheckFinding, Status
from ddagr_gym.recordings.checks.gravity import gravity
from ddagr_gym.recordings.checks.noise import BIAS, noise
from ddagr_gym.recordings.checks.turning import GYRO_SCALE, against_poses
from ddagr_gym.recordings.schema import Recording

_FIELDS: dict[str, tuple[type[Effect], str]] = {
    GYRO_SCALE.check: (GyroScale, "scale"),
    BIAS.check: (GyroBias, "bias"),
}
"""Effect and its field by family of checks."""

_READ_AS = (("pitch", "specific_force_x", -1.0), ("roll", "specific_force_y", 1.0))
"""Tilt, the axis along which it reads gravity, and its sign; the roll comes behind the pitch."""

LARGEST_TILT = 0.3
"""Up to which gravity along an axis is called a tilt [rad] (ours): beyond it the gyro reads 5 % less of every turn,
too, and its axes are not those of the robot."""

Named = tuple[Finding, Effect]


def inertial_findings(recordings: Sequence[Recording], rng: np.random.Generator) -> tuple[Named, ...]:
    """What of the IMU every recording that tells it finds beyond what counts as sound, to one side.

    Each with the effect that it is.

    Args:
        recordings: with the gyro turned the right way.
        rng: of the resampled intervals.
    """
    return (*_gyro(recordings, rng), *_accelerometer(recordings))


def _gyro(recordings: Sequence[Recording], rng: np.random.Generator) -> tuple[Named, ...]:
    """Scale and bias of the gyro; one that turns the wrong way has no scale."""
    said = [finding for recording in recordings for finding in _told(recording, rng)]
    found = []
    for check, (kind, field) in _FIELDS.items():
        told = [item for item in said if item.check == check and item.value is not None and item.interval is not None]
        size, limits = _size(told) if _beyond(told) else None, kind.parameter(field).metadata
        if size is not None and limits["low"] <= size.value <= limits["high"]:
            found.append((Finding.seen(kind.name, {field: size}), kind(**{field: size.value})))
    return tuple(found)


def _accelerometer(recordings: Sequence[Recording]) -> tuple[Named, ...]:
    """A tilt by what rests read along the robot's axes beside the attitude of the poses, or at several headings alike.

    A bias of the accelerometer does the same.
    """
    said = [finding for recording in recordings for finding in gravity(recording) if finding.interval is not None]
    sizes: dict[str, Estimate] = {}
    for field, channel, sign in _READ_AS:
        told = [item for item in said if item.channel == channel]
        if told and _beyond(told):
            pitched = sizes["pitch"].value if "pitch" in sizes else 0.0
            sizes[field] = _angle(_size(told), sign * STANDARD_GRAVITY * math.cos(pitched))
    if not sizes or max(abs(size.value) for size in sizes.values()) > LARGEST_TILT:
        return ()
    weights = {ImuTilt.name: 0.5, AccelerometerBias.name: 0.5}
    finding = replace(Finding.seen(ImuTilt.name, sizes), equivalence_set=weights)
    return ((finding, ImuTilt(**{"roll": 0.0, **{field: size.value for field, size in sizes.items()}})),)


def _angle(read: Estimate, gravity: float) -> Estimate:
    """Angle at which an axis reads so much of gravity [m/s^2]; more than all of it is a right angle."""
    low, high = read.interval or (read.value, read.value)
    value, *ends = (math.asin(max(-1.0, min(1.0, item / gravity))) for item in (read.value, low, high))
    return Estimate(value, "rad", (min(ends), max(ends)))


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
    ends = [
        end
        for item in told
        if item.value is not None and item.interval is not None
        for end in answer_interval(item.value, item.interval)
    ]
    return Estimate(float(values.mean()), told[0].unit, (min(ends), max(ends)))
