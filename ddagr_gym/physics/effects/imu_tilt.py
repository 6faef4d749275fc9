"""An IMU that does not lie level in the robot: gravity leaks into its horizontal axes."""

import math
from dataclasses import dataclass

from ddagr_gym.physics.effects.base import Effect, Vector, size
from ddagr_gym.physics.layout import GRAVITY, POINT_READINGS, READING


def tilt_sensor(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Specific force and yaw rate in axes rolled by ``parameters[0]``, then pitched by ``parameters[1]``."""
    cos_roll = math.cos(parameters[0])
    sin_roll = math.sin(parameters[0])
    cos_pitch = math.cos(parameters[1])
    sin_pitch = math.sin(parameters[1])
    x = row[READING]
    z = -row[GRAVITY + 2]
    row[READING] = cos_pitch * x - sin_pitch * z
    row[READING + 1] = cos_roll * row[READING + 1] + sin_roll * (sin_pitch * x + cos_pitch * z)
    row[READING + 2] *= cos_roll * cos_pitch


@dataclass(frozen=True)
class ImuTilt(Effect):
    """Sensor axes rolled and pitched against the robot (R = R_y(pitch) R_x(roll), REP 103).

    On level ground it differs from accelerometer_bias in the second order only.

    Attributes:
        roll: left side up positive; least: half a degree, 0.086 m/s^2 of gravity.
        pitch: nose down positive; least: the same.
    """

    name = "imu_tilt"
    title = "Tilted IMU"
    group = "sensors"
    equation = "R^T (specific force, with g cos(slope) upwards); on the level (-g sin pitch, g sin roll cos pitch)"
    source = "IEEE Std 1293-2018 (misalignment terms); REP 103"
    signature = "specific force shifted by the same amount at every heading; yaw rate smaller by the cosines"
    confused_with = ("accelerometer_bias", "slope")
    actions = ((POINT_READINGS, tilt_sensor),)

    roll: float = size("rad", -0.6, 0.6, least=0.0087)
    pitch: float = size("rad", -0.6, 0.6, least=0.0087, default=0.0)
