"""Ground with another soil law: do controllers that were tuned on one law drive on another?

Scenario set T drives the turns of S1 on it, controllers untouched. It is another law, not other parameters:

==================  ============================================  ===================================================
part                the simulator's own law                       here
==================  ============================================  ===================================================
pressure            (k_c/b + k_phi) z^n (Bekker)                  q g(z), g = (1 - exp(-z/z_1)) (1 + z/z_2): a crust
                                                                  that gives way and hardens below; q from Bekker's
                                                                  pressure at 12 mm, so that soils keep their order
shear stress        (c + sigma tan phi)(1 - exp(-j/K))            (c + sigma tan phi) h(j), h with a peak at 2.5 K and
                    (Janosi and Hanamoto)                         a residual strength: Wong, Theory of Ground Vehicles
                                                                  (3rd ed. 2001), section 2.4.3, after Oida (1979)
direction           against the sliding velocity                  against the shear displacement
contact             torus, stress along every slice               flat patch, pressure as a parabola along it
==================  ============================================  ===================================================

The simulator's own shear stress is switched off by strength (a factor 1e-6, undone here), its pressure is the new law's
tangent in ln z at each wheel's depth, and the forces of the patch are added per wheel. Of the simulator remain the
solution for the sinkage and the compaction resistance that its pressure gives.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from ddagr_gym.errors import unknown_name
from ddagr_gym.jit import kernel
from ddagr_gym.physics.effects.base import Effect, Vector, size
from ddagr_gym.physics.lateral_scale import LateralScale
from ddagr_gym.physics.layout import (
    EXTRA_AXLE_TORQUE,
    EXTRA_FORCE_X,
    EXTRA_FORCE_Y,
    EXTRA_YAW_MOMENT,
    LOAD,
    POINT_SOIL,
    POINT_WHEEL_FORCES,
    SINKAGE,
    SOIL,
    SOIL_COHESION,
    SOIL_COHESIVE_MODULUS,
    SOIL_EXIT_RATIO,
    SOIL_EXPONENT,
    SOIL_FRICTION_TANGENT,
    SOIL_FRICTIONAL_MODULUS,
    SOIL_SHEAR_MODULUS,
    WHEEL,
    WHEEL_OMEGA,
    WHEEL_V_X,
    WHEEL_V_Y,
    YAW_RATE,
)

NOMINAL_LAW = "thesis"
"""Name of the simulator's own law in scenario files."""

LAW = "crust_and_residual"
"""Name of this one."""

CRUST_DEPTH, HARDENING_DEPTH, REFERENCE_DEPTH = 4e-3, 15e-3, 12e-3
"""z_1, z_2 and the depth at which the pressure is Bekker's [m]."""

PEAK_OVER_MODULUS, RESIDUAL = 2.5, 0.75
"""Displacement of the peak over Janosi's K, and residual over peak strength [-]."""

_MUTED = 1e-6  # factor that switches the nominal shear stress off; undone by division (ours)
_POINTS = 12  # of the midpoint rule along the contact (ours)
_REST_SPEED = 2e-3  # [m/s]
_LEAST_DEPTH, _GREATEST_DEPTH = 1e-3, 60e-3  # [m] between which the tangent is taken


@kernel(inline=True)
def crust_pressure(depth: float) -> float:
    """g(z) of the pressure law [-]."""
    return (1.0 - math.exp(-depth / CRUST_DEPTH)) * (1.0 + depth / HARDENING_DEPTH)


@kernel(inline=True)
def mobilised_strength(displacement: float, peak: float) -> float:
    """h(j): 0 at no displacement, 1 at the peak, the residual beyond (Wong, 2.4.3)."""
    ratio = displacement / peak
    hump = (1.0 / (RESIDUAL * (1.0 - math.exp(-1.0))) - 1.0) * math.exp(1.0 - ratio)
    return RESIDUAL * (1.0 + hump) * (1.0 - math.exp(-ratio))


