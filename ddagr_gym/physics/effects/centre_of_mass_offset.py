"""A centre of mass that is not where the nominal robot has it."""

from dataclasses import dataclass

from ddagr_gym.physics.effects.base import Effect, Vector, size
from ddagr_gym.physics.layout import CENTRE_OF_MASS, POINT_LOADS


def move_centre(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Shift the centre of mass in the body's plane."""
    row[CENTRE_OF_MASS] += parameters[0]
    row[CENTRE_OF_MASS + 1] += parameters[1]


@dataclass(frozen=True)
class CentreOfMassOffset(Effect):
    """Shift of the centre of mass; wheel loads, inertia forces and the accelerometer's transport terms follow.

    Attributes:
        x: forward; least: 3 cm, which shifts 9 percent of the DDAGR's wheel loads fore and aft.
        y: to the left; least: the same length.
    """

    name = "centre_of_mass_offset"
    title = "Offset centre of mass"
    group = "robot"
    equation = "N_i = N/4 (1 +- x_c/L)(1 +- y_c/W)"
    source = "statics of four wheels (theory: wheel model, eq. (24))"
    signature = (
        "y: pulls to the heavier side, little while speed loops hold; turns to either side differ; x: turns about it"
    )
    confused_with = ("imu_lever_arm", "multipass", "payload", "slope", "soil_split", "wheel_radius_mismatch")
    actions = ((POINT_LOADS, move_centre),)

    x: float = size("m", -0.25, 0.25, least=0.03)
    y: float = size("m", -0.25, 0.25, least=0.03, default=0.0)
