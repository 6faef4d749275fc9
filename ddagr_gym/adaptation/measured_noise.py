"""Sensors as noisy as recordings show them: an accelerometer that shakes with the robot is no data sheet's."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ddagr_gym.identification.noise import ChannelNoise, noise_about_lines
from ddagr_gym.identification.signals import travel_speed
from ddagr_gym.parameters import Robot, Sensors
from ddagr_gym.recordings.checks.noise import noise_at_rest
from ddagr_gym.recordings.schema import Recording

_MEAN = 0.5
"""Time over which noise is averaged [s] (ours): longer than it hangs together, shorter than a turn's motion."""

_LEAST_SPEED = 0.02
"""Mean speed of the rims below which a robot does not shake [m/s] (ours)."""


def measured_sensors(recordings: Sequence[Recording], robot: Robot, sensors: Sensors = Sensors()) -> Sensors:
    """Sensors whose accelerometer and gyro have the noise of recordings, where that is more than they had.

    What the accelerometer has more while driving than at rest is its vibration, in proportion to the speed. Means over
    half a second count: noise that hangs together is as bad as more noise that does not.

    Args:
        recordings: of one robot.
        robot: whose wheels tell the speed.
        sensors: nominal; noise is that of a sample at their rate.
    """
    scale = math.sqrt(sensors.imu.sample_rate)
    axes = [f"specific_force_{axis}" for axis in "xy"]
    rest = max(sensors.imu.accelerometer_noise, *(scale * _resting(recordings, name) for name in axes))
    *along_and_across, turning = (scale * density for density in _driving(recordings, (*axes, "yaw_rate")))
    driving = max(along_and_across)
    speed = _mean_speed(recordings, robot)
    shaking = max(driving - rest, 0.0) / speed if speed > 0.0 else 0.0
    imu = replace(
        sensors.imu,
        accelerometer_noise=rest,
        accelerometer_vibration=max(shaking, sensors.imu.accelerometer_vibration),
        gyro_noise=max(turning, sensors.imu.gyro_noise),
    )
    return replace(sensors, imu=imu)


def _mean_speed(recordings: Sequence[Recording], robot: Robot) -> float:
    """Of the rims while the robot drives [m/s]; 0 where it never does."""
    speeds = np.concatenate([travel_speed(recording, robot.outer_radius) for recording in recordings])
    moving = speeds[speeds > _LEAST_SPEED]
    return float(moving.mean()) if moving.size else 0.0


def _resting(recordings: Sequence[Recording], channel: str) -> float:
    """Root mean square noise of a channel at rest over recordings [unit/sqrt(Hz)]; 0 where none shows it."""
    found = []
    for recording in recordings:
        at_rest = noise_at_rest(recording, channel) if recording.has(channel) else None
        if at_rest is not None:
            noise = ChannelNoise(at_rest.sigma, correlation=at_rest.correlation)
            found.append(_density(noise, _spacing(recording, channel)))
    return _joined(found)


def _driving(recordings: Sequence[Recording], channels: Sequence[str]) -> list[float]:
    """The same of channels on the way, about straight lines."""
    known = [(recording, noise_about_lines(recording)) for recording in recordings]

    def densities(channel: str) -> list[float]:
        having = [(recording, noise[channel]) for recording, noise in known if recording.has(channel)]
        return [_density(noise, _spacing(recording, channel)) for recording, noise in having]

    return [_joined(densities(channel)) for channel in channels]


def _spacing(recording: Recording, channel: str) -> float:
    """Usual time between readings of a channel, whole periods of the rows [s]."""
    rate = recording.rate(channel)
    return recording.period * (max(round(1.0 / (rate * recording.period)), 1) if rate > 0.0 else 1)


def _density(noise: ChannelNoise, period: float) -> float:
    """Of means [unit/sqrt(Hz)]."""
    count = max(round(_MEAN / period), 1)
    return float(noise.of_mean(count)) * math.sqrt(count * period)


def _joined(densities: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(densities)))) if densities else 0.0
