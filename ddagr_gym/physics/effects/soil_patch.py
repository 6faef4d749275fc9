"""A place where the soil is different: a wet hollow, a headland, a dung heap."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from ddagr_gym.physics.effects.base import DriveExtent, Effect, Vector, shape, size
from ddagr_gym.physics.effects.soil_factors import HIGHEST_FACTOR, LOWEST_FACTOR, scale_soil
from ddagr_gym.physics.layout import POINT_SOIL, WHEEL_X, WHEEL_Y

_FAR = 20.0  # rim widths: less than 1e-17 of the factor is left
_CELLS = 4  # probes per longer side of the area driven on
_SMALLEST_CELL = 1.0  # [m], about the size of a robot


def place_patch(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Scale the soil of the wheels in the patch; its rim is a smooth step."""
    for i in range(4):
        x = row[WHEEL_X + i] - parameters[2]
        y = row[WHEEL_Y + i] - parameters[3]
        outside = (math.sqrt(x * x + y * y) - parameters[4]) / parameters[5]
        if outside < _FAR:
            share = 1.0 / (1.0 + math.exp(2.0 * outside))
            scale_soil(row, i, 1.0 + share * (parameters[0] - 1.0), 1.0 + share * (parameters[1] - 1.0))


@dataclass(frozen=True)
class SoilPatch(Effect):
    """Round patch of the world with other strength and stiffness.

    Attributes:
        strength: factor inside; least: 20 percent, the spread between neighbouring shear vane readings.
        stiffness: factor inside; least: 30 percent, the spread between neighbouring cone index readings.
        centre_x: world.
        centre_y: world.
        radius: where the factors have half their effect.
        edge: width of the rim.
    """

    name = "soil_patch"
    needs_one_frame = True
    title = "Soil patch"
    group = "ground"
    equation = (
        "1 + (factor - 1)/(1 + exp(2 (|p_wheel - centre| - radius)/edge)) on strength and stiffness of each wheel"
    )
    source = "Bekker-Mohr-Coulomb parameters by place; the rim's form is ours"
    signature = "mismatch that starts and ends with the place, wheel by wheel, and returns with it"
    confused_with = ("soil_change", "soil_split")
    actions = ((POINT_SOIL, place_patch),)

    strength: float = size("-", LOWEST_FACTOR, HIGHEST_FACTOR, least=0.2, neutral=1.0, step=0.04)
    stiffness: float = size("-", LOWEST_FACTOR, HIGHEST_FACTOR, least=0.3, default=1.0, neutral=1.0, step=0.06)
    centre_x: float = shape("m", -1e6, 1e6, default=0.0, step=0.1)
    centre_y: float = shape("m", -1e6, 1e6, default=0.0, step=0.1)
    radius: float = shape("m", 0.1, 1e3, default=1.5, step=0.1)
    edge: float = shape("m", 0.02, 10.0, default=0.3, step=0.05)

    @classmethod
    def probes(cls, extent: DriveExtent) -> tuple[Effect, ...]:
        """Patches that tile the area driven on, each in strength and in stiffness."""
        strength = 1.0 + cls.parameter("strength").metadata["step"]
        stiffness = 1.0 + cls.parameter("stiffness").metadata["step"]
        spans = (extent.x[1] - extent.x[0], extent.y[1] - extent.y[0])
        width = max(max(spans) / _CELLS, _SMALLEST_CELL)
        radius = min(0.6 * width, cls.parameter("radius").metadata["high"])
        edge = min(0.2 * width, cls.parameter("edge").metadata["high"])
        columns, lines = (max(math.ceil(span / width - 1e-9), 1) for span in spans)
        found = []
        for i in range(columns):
            for j in range(lines):
                x = extent.x[0] + (i + 0.5) / columns * spans[0]
                y = extent.y[0] + (j + 0.5) / lines * spans[1]
                for inside in ((strength, 1.0), (1.0, stiffness)):
                    found.append(cls(inside[0], inside[1], x, y, radius, edge))
        return tuple(found)

    @property
    def soils(self) -> Mapping[str, tuple[float, float]]:
        """Well inside the patch and outside."""
        return {"in the patch": (self.strength, self.stiffness), "outside it": (1.0, 1.0)}
