"""Parts of a robot that a calibration may add to its data sheet, and the parameters of each."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ddagr_gym.calibration.settings import LONGEST_DELAY
from ddagr_gym.identification.parameters import ModelParameter, robot_parameters
from ddagr_gym.parameters import Robot
from ddagr_gym.physics import layout

DELAY_DEVIATION = 0.3
"""Prior of the dead time between command and wheels [s] (ours): 0.3 to 0.43 s on a Husky and a Warthog."""

GYRO_SCALE_DEVIATION = 0.03
"""Prior of the gyro's scale [-]: data sheets of low-cost gyros promise 3 %."""


@dataclass(frozen=True)
class Part:
    """One part of a robot that drives may support or not.

    Attributes:
        name: identifier.
        title: in tables.
        parameters: names of its parameters.
        helps: drive from which they can be identified, for a reader.
    """

    name: str
    title: str
    parameters: tuple[str, ...]
    helps: str


PARTS = (
    Part(
        "gyro_scale",
        "scale of the gyro",
        ("gyro_scale",),
        "a drive with poses in which the robot turns by several revolutions to both sides",
    ),
    Part(
        "inertia",
        "mass and yaw inertia",
        ("mass", "yaw_inertia"),
        "quick reversals of turning on firm ground, with wheel speeds recorded at 20 Hz or more",
    ),
    Part(
        "geometry",
        "wheels and their places",
        ("half_wheelbase", "half_track", "half_width", "outer_radius"),
        "slow straight pieces and slow arcs to both sides on firm ground, with poses",
    ),
    Part(
        "speed_limit",
        "highest wheel speed",
        ("maximum_wheel_speed",),
        "straight pieces at the highest speed that the robot takes, commanded beyond it",
    ),
    Part(
        "speed_loop",
        "speed loop",
        ("motor_rate",),
        "steps of the commands held for 3 s or more, with wheel speeds recorded at 10 Hz or more",
    ),
    Part(
        "command_delay",
        "dead time of the commands",
        ("command_delay",),
        "steps of the commands out of steady driving, with the time before each step recorded",
    ),
)
"""In the order in which their removal is tried: what the fewest robots need comes first."""

NAMES = tuple(part.name for part in PARTS)


def part_of(parameter: str) -> Part:
    """Part that a shared parameter belongs to."""
    return next(part for part in PARTS if parameter in part.parameters)


def shared_parameters(robot: Robot) -> tuple[ModelParameter, ...]:
    """Every parameter of the parts that the robot states as uncertain, and those of its timing and gyro."""
    delay = ModelParameter("command_delay", "s", (), False, DELAY_DEVIATION, 0.01, 0.0, LONGEST_DELAY, shift=True)
    scale = ModelParameter("gyro_scale", "-", (layout.GYRO_SCALE,), True, GYRO_SCALE_DEVIATION, 0.01, -0.3, 0.3)
    return (*robot_parameters(robot), delay, scale)


def without_parts(parameters: tuple[ModelParameter, ...], left_out: frozenset[str]) -> tuple[ModelParameter, ...]:
    """The same parameters, those of some parts held at the data sheet.

    Args:
        parameters: shared ones and others.
        left_out: names of parts.
    """
    held = {name for part in PARTS if part.name in left_out for name in part.parameters}
    return held_parameters(parameters, frozenset(held))


def held_parameters(parameters: tuple[ModelParameter, ...], names: frozenset[str]) -> tuple[ModelParameter, ...]:
    """The same parameters, some of them held where they are."""
    return tuple(replace(p, prior=0.0) if p.name in names else p for p in parameters)
