"""Steady skid-steer turns beside those of Project Chrono's soil contact model (SCM).

The reference drives a 60 kg box (yaw inertia 5.9 kg m^2) on four torus wheels of 5 kg over a 2 cm grid of soil until
the turn is steady. The same robot drives the same commands here. Published soil values enter both alike; the stress
peak and the exit angle, which SCM does not have, are the presets' values for published soils.

Why the two differ (each measured by a variant of :data:`VARIANTS`, not guessed):

- **No push against compaction in SCM.** It applies the pressure of a grid node along the normal of the *undeformed
  terrain*, that is straight up (``SCMTerrain.cpp``: the force is pressure along the node's terrain normal plus shear
  along the tangent). Pressure then brakes the axle, by its offset ahead of the hub, but never the robot. Here it acts
  along the tyre's surface, and the compaction resistance (theory: wheel model, section 9) has to be overcome by
  traction: the robot drives at 11 % slip where SCM's drives at 1 to 3 %. With the horizontal part of the pressure
  cancelled, and nothing else changed (variant ``no compaction resistance``), the yaw rates agree.
- **Rear wheels in ruts.** SCM's rear wheels run where the front ones have been, and inherit the shear displacement
  that each grid node has added up, in whatever direction, so they grip at full strength at once: its outer rear wheel
  pulls half as much again as its front one. Here every wheel meets fresh soil. The variant ``rear wheels at full shear
  strength`` raises the yaw rate, by less than the first reason; stiffer soil under the rear wheels alone (``rear
  wheels in stiff ruts``) hardly changes it. SCM's rear sinkage counts from the untouched surface, the rut included.

With the first difference taken away and the second left in, the model's yaw rates are 0.87 to 1.07 of SCM's. Real
soil lies between: measured wheels do have to push, and less than the model's (see :mod:`.single_wheel`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.parameters import Numerics, Robot, Soil, TorusWheel
from ddagr_gym.presets import PROTOTYPE_EXIT_ANGLE_RATIO, PROTOTYPE_PEAK_COEFFICIENTS
from ddagr_gym.simulator import simulate
from ddagr_gym.validation.compaction import NoCompactionResistance
from ddagr_gym.validation.tables import read_columns

Array = NDArray[np.float64]

FILE = "chrono_scm_skid.csv"
"""Inside the folder of the reference data."""

DURATION = 12.0
"""Time to reach a steady turn [s]; the yaw rate then changes by less than 1e-6 rad/s over the last second."""

_PLATFORM_MASS, _WHEEL_MASS = 60.0, 5.0  # [kg], of the reference data
_PLATFORM_YAW_INERTIA = 5.9  # [kg m^2], of the reference data
_STRAIGHT = 1e-3  # [rad/s], yaw rate below which a row is no turn
_STANDING = 1e-2  # [m/s], speed below which a row turns on the spot

HEADLINE = "model"
VARIANTS = (
    HEADLINE,
    "no compaction resistance",
    "rear wheels at full shear strength",
    "rear wheels in stiff ruts",
)
"""The model, and what-if runs that take one difference to SCM away."""


@dataclass(frozen=True)
class Turns:
    """Steady turns; wheels in the order 1 front right, 2 front left, 3 rear right, 4 rear left.

    Attributes:
        soil: (N,) names.
        commands: (N, 2) right and left bank speed [rad/s].
        v_x: (N,) forward [m/s].
        v_y: (N,) to the left [m/s].
        yaw_rate: (N,) [rad/s].
        sinkage: (N, 4) [m].
        axle_torque: (N, 4) the soil's, negative for a driven wheel [N m].
    """

    soil: tuple[str, ...]
    commands: Array
    v_x: Array
    v_y: Array
    yaw_rate: Array
    sinkage: Array
    axle_torque: Array


@dataclass(frozen=True)
class Agreement:
    """One variant of the model against the reference.

    Attributes:
        variant: one of :data:`VARIANTS`.
        yaw_rate_ratio: (N,) model over reference; NaN where the reference drives straight.
        slip_difference: (N, 2) model less reference, right and left bank [-].
        speed_ratio: (N,) forward speed, model over reference; NaN on the spot.
        front_sinkage_ratio: (N,) mean of both front wheels, model over reference.
        rear_sinkage_ratio: (N,) the same behind.
        correlation: of the yaw rates over all rows.
    """

    variant: str
    yaw_rate_ratio: Array
    slip_difference: Array
    speed_ratio: Array
    front_sinkage_ratio: Array
    rear_sinkage_ratio: Array
    correlation: float


def read_turns(data: str | Path) -> Turns:
    """The reference's turns.

    Args:
        data: folder of the reference data.

    Raises:
        InputError: the file is missing or not as expected.
    """
    wheels = ("fr", "fl", "rr", "rl")
    names = [f"{quantity}_{wheel}" for quantity in ("sink", "tq") for wheel in wheels]
    table, texts = read_columns(Path(data) / FILE, ["base_rad_s", "diff_rad_s", "vx", "vy", "wz", *names], ["soil"])
    base, half_difference = table["base_rad_s"], table["diff_rad_s"]
    return Turns(
        soil=tuple(texts["soil"]),
        commands=np.stack([base + half_difference, base - half_difference], axis=-1),
        v_x=table["vx"],
        v_y=table["vy"],
        yaw_rate=table["wz"],
        sinkage=np.stack([table[f"sink_{wheel}"] for wheel in wheels], axis=-1),
        axle_torque=np.stack([table[f"tq_{wheel}"] for wheel in wheels], axis=-1),
    )


def reference_robot() -> Robot:
    """The reference's robot as a whole; the inertia of its wheels is that of solid tori at their hubs."""
    wheel = TorusWheel(minor_radius=0.08, half_width=0.08, major_radius=0.12)
    half_wheelbase, half_track = 0.3, 0.4
    about_hub = _WHEEL_MASS * (wheel.major_radius**2 / 2 + 5 * wheel.minor_radius**2 / 8)
    wheels = 4 * (_WHEEL_MASS * (half_wheelbase**2 + half_track**2) + about_hub)
    return Robot(
        name="chrono_box",
        mass=_PLATFORM_MASS + 4 * _WHEEL_MASS,
        yaw_inertia=_PLATFORM_YAW_INERTIA + wheels,
        half_wheelbase=half_wheelbase,
        half_track=half_track,
        wheels=(wheel,),
        centre_of_mass=(0.0, 0.0, 0.2),
        motor_rate=20.0,
        maximum_wheel_speed=20.0,
        source="the description of the reference data; motor rate ours (steady turns do not depend on it)",
    )


