"""``ddagr robots``: what the built-in robots are."""

from __future__ import annotations

from dataclasses import dataclass

from tyro.conf import Positional

from ddagr_gym.commands.output import format_fields, format_table

EXAMPLES = (
    "ddagr robots",
    "ddagr robots husky",
)


@dataclass(frozen=True)
class Arguments:
    """List the robots, or show the parameters of one.

    Attributes:
        name: robot to show; all of them are listed when it is left out.
    """

    name: Positional[str] = ""


def run(arguments: Arguments) -> None:
    """Print the robot, or one line per robot."""
    from ddagr_gym.presets import get_robot, robot_names

    if arguments.name:
        print(format_fields(get_robot(arguments.name)))
        return
    robots = [(name, get_robot(name)) for name in robot_names()]
    header = ("robot", "mass [kg]", "yaw inertia [kg m^2]", "wheelbase [m]", "track [m]", "wheel radius [m]")
    rows = [
        (name, r.mass, r.yaw_inertia, 2 * r.half_wheelbase, 2 * r.half_track, r.wheels[0].outer_radius)
        for name, r in robots
    ]
    print(format_table(header, rows))
