"""A gyro mounted upside down or logged with the other sign."""

from dataclasses import dataclass

from ddagr_gym.physics.effects.base import Effect, Vector, size
from ddagr_gym.physics.layout import POINT_READINGS, READING


def flip_gyro(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Multiply the yaw rate that is read by 1 - 2 ``parameters[0]``."""
    row[READING + 2] *= 1.0 - 2.0 * parameters[0]


@dataclass(frozen=True)
class GyroSign(Effect):
    """Reversed yaw rate.

    Attributes:
        flip: 1 for reversed; values between serve sensitivities only (a scale of 1 - 2 flip).
    """

    name = "gyro_sign"
    title = "Reversed gyro"
    group = "sensors"
    equation = "(1 - 2 flip) * yaw_rate reading"
    source = "REP 103 (counter-clockwise positive), violated"
    signature = "yaw rate opposite to what encoders and pose say, equal in size"
    confused_with = ("gyro_scale",)
    categorical = True
    actions = ((POINT_READINGS, flip_gyro),)

    flip: float = size("-", 0.0, 1.0, least=1.0, default=1.0, step=0.05)