def reference_soil(name: str) -> Soil:
    """The reference's soil by name, with the presets' stress peak and exit angle."""
    sandy_loam = name == "sandy_loam"
    return Soil(
        cohesion=1.7e3 if sandy_loam else 1.0e3,
        friction_angle=math.radians(29.0 if sandy_loam else 28.0),
        sinkage_exponent=0.7 if sandy_loam else 1.1,
        cohesive_modulus=5.3e3 if sandy_loam else 1.0e3,
        frictional_modulus=1.52e6 if sandy_loam else 0.90e6,
        shear_modulus=0.025,
        peak_stress_coefficient_0=PROTOTYPE_PEAK_COEFFICIENTS[0],
        peak_stress_coefficient_1=PROTOTYPE_PEAK_COEFFICIENTS[1],
        exit_angle_ratio=PROTOTYPE_EXIT_ANGLE_RATIO,
    )


def variant_soils(variant: str, soil: Soil) -> tuple[Soil, Soil, Soil, Soil]:
    """Soil under each wheel for one of :data:`VARIANTS`."""
    rear = soil
    if variant == "rear wheels at full shear strength":
        rear = soil.with_values(shear_modulus=0.01 * soil.shear_modulus)
    elif variant == "rear wheels in stiff ruts":
        rear = soil.with_values(
            cohesive_modulus=10.0 * soil.cohesive_modulus, frictional_modulus=10.0 * soil.frictional_modulus
        )
    return (soil, soil, rear, rear)


def drive_turns(reference: Turns, variant: str = HEADLINE, numerics: Numerics = Numerics()) -> Turns:
    """The same commands on the same soils, from rest to a steady turn.

    Args:
        reference: its soils and commands are driven.
        variant: one of :data:`VARIANTS`.
        numerics: accuracy.
    """
    robot = reference_robot()
    effects = (NoCompactionResistance(),) if variant == "no compaction resistance" else ()
    rows = []
    for name, command in zip(reference.soil, reference.commands, strict=True):
        soils = variant_soils(variant, reference_soil(name))
        commands = np.tile(command, (round(DURATION * 125.0), 1))
        drive = simulate(robot, soils, commands, effects=effects, numerics=numerics)
        rows.append({key: values[-1] for key, values in drive.items()})

    def collect(*names: str) -> Array:
        return np.array([[row[f"true_{name}"] for name in names] for row in rows])

    motion = collect("v_x", "v_y", "yaw_rate")
    return replace(
        reference,
        v_x=motion[:, 0],
        v_y=motion[:, 1],
        yaw_rate=motion[:, 2],
        sinkage=collect(*(f"sinkage_{wheel}" for wheel in range(1, 5))),
        axle_torque=collect(*(f"axle_torque_{wheel}" for wheel in range(1, 5))),
    )


def bank_slips(turns: Turns, robot: Robot) -> Array:
    """1 - v/(R0 omega) of the right and the left bank, (N, 2); NaN where a bank is locked."""
    speed = turns.v_x[:, None] + turns.yaw_rate[:, None] * robot.half_track * np.array([1.0, -1.0])
    rim = robot.wheels[0].outer_radius * turns.commands
    return np.asarray(1.0 - speed / np.where(rim == 0.0, np.nan, rim))


def agreement(variant: str, model: Turns, reference: Turns) -> Agreement:
    """Ratios and differences of one variant against the reference."""
    robot = reference_robot()
    turning = np.abs(reference.yaw_rate) > _STRAIGHT
    travelling = np.abs(reference.v_x) > _STANDING
    sinkage = [turns.sinkage.reshape(-1, 2, 2).mean(axis=2) for turns in (model, reference)]
    ratio = sinkage[0] / sinkage[1]
    return Agreement(
        variant=variant,
        yaw_rate_ratio=_ratio(model.yaw_rate, reference.yaw_rate, turning),
        slip_difference=bank_slips(model, robot) - bank_slips(reference, robot),
        speed_ratio=_ratio(model.v_x, reference.v_x, travelling),
        front_sinkage_ratio=ratio[:, 0],
        rear_sinkage_ratio=ratio[:, 1],
        correlation=float(np.corrcoef(model.yaw_rate, reference.yaw_rate)[0, 1]),
    )


def _ratio(numerator: Array, denominator: Array, valid: NDArray[np.bool_]) -> Array:
    return np.asarray(np.divide(numerator, denominator, out=np.full(numerator.shape, np.nan), where=valid))


def compare(reference: Turns, variants: Sequence[str] = VARIANTS) -> tuple[dict[str, Turns], list[Agreement]]:
    """Turns of every variant by name, and their agreement with the reference."""
    driven: Mapping[str, Turns] = {name: drive_turns(reference, name) for name in variants}
    return dict(driven), [agreement(name, turns, reference) for name, turns in driven.items()]
