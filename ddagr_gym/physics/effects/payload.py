"""A load that the nominal robot does not carry."""

from dataclasses import dataclass

from ddagr_gym.physics.effects.base import Effect, Vector, shape, size
from ddagr_gym.physics.layout import CENTRE_OF_MASS, MASS, POINT_LOADS, YAW_INERTIA

_LIGHTEST = 0.1  # of the nominal mass: a negative payload cannot take more away


def add_load(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Combine the body with a point mass: mass, centre of mass, yaw inertia about the new centre."""
    body = row[MASS]
    load = max(parameters[0], (_LIGHTEST - 1.0) * body)
    total = body + load
    x = parameters[1] - row[CENTRE_OF_MASS]
    y = parameters[2] - row[CENTRE_OF_MASS + 1]
    row[YAW_INERTIA] += body * load / total * (x * x + y * y)
    row[MASS] = total
    for axis in range(3):
        row[CENTRE_OF_MASS + axis] += load / total * (parameters[1 + axis] - row[CENTRE_OF_MASS + axis])


@dataclass(frozen=True)
class Payload(Effect):
    """Point mass on the robot; negative: something was taken off.

    Attributes:
        mass: least: 8 kg, a battery, and 5 percent of a 168 kg robot.
        x: forward of the body origin.
        y: to the left of it.
        height: above ground.
    """

    name = "payload"
    title = "Payload"
    group = "robot"
    equation = "m + mass; centre of mass and I by the parallel-axis theorem; wheel loads follow"
    source = "rigid-body mechanics (Huygens-Steiner)"
    signature = "deeper ruts and more resistance at equal accelerations per force; slower yaw"
    confused_with = ("centre_of_mass_offset", "soil_change")
    actions = ((POINT_LOADS, add_load),)

    mass: float = size("kg", -30.0, 500.0, least=8.0, step=8.0)
    x: float = shape("m", -1.0, 1.0, default=0.0, step=0.05)
    y: float = shape("m", -1.0, 1.0, default=0.0, step=0.05)
    height: float = shape("m", 0.0, 3.0, default=0.6, step=0.1)
