"""What if pressure pushed up only: the model without the horizontal part of the pressure on its tyres."""

from __future__ import annotations

from dataclasses import dataclass

from ddagr_gym.jit import stack_array
from ddagr_gym.parameters import Numerics
from ddagr_gym.physics.contact_patch import WRENCH, wheel_wrench
from ddagr_gym.physics.effects.base import Effect, Vector, size
from ddagr_gym.physics.layout import (
    EXTRA_FORCE_X,
    POINT_WHEEL_FORCES,
    SINKAGE,
    SOIL,
    SOIL_COHESION,
    SOIL_FRICTION_TANGENT,
    WHEEL,
)
from ddagr_gym.physics.numerics import patch_numerics
from ddagr_gym.physics.wheel_derivatives import motion_of

_NUMERICS = patch_numerics(Numerics())


def cancel_compaction(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Take away the share ``parameters[0]`` of what the tyre would feel along the wheel in soil without strength."""
    wrench = stack_array(WRENCH)
    wheel = stack_array(3)
    soil = stack_array(9)
    for i in range(4):
        if row[SINKAGE + i] <= 0.0:
            continue
        for j in range(3):
            wheel[j] = row[WHEEL + 4 * j + i]
        for j in range(9):
            soil[j] = row[SOIL + 9 * i + j]
        soil[SOIL_COHESION] = 0.0
        soil[SOIL_FRICTION_TANGENT] = 0.0
        wheel_wrench(wheel, soil, motion_of(row, i), row[SINKAGE + i], _NUMERICS, wrench)
        row[EXTRA_FORCE_X + i] -= parameters[0] * wrench[0]


@dataclass(frozen=True)
class NoCompactionResistance(Effect):
    """For comparing models only: an artificial effect that is not in the library.

    Attributes:
        share: of the compaction resistance that is taken away.
    """

    name = "no_compaction_resistance"
    title = "No compaction resistance"
    group = "ground"
    equation = "F_x -> F_x + share * integral of sigma n_x dS"
    source = "ours"
    signature = "less slip for the same speed"
    actions = ((POINT_WHEEL_FORCES, cancel_compaction),)

    share: float = size("-", 0.0, 1.0, least=0.1, default=1.0)
