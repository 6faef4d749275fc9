"""Soil laws of the benchmark's own field: pressure against depth, shear stress against displacement.

None of them is the Bekker-Wong-Janosi chain of the package (theory: wheel model, section 4):

=====================  ===============================================================================
pressure law           p(z) under a contact of width b
=====================  ===============================================================================
``REECE``              (c k_1 + gamma b k_2) (z/b)^n                          Reece 1964
``SATURATING``         p_s tanh(z/z_s), p_s(z_s), z_s matched to Reece        Kacigin and Guskov 1968
``TWO_STAGE``          p_s (1 - exp(-z/z_s)) (1 + z/z_h), matched likewise    after Gotteland and Benoit 2006
=====================  ===============================================================================

All are multiplied by the rate term 1 + chi ln(1 + V/V_0) (viscous hardening of wet clay).

=====================  ===============================================================================
shear law              tau(j)/tau_max
=====================  ===============================================================================
``KONDNER``            j/(K_h + j), hyperbola                                 Kondner 1963
``HUMP``               (1 - exp(-j/K)) (1 + h exp(-j/K_w)), peak then residual   after Wong 1983 and Oida 1979
``ELASTOPLASTIC``      j/sqrt(K^2 + j^2), stiff start and sharp knee          ours
=====================  ===============================================================================

The shear stress opposes the shear displacement (not the sliding velocity).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from .jit import kernel

REECE, SATURATING, TWO_STAGE = 0, 1, 2
KONDNER, HUMP, ELASTOPLASTIC = 0, 1, 2

REFERENCE_SPEED = 0.05
"""V_0 of the rate term [m/s]."""


class Soil(NamedTuple):
    """Soil of one case. Nominal values stand for Table A.1's clay in this simulator's own laws."""

    cohesion: float = 4140.0  # c [Pa], Table A.1
    friction_angle: float = math.radians(13.0)  # phi [rad], Table A.1
    cohesive_bearing: float = 50.0  # k_1 [-]
    unit_weight: float = 16000.0  # gamma [N/m^3], wet clay
    frictional_bearing: float = 37.0  # k_2 [-]
    exponent: float = 0.5  # n [-], Table A.1
    shear_length: float = 0.0024  # K_h of the hyperbola [m], fitted to Table 6.2's turn
    exit_ratio: float = 0.9  # exit over entry angle [-]
    peak_0: float = 0.35  # stress peak over entry angle at no slip [-]
    peak_1: float = 0.3  # its growth with slip [-]
    rate_gain: float = 0.03  # chi [-]
    stiffness: float = 1.0  # multiplies the pressure [-]
    strength: float = 1.0  # multiplies the shear strength [-]
    pressure_law: int = REECE
    shear_law: int = KONDNER
    hump: float = 0.25  # h, peak over residual strength less one [-]
    hump_length: float = 0.03  # K_w [m]


@kernel
def pressure(soil, depth, width, speed):  # type: ignore[no-untyped-def]
    """Pressure [Pa] of untouched soil at ``depth`` [m] under a contact of ``width`` [m]."""
    scale = soil.cohesion * soil.cohesive_bearing + soil.unit_weight * width * soil.frictional_bearing
    scale *= soil.stiffness * (1.0 + soil.rate_gain * math.log(1.0 + speed / REFERENCE_SPEED))
    if soil.pressure_law == SATURATING:
        return 0.34 * scale * math.sqrt(0.12 / width) * math.tanh(depth / 0.0095)
    if soil.pressure_law == TWO_STAGE:
        return 0.17 * scale * math.sqrt(0.12 / width) * (1.0 - math.exp(-depth / 0.0030)) * (1.0 + depth / 0.012)
    return scale * (depth / width) ** soil.exponent


@kernel
def mobilised(soil, displacement):  # type: ignore[no-untyped-def]
    """Share of the shear strength per metre of displacement, tau/(tau_max j) [1/m], finite at j = 0."""
    if soil.shear_law == HUMP:
        ratio = displacement / (2.0 * soil.shear_length) + 1e-9
        growth = (1.0 - math.exp(-ratio)) / (ratio * 2.0 * soil.shear_length)
        return growth * (1.0 + soil.hump * math.exp(-displacement / soil.hump_length)) / (1.0 + 0.4 * soil.hump)
    if soil.shear_law == ELASTOPLASTIC:
        return 1.0 / math.sqrt((1.7 * soil.shear_length) ** 2 + displacement * displacement)
    return 1.0 / (soil.shear_length + displacement)
