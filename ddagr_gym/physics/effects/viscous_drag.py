"""A drag that grows with speed: standing water, mud, dense crop."""

from dataclasses import dataclass

from ddagr_gym.physics.effects.base import Effect, Vector, size
from ddagr_gym.physics.layout import BODY_FORCE, POINT_BODY_FORCES, V_X, V_Y


def drag_body(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Force against the velocity of the body origin, proportional to it."""
    row[BODY_FORCE] -= parameters[0] * row[V_X]
    row[BODY_FORCE + 1] -= parameters[0] * row[V_Y]


@dataclass(frozen=True)
class ViscousDrag(Effect):
    """Force against the velocity of the body origin, proportional to it.

    Attributes:
        coefficient: force per speed; least: 10 N at the 0.2 m/s of a row turn.
    """

    name = "viscous_drag"
    title = "Viscous drag"
    group = "robot"
    equation = "F = -coefficient (v_x, v_y) at the body origin"
    source = "linear damping (Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control)"
    signature = "slower the faster it drives; nothing near rest"
    confused_with = ("slip_sinkage", "slope", "soil_change", "towed_drag")
    actions = ((POINT_BODY_FORCES, drag_body),)

    coefficient: float = size("N s/m", 0.0, 5000.0, least=50.0, step=25.0)
