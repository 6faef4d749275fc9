"""Ground that slopes: gravity fixed in the world, which turns with the heading where a bias does not."""

import math
from dataclasses import dataclass

from ddagr_gym.physics.effects.base import Effect, size
from ddagr_gym.physics.layout import POINT_LOADS, SLOPE


def tilt_ground(row, parameters, memory):  # type: ignore[no-untyped-def]
    gradient = math.tan(parameters[0])
    row[SLOPE] += gradient * math.cos(parameters[1])
    row[SLOPE + 1] += gradient * math.sin(parameters[1])


@dataclass(frozen=True)
class Slope(Effect):
    """Plane inclined by ``angle``, rising towards the world direction ``direction`` (physics.md section 6)."""

    name = "slope"
    title = "Sloping ground"
    equation = "g_body = g (-sin a cos(yaw - d), sin a sin(yaw - d), -cos a); wheel loads follow"
    source = "thesis (6.3)"
    signature = "specific force and speed change with heading; level straight drives drift downhill"
    confused_with = ("accelerometer_bias", "imu_tilt", "towed_drag")
    actions = ((POINT_LOADS, tilt_ground),)

    angle: float = size("rad", -0.6, 0.6, least=0.0087)
    direction: float = size("rad", -7.0, 7.0, least=0.0, default=0.0)
