"""Soil under a wheel, made stronger or stiffer; shared by the ground effects."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import kernel
from ddagr_gym.physics.layout import (
    SOIL,
    SOIL_COHESION,
    SOIL_COHESIVE_MODULUS,
    SOIL_FRICTION_TANGENT,
    SOIL_FRICTIONAL_MODULUS,
)

LOWEST_FACTOR = 0.1  # the inverse of the highest
HIGHEST_FACTOR = 10.0
"""Bounds of factors on strength and stiffness: published soils of one kind differ by no more."""


@kernel(inline=True)
def scale_soil(row: NDArray[np.float64], wheel: int, strength: float, stiffness: float) -> None:
    """Multiply shear strength (cohesion, tan phi) and pressure moduli (k_c, k_phi) of one wheel's soil."""
    soil = SOIL + 9 * wheel
    row[soil + SOIL_COHESION] *= strength
    row[soil + SOIL_FRICTION_TANGENT] *= strength
    row[soil + SOIL_COHESIVE_MODULUS] *= stiffness
    row[soil + SOIL_FRICTIONAL_MODULUS] *= stiffness
