"""Ground that slopes: gravity fixed in the world, which turns with the heading where a bias does not."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ddagr_gym.physics.effects.base import DriveExtent, Effect, Vector, shape, size
from ddagr_gym.physics.layout import POINT_LOADS, SLOPE


def tilt_ground(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Add the gradient of an incline of angle ``parameters[0]`` rising towards ``parameters[1]``."""
    gradient = math.tan(parameters[0])
    row[SLOPE] += gradient * math.cos(parameters[1])
    row[SLOPE + 1] += gradient * math.sin(parameters[1])


@dataclass(frozen=True)
class Slope(Effect):
    """Inclined plane, rising towards a direction of the world (theory: wheel model, eq. (23)).

    Attributes:
        angle: of inclination; least: half a degree, about what a machine guidance system resolves.
        direction: of steepest ascent, from the world's x axis counter-clockwise.
    """

    name = "slope"
    needs_one_frame = True
    title = "Sloping ground"
    group = "ground"
    equation = "g_body = g (-sin a cos(yaw - d), sin a sin(yaw - d), -cos a); wheel loads follow"
    source = "thesis (6.3)"
    signature = "specific force and speed change with heading; level straight drives drift downhill"
    confused_with = (
        "accelerometer_bias",
        "centre_of_mass_offset",
        "imu_tilt",
        "soil_change",
        "towed_drag",
        "viscous_drag",
    )
    actions = ((POINT_LOADS, tilt_ground),)

    angle: float = size("rad", -0.6, 0.6, least=0.0087)
    direction: float = shape("rad", -7.0, 7.0, default=0.0, step=0.05)

    @classmethod
    def of_gradient(cls, x: float, y: float) -> Slope:
        """The incline that rises by so much per metre along the world's axes.

        Args:
            x: along the world's x axis [-].
            y: along its y axis [-].
        """
        return cls(math.atan(math.hypot(x, y)), math.atan2(y, x))

    @property
    def gradient(self) -> tuple[float, float]:
        """Rise per metre along the world's axes [-]."""
        steepness = math.tan(self.angle)
        return steepness * math.cos(self.direction), steepness * math.sin(self.direction)

    @classmethod
    def probes(cls, extent: DriveExtent) -> tuple[Effect, ...]:
        """A step up along the world's x axis and one along its y axis."""
        step = cls.parameter("angle").metadata["step"]
        return (cls(step, 0.0), cls(step, math.pi / 2))
