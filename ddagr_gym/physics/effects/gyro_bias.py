"""A gyro that turns while the robot stands."""

from dataclasses import dataclass

from ddagr_gym.physics.effects.base import Effect, Vector, size
from ddagr_gym.physics.layout import POINT_READINGS, READING


def shift_gyro(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Add ``parameters[0]`` to the yaw rate that is read."""
    row[READING + 2] += parameters[0]


@dataclass(frozen=True)
class GyroBias(Effect):
    """Constant added to the yaw rate that is read.

    Attributes:
        bias: least: 0.1 deg/s, six degrees of heading per minute.
    """

    name = "gyro_bias"
    title = "Gyro bias"
    group = "sensors"
    equation = "yaw_rate reading + bias"
    source = "IEEE Std 952-2020 (gyro error model); MPU-6050 data sheet: +-20 deg/s zero-rate output"
    signature = "yaw rate of the same size at rest, straight ahead and in either turn; the pose disagrees"
    confused_with = ("wheel_radius_mismatch",)
    actions = ((POINT_READINGS, shift_gyro),)

    bias: float = size("rad/s", -1.0, 1.0, least=0.0017)
