"""A robot as rigid bodies: four wheels that carry its weight on the ground, and what they carry."""

from __future__ import annotations

from dataclasses import dataclass

from ddagr_gym.errors import InputError
from ddagr_gym.exporting.carried_over import CarriedOver

WHEELS = (("front_right", 1, -1), ("front_left", 1, 1), ("rear_right", -1, -1), ("rear_left", -1, 1))
"""Name, and signs of the position forward and to the left, in the package's order."""

WHEEL_MASS = 0.01
"""Of the robot, each; what a wheel spins with is the bank's inertia (ours)."""

HORIZONTAL_INERTIA = 0.6
"""Of a body about its other axes, over that about the main one; ours, neither matters on level ground."""


@dataclass(frozen=True)
class Chassis:
    """The robot without its wheels.

    Attributes:
        mass: [kg].
        inertia: about x, y, z through its centre of mass [kg m^2].
        centre: of mass, from the middle of the hubs [m].
    """

    mass: float
    inertia: tuple[float, float, float]
    centre: tuple[float, float, float]


def chassis(found: CarriedOver) -> Chassis:
    """What is left when four wheels that hang at the hubs' height are taken off."""
    wheel = WHEEL_MASS * found.mass
    mass = found.mass - 4.0 * wheel
    yaw = found.yaw_inertia - wheel * (found.wheelbase**2 + found.track**2)
    share = found.mass / mass
    height = found.centre_of_mass_height - found.rolling_radius
    centre = (share * found.centre_of_mass_x, share * found.centre_of_mass_y, share * height)
    return Chassis(mass, (HORIZONTAL_INERTIA * yaw, HORIZONTAL_INERTIA * yaw, yaw), centre)


def check_friction(name: str, found: CarriedOver) -> None:
    """Refuse a robot for which no friction was found; InputError."""
    if not found.slides_alike:
        raise InputError(
            f"no friction makes rigid wheels turn as {name} does at this working point (effective track "
            f"{found.effective_track:.2f} m, track {found.track:.2f} m): choose another --speed, or --to randomisation."
        )
