"""``ddagr soils``: what the built-in soils are."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tyro.conf import Positional

from ddagr_gym.commands.output import format_fields, format_table

if TYPE_CHECKING:
    from ddagr_gym.parameters import Soil

EXAMPLES = (
    "ddagr soils",
    "ddagr soils thesis_a1",
)

_DEPTH = 0.01
"""At which the list says how firm a soil is [m]."""


@dataclass(frozen=True)
class Arguments:
    """List the soils, or show the parameters of one.

    The list shows how strong each is (cohesion, friction angle), how firm (pressure that presses a plate, as wide as
    the DDAGR's wheels, 10 mm deep), over which shear its strength comes up, and whose measurement it is.

    Attributes:
        name: soil to show; all of them are listed when it is left out.
    """

    name: Positional[str] = ""


def run(arguments: Arguments) -> None:
    """Print the soil, or one line per soil."""
    from ddagr_gym.presets import get_robot, get_soil, soil_names, soil_source

    if arguments.name:
        print(f"{format_fields(get_soil(arguments.name))}\nsource: {soil_source(arguments.name)}")
        return
    width = 2.0 * get_robot("ddagr").wheels[0].half_width
    header = ("soil", "cohesion [kPa]", "friction [deg]", "10 mm deep at [kPa]", "shear modulus [mm]", "from")
    rows = [(name, *_row(get_soil(name), width), soil_source(name)) for name in soil_names()]
    print(format_table(header, rows))


def _row(soil: Soil, width: float) -> tuple[str, ...]:
    """What a soil withstands, beside a plate of that width [m]."""
    pressure = soil.pressure(_DEPTH, width)
    angle = math.degrees(soil.friction_angle)
    return f"{1e-3 * soil.cohesion:.3g}", f"{angle:.1f}", f"{1e-3 * pressure:.3g}", f"{1e3 * soil.shear_modulus:.3g}"
