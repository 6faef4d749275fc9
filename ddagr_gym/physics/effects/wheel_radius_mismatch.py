"""Wheels of one bank larger than those of the other: tyre pressure, wear, a wrong tyre."""

from dataclasses import dataclass

from ddagr_gym.physics.effects.base import Effect, Vector, size
from ddagr_gym.physics.layout import POINT_LOADS, WHEEL

_MINOR = WHEEL
_MAJOR = WHEEL + 8


def resize_wheels(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Change the major radii so that the outer radii differ by ``parameters[0]`` of their mean, right minus left."""
    for i in range(4):
        half = 0.5 * parameters[0] if i % 2 == 0 else -0.5 * parameters[0]
        row[_MAJOR + i] += half * (row[_MINOR + i] + row[_MAJOR + i])


@dataclass(frozen=True)
class WheelRadiusMismatch(Effect):
    """Right wheels larger and left ones smaller by the same amount; encoders measure angle and do not see it.

    Attributes:
        difference: (right - left)/mean outer radius; least: 1 percent, which leaves a 10 m row by about 0.3 m.
    """

    name = "wheel_radius_mismatch"
    title = "Uneven wheel radii"
    group = "robot"
    equation = "R_right = R (1 + difference/2), R_left = R (1 - difference/2)"
    source = "unequal wheel diameters (Borenstein and Feng, IEEE Trans. Robotics and Automation 12 (1996) 869)"
    signature = "a straight command turns, with the same curvature at every speed, while the encoders agree"
    confused_with = ("centre_of_mass_offset", "encoder_scale", "gyro_bias", "soil_split")
    actions = ((POINT_LOADS, resize_wheels),)

    difference: float = size("-", -0.3, 0.3, least=0.01)
