"""An IMU that is not where the nominal robot has it."""

import math
from dataclasses import dataclass

from ddagr_gym.physics.effects.base import Effect, Vector, size
from ddagr_gym.physics.layout import (
    ACCELEROMETER_SCALE,
    IMU_MOUNTING_YAW,
    MEAN_YAW_ACCELERATION,
    POINT_READINGS,
    READING,
    YAW_RATE,
)


def move_sensor(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Add the transport terms of a lever arm ``parameters[:2]``, in the sensor's axes."""
    rate = row[YAW_RATE]
    turn = row[MEAN_YAW_ACCELERATION]
    force_x = -turn * parameters[1] - rate * rate * parameters[0]
    force_y = turn * parameters[0] - rate * rate * parameters[1]
    cosine = math.cos(row[IMU_MOUNTING_YAW])
    sine = math.sin(row[IMU_MOUNTING_YAW])
    row[READING] += row[ACCELEROMETER_SCALE] * (cosine * force_x + sine * force_y)
    row[READING + 1] += row[ACCELEROMETER_SCALE + 1] * (cosine * force_y - sine * force_x)


@dataclass(frozen=True)
class ImuLeverArm(Effect):
    """Position of the accelerometer beyond its nominal one.

    Attributes:
        x: forward; least: 0.1 m, what a tape measure on a cluttered deck leaves open.
        y: to the left; least: the same.
    """

    name = "imu_lever_arm"
    title = "IMU lever arm"
    group = "sensors"
    equation = "specific force + (-yaw_acceleration y - yaw_rate^2 x, yaw_acceleration x - yaw_rate^2 y)"
    source = "theory: wheel model, eq. (35); Farrell, Aided Navigation"
    signature = "specific force at the start and end of turns, and with the square of the yaw rate; none straight"
    confused_with = ("centre_of_mass_offset", "imu_misalignment")
    actions = ((POINT_READINGS, move_sensor),)

    x: float = size("m", -5.0, 5.0, least=0.1)
    y: float = size("m", -5.0, 5.0, least=0.1, default=0.0)
