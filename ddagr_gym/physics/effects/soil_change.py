"""Soil that is not the nominal one, everywhere or from a moment on: rain, another field, a wrong map."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from ddagr_gym.physics.effects.base import DriveExtent, Effect, Vector, shape, size
from ddagr_gym.physics.effects.soil_factors import HIGHEST_FACTOR, LOWEST_FACTOR, scale_soil
from ddagr_gym.physics.layout import POINT_SOIL, TIME

_TRANSITION = 0.5  # [s], ours: the onset, made differentiable
_ALWAYS = -1e6  # [s], an onset before any drive
_ONSETS = (0.25, 0.5, 0.75)  # shares of a drive's length from which it is tried, ours


def change_soil(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Scale the soil under all wheels from the time ``parameters[2]`` on."""
    share = 0.5 * (1.0 + math.tanh((row[TIME] - parameters[2]) / _TRANSITION))
    strength = 1.0 + share * (parameters[0] - 1.0)
    stiffness = 1.0 + share * (parameters[1] - 1.0)
    for i in range(4):
        scale_soil(row, i, strength, stiffness)


@dataclass(frozen=True)
class SoilChange(Effect):
    """Factors on shear strength and on stiffness under all wheels.

    A change that holds over whole drives is one of nominal parameters; only prior knowledge of the soil, or an onset
    within a drive, sets it apart from a refit.

    Attributes:
        strength: factor on cohesion and tan(phi); least: 10 percent, about what shear vane readings repeat to.
        stiffness: factor on k_c and k_phi; least: 20 percent, about what plate tests repeat to.
        onset: time from which it holds; by default always.
    """

    name = "soil_change"
    title = "Changed soil"
    group = "ground"
    equation = "c, tan(phi) -> strength c, strength tan(phi); k_c, k_phi -> stiffness k_c, stiffness k_phi"
    source = "Bekker-Mohr-Coulomb parameters (Wong, Theory of Ground Vehicles, chapter 2)"
    signature = "other slip, turn rate and resistance for the same commands, in every direction alike"
    confused_with = (
        "encoder_scale",
        "lateral_bulldozing",
        "multipass",
        "payload",
        "slip_sinkage",
        "slope",
        "soil_patch",
        "towed_drag",
        "viscous_drag",
    )
    actions = ((POINT_SOIL, change_soil),)

    strength: float = size("-", LOWEST_FACTOR, HIGHEST_FACTOR, least=0.1, neutral=1.0, step=0.1)
    stiffness: float = size("-", LOWEST_FACTOR, HIGHEST_FACTOR, least=0.2, default=1.0, neutral=1.0, step=0.2)
    onset: float = shape("s", _ALWAYS, 1e6, default=_ALWAYS, step=0.25)

    @classmethod
    def probes(cls, extent: DriveExtent) -> tuple[Effect, ...]:
        """A change of strength and one of stiffness, over the whole drive and from each quarter of it on."""
        strength = 1.0 + cls.parameter("strength").metadata["step"]
        stiffness = 1.0 + cls.parameter("stiffness").metadata["step"]
        onsets = (_ALWAYS, *(share * extent.duration for share in _ONSETS))
        return tuple(effect for t in onsets for effect in (cls(strength, 1.0, t), cls(1.0, stiffness, t)))

    @property
    def soils(self) -> Mapping[str, tuple[float, float]]:
        """After the onset and before; of one that holds always no other."""
        changed = (self.strength, self.stiffness)
        if self.onset <= _ALWAYS:
            return {"on these drives": changed}
        return {"after the change": changed, "before it": (1.0, 1.0)}
