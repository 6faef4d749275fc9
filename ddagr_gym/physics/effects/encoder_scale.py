"""Encoders with the wrong number of counts or the wrong gear ratio."""

from dataclasses import dataclass

from ddagr_gym.physics.effects.base import Effect, Vector, size
from ddagr_gym.physics.layout import POINT_READINGS, READING


def scale_encoders(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Multiply the bank speeds that are read, right and left."""
    row[READING + 3] *= parameters[0]
    row[READING + 4] *= parameters[1]


@dataclass(frozen=True)
class EncoderScale(Effect):
    """Factors on the bank speeds that are read.

    Attributes:
        right: least: 1 percent, 10 cm in a 10 m row.
        left: least: the same.
    """

    name = "encoder_scale"
    title = "Encoder scale"
    group = "sensors"
    equation = "(right omega_right, left omega_left) readings"
    source = "systematic odometry errors (Borenstein and Feng, IEEE Trans. Robotics and Automation 12 (1996) 869)"
    signature = "bank speed wrong by the same share at every speed; the robot itself moves as it should"
    confused_with = ("gyro_scale", "motor_droop", "soil_change", "wheel_radius_mismatch")
    actions = ((POINT_READINGS, scale_encoders),)

    right: float = size("-", 0.1, 10.0, least=0.01, neutral=1.0)
    left: float = size("-", 0.1, 10.0, least=0.01, default=1.0, neutral=1.0)
