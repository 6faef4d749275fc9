"""``ddagr soils``: what the built-in soils are."""

from __future__ import annotations

from dataclasses import dataclass

from tyro.conf import Positional

from ddagr_gym.commands.output import format_fields, format_table

EXAMPLES = (
    "ddagr soils",
    "ddagr soils thesis_a1",
)


@dataclass(frozen=True)
class Arguments:
    """List the soils, or show the parameters of one.

    Attributes:
        name: soil to show; all of them are listed when it is left out.
    """

    name: Positional[str] = ""


def run(arguments: Arguments) -> None:
    """Print the soil, or one line per soil."""
    from ddagr_gym.presets import get_soil, soil_names, soil_source

    if arguments.name:
        print(f"{format_fields(get_soil(arguments.name))}\nsource: {soil_source(arguments.name)}")
        return
    soils = [(name, get_soil(name)) for name in soil_names()]
    header = ("soil", "cohesion [Pa]", "friction angle [rad]", "exponent [-]", "shear modulus [m]")
    rows = [(name, s.cohesion, s.friction_angle, s.sinkage_exponent, s.shear_modulus) for name, s in soils]
    print(format_table(header, rows))
