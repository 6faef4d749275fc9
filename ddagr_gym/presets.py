"""Named robots and soils, each set with its source, and those of YAML files, returned fresh.

Robots are in ``configs/robots``, published soils in ``configs/soils/published.csv``.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache

from ddagr_gym.config import configs_dir, load_config
from ddagr_gym.errors import unknown_name
from ddagr_gym.files import expanded
from ddagr_gym.parameters import Robot, Soil

PROTOTYPE_PEAK_COEFFICIENTS, PROTOTYPE_EXIT_ANGLE_RATIO = (0.4, 0.15), 0.3
"""Published soils state no stress-peak or exit-angle coefficients; these fit measured wheels (a fit, not a source)."""


def ddagr() -> Robot:
    """The thesis's robot."""
    return get_robot("ddagr")


def warthog() -> Robot:
    """Clearpath Warthog as NorLab drove it."""
    return get_robot("warthog")


def husky() -> Robot:
    """Clearpath Husky A200 with sensors."""
    return get_robot("husky")


def thesis_a1() -> Soil:
    """Thesis Table A.1: Wong's clayey soil (Thailand) at 38 % moisture, not sandy loam as the thesis says."""
    return Soil(
        cohesion=4140.0,
        friction_angle=math.radians(13.0),
        sinkage_exponent=0.5,
        cohesive_modulus=13190.0,
        frictional_modulus=692000.0,
        shear_modulus=0.006,
        peak_stress_coefficient_0=0.5,
        peak_stress_coefficient_1=0.5,
        exit_angle_ratio=0.9,
    )


def firm_ground() -> Soil:
    """Hard ground (asphalt, packed gravel) as a stiff frictional soil, so that one model serves all recordings.

    Not a published soil: the stiffness makes the contact patch of a loaded tyre (about 0.1 m long under 1 kN),
    friction is that of rubber on dry asphalt, and little of the patch lies behind the axle.
    """
    return Soil(
        cohesion=0.0,
        friction_angle=math.atan(0.8),
        sinkage_exponent=1.0,
        cohesive_modulus=0.0,
        frictional_modulus=5.0e7,
        shear_modulus=0.004,
        peak_stress_coefficient_0=0.1,
        peak_stress_coefficient_1=0.1,
        exit_angle_ratio=0.8,
    )


def _published(name: str) -> Soil:
    """A soil of the table of published ones."""
    n, k_c, k_phi, cohesion, friction, shear = (float(text) for text in _published_rows()[name][2:])
    peak_0, peak_1 = PROTOTYPE_PEAK_COEFFICIENTS
    return Soil(
        cohesion=1e3 * cohesion,
        friction_angle=math.radians(friction),
        sinkage_exponent=n,
        cohesive_modulus=1e3 * k_c,
        frictional_modulus=1e3 * k_phi,
        shear_modulus=shear,
        peak_stress_coefficient_0=peak_0,
        peak_stress_coefficient_1=peak_1,
        exit_angle_ratio=PROTOTYPE_EXIT_ANGLE_RATIO,
    )


@cache
def _published_rows() -> dict[str, list[str]]:
    """Rows of ``configs/soils/published.csv`` by name."""
    with (configs_dir() / "soils" / "published.csv").open(newline="", encoding="utf-8") as file:
        _, *rows = csv.reader(line for line in file if not line.startswith("#"))
    return {row[0]: row for row in rows}


@cache
def _robot(name: str) -> Robot:
    return load_config(configs_dir() / "robots" / f"{name}.yaml", Robot)


_ROBOTS = ("ddagr", "warthog", "husky")
_SOILS: dict[str, tuple[Callable[[], Soil], str]] = {
    "thesis_a1": (thesis_a1, "thesis Table A.1 (clayey soil, Thailand, 38 % moisture)"),
    "firm_ground": (firm_ground, "hard ground as a stiff frictional soil (ours)"),
}


def robot_names() -> tuple[str, ...]:
    """Names that :func:`get_robot` takes."""
    return _ROBOTS


def soil_names() -> tuple[str, ...]:
    """Names that :func:`get_soil` takes."""
    return (*_SOILS, *_published_rows())


def is_file(name: object) -> bool:
    """Whether this is the path of a YAML file rather than a name."""
    return str(name).endswith((".yaml", ".yml"))


def full_name(name: str) -> str:
    """A preset's name unchanged; for a file its absolute path, which is valid in any folder."""
    return str(expanded(name).resolve()) if is_file(name) else name


def robot_option(name: str) -> str:
    """``--robot`` for a robot of that name: its file where it is no preset, whose name alone is refused."""
    return f"--robot {name}" if name in _ROBOTS else "--robot FILE.yaml (the file that describes it)"


def soil_source(name: str) -> str:
    """Where the soil ``name`` comes from."""
    get_soil(name)
    if is_file(name):
        return name
    return _SOILS[name][1] if name in _SOILS else _published_rows()[name][1]


def get_robot(name: str) -> Robot:
    """Robot by name, or from a YAML file with the fields of :class:`~ddagr_gym.parameters.Robot`.

    Raises:
        InputError: unknown name, with the closest ones; a file that is missing or not valid.
    """
    if is_file(name):
        return load_config(name, Robot)
    if name not in _ROBOTS:
        raise unknown_name("robot", name, _ROBOTS, "`ddagr robots` lists all")
    stored = _robot(name)
    return replace(stored, standard_deviations=dict(stored.standard_deviations))


def get_soil(name: str) -> Soil:
    """Soil by name, or from a YAML file with the fields of :class:`~ddagr_gym.parameters.Soil`.

    Raises:
        InputError: unknown name, with the closest ones; a file that is missing or not valid.
    """
    if is_file(name):
        return load_config(name, Soil)
    if name not in soil_names():
        raise unknown_name("soil", name, soil_names(), "`ddagr soils` lists all")
    return _SOILS[name][0]() if name in _SOILS else _published(name)
