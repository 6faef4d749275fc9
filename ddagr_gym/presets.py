"""Named robots and soils, each set with its source, and those of YAML files, returned fresh."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

from ddagr_gym.config import load_config
from ddagr_gym.errors import unknown_name
from ddagr_gym.parameters import Robot, Soil, TorusWheel
from ddagr_gym.published_soils import PUBLISHED_SOILS

PROTOTYPE_PEAK_COEFFICIENTS = (0.4, 0.15)
PROTOTYPE_EXIT_ANGLE_RATIO = 0.3
"""Published soils state no stress-peak or exit-angle coefficients; these fit measured wheels (a fit, not a source)."""


def ddagr() -> Robot:
    """The thesis's robot: Table 6.1 and, for the tyre, Table A.1 (whose a and c labels are swapped)."""
    return Robot(
        name="ddagr",
        mass=168.0,
        yaw_inertia=100.0,
        half_wheelbase=0.33,
        half_track=0.58,
        wheels=(TorusWheel(minor_radius=0.05, half_width=0.1016, major_radius=0.2294),),
        centre_of_mass=(0.0, 0.0, 0.45),
        motor_rate=4.5,
        maximum_wheel_speed=2.0,
        standard_deviations={"mass": 5.0, "yaw_inertia": 15.0, "motor_rate": 0.3},
        source="thesis Tables 6.1, A.1; height of the centre of mass and standard deviations are estimates",
    )


def warthog() -> Robot:
    """Clearpath Warthog as NorLab drove it.

    Wheel radius, track (that of its speed controller) and mass are stated with the recordings. The controller's track
    is not quite the wheels': the manual's width of 1.38 m less the tyre gives 1.13 m, the maker's robot description
    1.165 m; the deviation of the half track covers them. The maximum speed is the manual's 18 km/h without load.
    """
    return Robot(
        name="warthog",
        mass=470.0,
        yaw_inertia=150.0,
        half_wheelbase=0.457,
        half_track=0.54,
        wheels=(TorusWheel(minor_radius=0.12, half_width=0.125, major_radius=0.18),),
        centre_of_mass=(0.0, 0.0, 0.45),
        motor_rate=6.0,
        maximum_wheel_speed=16.7,
        standard_deviations={
            "mass": 40.0,
            "yaw_inertia": 40.0,
            "half_wheelbase": 0.01,
            "half_track": 0.03,
            "motor_rate": 4.0,
            "maximum_wheel_speed": 2.0,
            "half_width": 0.015,
            "outer_radius": 0.01,
        },
        source=(
            "Clearpath user manual (1.52 x 1.38 m, 280 kg bare, 272 kg payload, 18 km/h, 24 inch tyres) and "
            "warthog_description (axles at 0.457 m, wheels 0.25 m wide); inertia: its bodies, with the further 210 kg "
            "as a box of the chassis's sides; motor rate, height of the centre of mass and deviations are estimates"
        ),
    )


def husky() -> Robot:
    """Clearpath Husky A200 with sensors.

    Wheel radius, track and mass are stated with the recordings; the maker's robot description has 0.1651 m and
    0.5708 m, which the deviations cover. The maximum speed is the manual's 1.0 m/s.
    """
    return Robot(
        name="husky",
        mass=75.0,
        yaw_inertia=5.0,
        half_wheelbase=0.256,
        half_track=0.26925,
        wheels=(TorusWheel(minor_radius=0.05, half_width=0.05715, major_radius=0.10875),),
        centre_of_mass=(0.0, 0.0, 0.2),
        motor_rate=8.0,
        maximum_wheel_speed=6.3,
        standard_deviations={
            "mass": 8.0,
            "yaw_inertia": 2.0,
            "half_wheelbase": 0.005,
            "half_track": 0.015,
            "motor_rate": 5.0,
            "maximum_wheel_speed": 0.6,
            "half_width": 0.005,
            "outer_radius": 0.006,
        },
        source=(
            "Clearpath user manual (0.99 x 0.67 m, 50 kg bare, 75 kg payload, 1.0 m/s) and husky_description (wheel "
            "base 0.512 m, tyres 0.1143 m wide, body 46 kg and 2.03 kg m^2, wheels 2.64 kg); inertia: their sum, with "
            "the further 18 kg 0.25 m from the centre; motor rate, centre of mass and deviations are estimates"
        ),
    )


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


def _published(n: float, k_c: float, k_phi: float, cohesion: float, friction: float, shear: float) -> Soil:
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


_ROBOTS: dict[str, Callable[[], Robot]] = {"ddagr": ddagr, "warthog": warthog, "husky": husky}
_SOILS: dict[str, tuple[Callable[[], Soil], str]] = {
    "thesis_a1": (thesis_a1, "thesis Table A.1 (clayey soil, Thailand, 38 % moisture)"),
    "firm_ground": (firm_ground, "hard ground as a stiff frictional soil (ours)"),
}
_SOILS |= {row[0]: (lambda row=row: _published(*row[2:]), row[1]) for row in PUBLISHED_SOILS}  # type: ignore[misc]


def robot_names() -> tuple[str, ...]:
    """Names that :func:`get_robot` takes."""
    return tuple(_ROBOTS)


def soil_names() -> tuple[str, ...]:
    """Names that :func:`get_soil` takes."""
    return tuple(_SOILS)


def is_file(name: object) -> bool:
    """Whether this is the path of a YAML file rather than a name."""
    return str(name).endswith((".yaml", ".yml"))


def full_name(name: str) -> str:
    """A name as it is; of a file its whole path, which means the same in any folder."""
    return str(Path(name).expanduser().resolve()) if is_file(name) else name


def soil_source(name: str) -> str:
    """Where the soil ``name`` comes from."""
    get_soil(name)
    if is_file(name):
        return name
    return _SOILS[name][1]


def get_robot(name: str) -> Robot:
    """Robot by name, or from a YAML file with the fields of :class:`~ddagr_gym.parameters.Robot`.

    Raises:
        InputError: unknown name, with the closest ones; a file that is missing or not valid.
    """
    if is_file(name):
        return load_config(name, Robot)
    if name not in _ROBOTS:
        raise unknown_name("robot", name, _ROBOTS)
    return _ROBOTS[name]()


def get_soil(name: str) -> Soil:
    """Soil by name, or from a YAML file with the fields of :class:`~ddagr_gym.parameters.Soil`.

    Raises:
        InputError: unknown name, with the closest ones; a file that is missing or not valid.
    """
    if is_file(name):
        return load_config(name, Soil)
    if name not in _SOILS:
        raise unknown_name("soil", name, _SOILS)
    return _SOILS[name][0]()
