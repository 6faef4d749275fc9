"""Stresses under a wheel (theory: wheel model, sections 3 and 4; thesis A.7-A.25 with its errata).

Each formula stands here once; the kernel of :mod:`ddagr_gym.physics.contact_patch` sums them over the patch.
"""

from __future__ import annotations

import math

from ddagr_gym.jit import kernel
from ddagr_gym.physics.fast_math import LOG2_E, exp2_bounded, inverse_sqrt, log2_positive

PEAK_CEILING = 0.9
"""Ours: theta_m stays below 0.9 theta_f, else the front of the patch vanishes at slip 1 (theory: wheel model, E17)."""

_TINY = 1e-300
"""Keeps logarithms and inverse roots finite where depth or sliding vanish; far below any that counts."""


@kernel(inline=True)
def slip_ratio(rim_speed: float, v_x: float) -> float:
    """s (R0 omega - v_x) / max(|R0 omega|, |v_x|), s the sign of the larger; 0 at rest.

    Theory: wheel model, eq. (8).
    """
    largest = max(abs(rim_speed), abs(v_x))
    if largest == 0.0:
        return 0.0
    return math.copysign(1.0, rim_speed + v_x) * (rim_speed - v_x) / largest


@kernel(inline=True)
def forward_slip_ratio(rim_speed: float, v_x: float, rest_speed: float) -> float:
    """:func:`slip_ratio` of a wheel that travels forward, continued smoothly through rest and reversal (ours).

    It is exact from R0 omega + v_x = rest_speed on; the sign and the direction of a vanishing motion would jump.
    """
    return (rim_speed - v_x) / max(max(abs(rim_speed), abs(v_x)), 0.5 * rest_speed)


@kernel(inline=True)
def peak_fraction(coefficient_0: float, coefficient_1: float, slip: float) -> float:
    """theta_m / theta_f = clip(a0 + a1 slip, 0, PEAK_CEILING) (theory: wheel model, eq. (7); A.8)."""
    return min(max(coefficient_0 + coefficient_1 * slip, 0.0), PEAK_CEILING)


@kernel(inline=True)
def pressure_modulus(cohesive: float, frictional: float, half_width: float, sin_edge: float) -> float:
    """k_c/b_patch + k_phi with b_patch = 2 half_width sin(psi_l) (theory: wheel model, eq. (11), E14)."""
    return cohesive / (2.0 * half_width * sin_edge) + frictional


@kernel(inline=True)
def normal_stress(modulus: float, exponent: float, depth: float) -> float:
    """sigma = (k_c/b + k_phi) z^n (theory: wheel model, eq. (11), (12); thesis A.5, A.7)."""
    return modulus * exp2_bounded(exponent * log2_positive(max(depth, _TINY)))


@kernel(inline=True)
def shear_over_speed(
    strength: float, displacement_t: float, displacement_l: float, v_t: float, v_l: float, decay: float
) -> float:
    """tau/|V|: strength (1 - exp(-|j|/K)) over the sliding speed, so that tau_t = -result * V_t (Janosi).

    Theory: wheel model, eq. (15), (16).

    Args:
        strength: cohesion + sigma tan(phi) [Pa].
        displacement_t: nu j_t, before division by the shear rate [m/s].
        displacement_l: nu j_l [m/s].
        v_t: sliding velocity along the tread [m/s].
        v_l: sliding velocity across it [m/s].
        decay: -1/(nu K) [s/m].
    """
    square = displacement_t * displacement_t + (displacement_l * displacement_l + _TINY)
    growth = 1.0 - exp2_bounded(square * inverse_sqrt(square) * (decay * LOG2_E))
    return strength * growth * inverse_sqrt(v_t * v_t + (v_l * v_l + _TINY))