def lay_crust(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Pressure by the crust's law as a power of sinkage that touches it at each wheel's depth; own shear muted."""
    for i in range(4):
        soil = SOIL + 9 * i
        depth = min(max(row[SINKAGE + i], _LEAST_DEPTH), _GREATEST_DEPTH)
        crust = math.exp(-depth / CRUST_DEPTH)
        slope = depth * (crust / (CRUST_DEPTH * (1.0 - crust)) + 1.0 / (HARDENING_DEPTH + depth))
        reference = REFERENCE_DEPTH ** row[soil + SOIL_EXPONENT]
        factor = reference * crust_pressure(depth) / crust_pressure(REFERENCE_DEPTH) / depth**slope
        row[soil + SOIL_EXPONENT] = slope
        row[soil + SOIL_COHESIVE_MODULUS] *= factor
        row[soil + SOIL_FRICTIONAL_MODULUS] *= factor
        row[soil + SOIL_COHESION] *= _MUTED
        row[soil + SOIL_FRICTION_TANGENT] *= _MUTED


def shear_patch(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Shear forces of each wheel's flat patch, against the displacement that the soil has taken since it entered."""
    for i in range(4):
        soil = SOIL + 9 * i
        depth, load = row[SINKAGE + i], row[LOAD + i]
        if depth <= 0.0 or load <= 0.0:
            continue
        minor, half_width = row[WHEEL + i], row[WHEEL + 4 + i]
        radius = minor + row[WHEEL + 8 + i]
        rim, v_x = radius * row[WHEEL_OMEGA + i], row[WHEEL_V_X + i]
        front = math.sqrt(2.0 * radius * depth)
        length = front * (1.0 + row[soil + SOIL_EXIT_RATIO])
        missing = max(1.0 - depth / minor, 0.0)
        width = 2.0 * half_width * math.sqrt(max(1.0 - missing * missing, 1e-6))
        travel = rim + v_x
        forward = travel / math.sqrt(travel * travel + _REST_SPEED * _REST_SPEED)
        pace = math.sqrt(max(rim * rim, v_x * v_x) + _REST_SPEED * _REST_SPEED)
        peak = PEAK_OVER_MODULUS * row[soil + SOIL_SHEAR_MODULUS]
        cohesion = row[soil + SOIL_COHESION] / _MUTED * width * length / _POINTS
        friction = row[soil + SOIL_FRICTION_TANGENT] / _MUTED * load / _POINTS
        for k in range(_POINTS):
            share = (k + 0.5) / _POINTS
            behind = share * length
            arm = forward * (front - behind)
            along = (rim - v_x) * behind / pace
            across = -(row[WHEEL_V_Y + i] + arm * row[YAW_RATE]) * behind / pace
            moved = math.sqrt(along * along + across * across + 1e-18)
            strength = cohesion + friction * 6.0 * share * (1.0 - share)
            pull = parameters[0] * strength * mobilised_strength(moved, peak) / moved
            row[EXTRA_FORCE_X + i] += pull * along
            row[EXTRA_FORCE_Y + i] += pull * across
            row[EXTRA_YAW_MOMENT + i] += arm * pull * across
            row[EXTRA_AXLE_TORQUE + i] -= radius * pull * along


@dataclass(frozen=True)
class CrustAndResidual(Effect):
    """Another soil law in place of the simulator's own.

    Attributes:
        strength: of the shear stress over the soil's own.
    """

    name = "other_ground"
    title = "Another soil law"
    group = "ground"
    equation = "p = q g(z), tau = (c + sigma tan phi) h(j) against the displacement"
    source = "Wong, Theory of Ground Vehicles, sections 2.4.2 and 2.4.3; matching ours"
    signature = "none that a refit of the simulator's law leaves"
    actions = ((POINT_SOIL, lay_crust), (POINT_WHEEL_FORCES, shear_patch))

    strength: float = size("-", 0.1, 3.0, least=0.05, default=1.0, neutral=1.0)


LAWS: dict[str, tuple[Effect, ...]] = {
    NOMINAL_LAW: (),
    LAW: (CrustAndResidual(),),
    "lateral_0.8": (LateralScale(0.8),),
    "lateral_1.2": (LateralScale(1.2),),
}
"""Effects that turn the simulator's own soil law into the one of a name."""


def ground_effects(law: str) -> tuple[Effect, ...]:
    """Effects of a scenario's soil law; InputError for an unknown name."""
    if law not in LAWS:
        raise unknown_name("soil law", law, LAWS)
    return LAWS[law]
