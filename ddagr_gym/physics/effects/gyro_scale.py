"""A gyro with the wrong sensitivity."""

from dataclasses import dataclass

from ddagr_gym.physics.effects.base import Effect, Vector, size
from ddagr_gym.physics.layout import POINT_READINGS, READING


def scale_gyro(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Multiply the yaw rate that is read by ``parameters[0]``."""
    row[READING + 2] *= parameters[0]


@dataclass(frozen=True)
class GyroScale(Effect):
    """Factor on the yaw rate that is read; its reversal is gyro_sign.

    Attributes:
        scale: least: 1 percent, 1.8 degrees per half turn, as much as a row turn's radius should be known to.
    """

    name = "gyro_scale"
    title = "Gyro scale"
    group = "sensors"
    equation = "scale * yaw_rate reading"
    source = "IEEE Std 952-2020 (scale factor error); MPU-6050 data sheet: +-3 percent"
    signature = "yaw rate wrong by the same share in every turn, none at rest; the pose disagrees"
    confused_with = ("encoder_scale", "gyro_sign", "lateral_bulldozing")
    actions = ((POINT_READINGS, scale_gyro),)

    scale: float = size("-", 0.1, 10.0, least=0.01, neutral=1.0)
