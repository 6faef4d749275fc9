"""Lateral wheel forces times a factor: what bulldozing, grousers or side walls do to the force law, for plants alone.

No part of the library of effects: the diagnosis is not asked for it.
"""

from __future__ import annotations

from dataclasses import dataclass

from ddagr_gym.physics.effects.base import Effect, Vector, size
from ddagr_gym.physics.layout import EXTRA_FORCE_Y, FORCE_Y, POINT_WHEEL_FORCES


def scale_lateral(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Add ``parameters[0] - 1`` of each wheel's lateral force, its moments about the hub left as they are.

    Where the body's derivatives are taken, the row holds forces with the effect in them. The memory (sum and contact
    force of each wheel) tells these calls apart.
    """
    for i in range(4):
        found = row[FORCE_Y + i]
        if abs(found - memory[i]) > 1e-12 * abs(found):
            memory[4 + i] = found
            memory[i] = found + (parameters[0] - 1.0) * found
        row[EXTRA_FORCE_Y + i] += (parameters[0] - 1.0) * memory[4 + i]


@dataclass(frozen=True)
class LateralScale(Effect):
    """A factor on the lateral forces of all wheels.

    Attributes:
        factor: on F_y.
    """

    name = "lateral_scale"
    title = "Scaled lateral forces"
    group = "ground"
    equation = "F_y -> factor F_y"
    source = "ours: the size of what bulldozing does"
    signature = "turns wider or tighter for the same commands"
    actions = ((POINT_WHEEL_FORCES, scale_lateral),)

    factor: float = size("-", 0.3, 3.0, least=0.05, neutral=1.0)
