"""Soil that differs between left and right: one bank on a tramline, the other on the crop row."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from ddagr_gym.physics.effects.base import Effect, Vector, size
from ddagr_gym.physics.effects.soil_factors import HIGHEST_FACTOR, LOWEST_FACTOR, scale_soil
from ddagr_gym.physics.layout import POINT_SOIL


def split_soil(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Scale left by the root of each ratio and right by its inverse, so that the geometric mean stays."""
    strength = math.sqrt(parameters[0])
    stiffness = math.sqrt(parameters[1])
    for i in range(4):
        if i % 2:
            scale_soil(row, i, strength, stiffness)
        else:
            scale_soil(row, i, 1.0 / strength, 1.0 / stiffness)


@dataclass(frozen=True)
class SoilSplit(Effect):
    """Ratios of strength and stiffness, left bank over right bank; their geometric means are nominal.

    Attributes:
        strength: left over right; least: 20 percent, the spread between neighbouring shear vane readings.
        stiffness: left over right; least: 30 percent, the spread between neighbouring cone index readings.
    """

    name = "soil_split"
    title = "Split soil"
    group = "ground"
    equation = "soil_left = soil sqrt(ratio), soil_right = soil/sqrt(ratio), for strength and for stiffness"
    source = "split-friction surfaces (ISO 14512), with Bekker-Mohr-Coulomb parameters"
    signature = "pulls to the weaker side, more under load and slip; turns to either side differ"
    confused_with = ("centre_of_mass_offset", "soil_patch", "wheel_radius_mismatch")
    actions = ((POINT_SOIL, split_soil),)

    strength: float = size("-", LOWEST_FACTOR, HIGHEST_FACTOR, least=0.2, neutral=1.0, step=0.04)
    stiffness: float = size("-", LOWEST_FACTOR, HIGHEST_FACTOR, least=0.3, default=1.0, neutral=1.0, step=0.06)

    @property
    def soils(self) -> Mapping[str, tuple[float, float]]:
        """Of the left and the right bank."""
        left = (math.sqrt(self.strength), math.sqrt(self.stiffness))
        return {"under the left wheels": left, "under the right wheels": (1.0 / left[0], 1.0 / left[1])}
