"""An IMU turned about its vertical axis against the robot."""

import math
from dataclasses import dataclass

from ddagr_gym.physics.effects.base import Effect, Vector, size
from ddagr_gym.physics.layout import POINT_READINGS, READING


def rotate_accelerometer(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Specific force in axes turned by ``parameters[0]``."""
    cosine = math.cos(parameters[0])
    sine = math.sin(parameters[0])
    x = row[READING]
    y = row[READING + 1]
    row[READING] = cosine * x + sine * y
    row[READING + 1] = cosine * y - sine * x


@dataclass(frozen=True)
class ImuMisalignment(Effect):
    """Sensor axes turned about the vertical, counter-clockwise positive.

    Attributes:
        yaw: least: 2 degrees, what the eye sees when mounting the sensor.
    """

    name = "imu_misalignment"
    title = "Turned IMU"
    group = "sensors"
    equation = "(x cos yaw + y sin yaw, y cos yaw - x sin yaw) of the specific force reading"
    source = "IEEE Std 1293-2018 (misalignment terms)"
    signature = "starts and stops show across, centripetal force shows along; gyro unchanged"
    confused_with = ("accelerometer_sign", "imu_lever_arm")
    actions = ((POINT_READINGS, rotate_accelerometer),)

    yaw: float = size("rad", -3.15, 3.15, least=0.035)
