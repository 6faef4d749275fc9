"""From the truth of a drive to what the robot logged.

The noise-free readings and the noise are made apart, so that a case can be compared with its twin without the effect.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from .change import Change
from .drive import SAMPLE_PERIOD
from .noise import first_order, pink
from .plant import GRAVITY, Plant

COLUMNS = ("t", "cmd_right", "cmd_left", "enc_right", "enc_left", "imu_ax", "imu_ay", "imu_gz", "x", "y", "yaw")
"""Columns of a recording, in order."""
COUNTS = 20000
"""Encoder counts per wheel turn."""
POSE_EVERY = 10
"""Samples between poses: 5 Hz."""
POSITION_NOISE, YAW_NOISE = 0.012, 0.008
"""[m], [rad]"""

Truth = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class SensorNoise:
    """Noise of one case's sensors."""

    accelerometer: float = 0.03
    """White part at rest [m/s^2]."""
    accelerometer_per_speed: float = 0.25
    """AR(1) part per wheel tread speed [m/s^2 per m/s]."""
    accelerometer_correlation: float = 0.6
    """Of the AR(1) part between samples [-]."""
    accelerometer_pink: float = 0.008
    """[m/s^2]"""
    accelerometer_offset: tuple[float, float] = (0.0, 0.0)
    """Left over by the calibration [m/s^2]."""
    gyro: float = 0.003
    """White part [rad/s]."""
    gyro_pink: float = 0.0002
    """[rad/s]"""
    gyro_offset: float = 0.0
    """Left over by the calibration [rad/s]."""
    pose_correlated_share: float = 0.3
    """Share of the pose's variance that wanders over seconds [-]."""


def _encoder_speed(angles: np.ndarray) -> np.ndarray:
    """Counts differenced over a sample, (samples, 2) [rad/s]."""
    counts = np.floor(angles * COUNTS / (2.0 * np.pi))
    return np.diff(counts, axis=0, prepend=counts[:1]) * (2.0 * np.pi / COUNTS / SAMPLE_PERIOD)


def _inertial(truth: Truth, plant: Plant) -> np.ndarray:
    """Specific force x, y, z and yaw rate at the body origin, (samples, 4)."""
    reach_x, reach_y = -plant.body.mass_x, -plant.body.mass_y
    turn, swing = truth["yaw_rate"], truth["yaw_acceleration"]
    force_x = truth["force_x"] - swing * reach_y - turn**2 * reach_x
    force_y = truth["force_y"] + swing * reach_x - turn**2 * reach_y
    return np.column_stack([force_x, force_y, np.full_like(turn, GRAVITY), turn])


def readings(
    truth: Truth, plant: Plant, commands: np.ndarray, changes: tuple[Change, ...], rng: np.random.Generator
) -> dict[str, np.ndarray]:
    """Noise-free readings at 50 Hz, pose included at every sample.

    Args:
        truth: from :func:`benchmarks.concealed.drive.drive`.
        plant: that was driven.
        commands: (samples, 2) as logged [rad/s].
        changes: sensor effects are taken from these.
        rng: for effects that draw numbers.

    Returns:
        Arrays (samples,) by the names of ``COLUMNS``.
    """
    angles = np.column_stack([truth["angle_right"], truth["angle_left"]])
    inertial = _inertial(truth, plant)
    pose = np.column_stack([truth["x"], truth["y"], truth["yaw"]])
    for change in changes:
        angles = change.encoder(angles, truth, rng) if change.encoder else angles
        inertial = change.inertial(inertial, truth, rng) if change.inertial else inertial
        pose = change.pose(pose, truth, rng) if change.pose else pose
    encoder = _encoder_speed(angles)
    time = np.arange(len(pose)) * SAMPLE_PERIOD
    columns = (time, commands[:, 0], commands[:, 1], encoder[:, 0], encoder[:, 1])
    columns += (inertial[:, 0], inertial[:, 1], inertial[:, 3], pose[:, 0], pose[:, 1], pose[:, 2])
    return dict(zip(COLUMNS, columns, strict=True))


def _pose_noise(noise: SensorNoise, rng: np.random.Generator, samples: int) -> np.ndarray:
    white, slow = np.sqrt(1.0 - noise.pose_correlated_share), np.sqrt(noise.pose_correlated_share)
    return white * rng.standard_normal(samples) + slow * first_order(rng, samples, 0.995)


def with_noise(
    clean: Mapping[str, np.ndarray],
    truth: Truth,
    noise: SensorNoise,
    changes: tuple[Change, ...],
    receiver: bool,
    rng: np.random.Generator,
) -> dict[str, np.ndarray]:
    """Add noise, thin the pose to 5 Hz, then apply the effects that act on the logged numbers.

    Without ``receiver`` the pose columns are empty (NaN), but the same random numbers are drawn.
    """
    logged = {name: values.copy() for name, values in clean.items()}
    samples = len(logged["t"])
    tread = 0.2794 * 0.5 * (np.abs(truth["omega_right"]) + np.abs(truth["omega_left"]))
    for axis, name in enumerate(("imu_ax", "imu_ay")):
        shaking = noise.accelerometer_per_speed * tread * first_order(rng, samples, noise.accelerometer_correlation)
        resting = noise.accelerometer * rng.standard_normal(samples) + noise.accelerometer_pink * pink(rng, samples)
        logged[name] += shaking + resting + noise.accelerometer_offset[axis]
    logged["imu_gz"] += noise.gyro * rng.standard_normal(samples) + noise.gyro_pink * pink(rng, samples)
    logged["imu_gz"] += noise.gyro_offset
    for name, size in (("x", POSITION_NOISE), ("y", POSITION_NOISE), ("yaw", YAW_NOISE)):
        logged[name] += size * _pose_noise(noise, rng, samples)
        logged[name][np.arange(samples) % POSE_EVERY != 0] = np.nan
    logged["yaw"] = np.arctan2(np.sin(logged["yaw"]), np.cos(logged["yaw"]))
    for change in changes:
        logged = change.logged(logged, rng) if change.logged else logged
    if not receiver:
        for name in ("x", "y", "yaw"):
            logged[name] = np.full(samples, np.nan)
    return logged
