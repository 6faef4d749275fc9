"""An accelerometer axis mounted or logged with the other sign."""

from dataclasses import dataclass
from typing import Any

from ddagr_gym.physics.effects.base import DriveExtent, Effect, Vector, size
from ddagr_gym.physics.layout import POINT_READINGS, READING


def flip_accelerometer(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Multiply the specific force that is read by 1 - 2 ``parameters[:2]``."""
    row[READING] *= 1.0 - 2.0 * parameters[0]
    row[READING + 1] *= 1.0 - 2.0 * parameters[1]


@dataclass(frozen=True)
class AccelerometerSign(Effect):
    """Reversed axes of the specific force.

    Attributes:
        flip_x: 1 for reversed; values between serve sensitivities only (a scale of 1 - 2 flip).
        flip_y: the same across.
    """

    name = "accelerometer_sign"
    title = "Reversed accelerometer axis"
    group = "sensors"
    equation = "((1 - 2 flip_x) x, (1 - 2 flip_y) y) of the specific force reading"
    source = "REP 103 and REP 145 (axes of an IMU), violated"
    signature = "specific force opposite to starts, stops (x) or to the centripetal force of turns (y)"
    confused_with = ("imu_misalignment",)
    categorical = True
    actions = ((POINT_READINGS, flip_accelerometer),)

    flip_x: float = size("-", 0.0, 1.0, least=1.0, default=1.0, step=0.05)
    flip_y: float = size("-", 0.0, 1.0, least=1.0, default=0.0, step=0.05)

    @classmethod
    def probes(cls, extent: DriveExtent) -> tuple[Any, ...]:
        """Each axis alone, and both: a sensor that is turned by half a turn or states the reaction."""
        step = cls.parameter("flip_x").metadata["step"]
        return (*super().probes(extent), cls(step, step))
