"""The part of a torus wheel that touches the soil (theory: wheel model, section 2).

Angle theta from bottom dead centre, positive to the front; psi across the section, positive to the left.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import kernel
from ddagr_gym.physics.fast_math import asin_half, cos_small, inverse_sqrt, sin_small

LANES = 8
"""Section nodes that the kernel treats at once; the compiler turns them into one vector."""

# Rows of the section workspace, LANES entries each
RHO, ENTRY, COS_ENTRY, SIN_ENTRY, NORMAL_Y, LATERAL_Y, V_X_LOCAL, Y_LOCAL, AREA, NODE, WEIGHT = (
    LANES * i for i in range(11)
)
SECTION_SIZE = 11 * LANES  # the eleven rows above


@kernel(inline=True)
def lateral_edge(minor_radius: float, sinkage: float) -> float:
    """psi_l = acos(1 - sinkage/minor_radius), capped at 90 degrees."""
    return math.acos(max(1.0 - sinkage / minor_radius, 0.0))


@kernel(inline=True)
def sin_edge(minor_radius: float, sinkage: float) -> float:
    """sin(psi_l)."""
    return math.sqrt(max(sinkage * (2.0 * minor_radius - sinkage), 0.0)) / minor_radius


@kernel(inline=True)
def _square_of_half(rho: float, hub_height: float) -> float:
    """sin^2 of half the entry angle."""
    return max((rho - hub_height) / (2.0 * rho), 0.0)


@kernel(inline=True)
def entry_angle(rho: float, hub_height: float) -> float:
    """theta_f = acos(hub_height/rho), as 2 asin sqrt((1 - cos)/2); 0 where the slice is clear of the soil."""
    return 2.0 * asin_half(math.sqrt(_square_of_half(rho, hub_height)))


@kernel(inline=True)
def fill_section(
    minor_radius: float,
    half_width: float,
    major_radius: float,
    hub_height: float,
    edge: float,
    v_x: float,
    yaw_rate: float,
    section_nodes: NDArray[np.float64],
    first: int,
    workspace: NDArray[np.float64],
) -> None:
    """Geometry of LANES slices of the section: radius, entry angle, directions, slice velocity and area.

    AREA is dS per unit u of the contact substitution: rho D (d psi) theta_f.
    """
    for i in range(LANES):
        workspace[NODE + i] = section_nodes[2 * first + i]
        workspace[WEIGHT + i] = section_nodes[2 * first + LANES + i]
    for i in range(LANES):
        weight = edge * workspace[WEIGHT + i]
        half_psi = 0.5 * edge * workspace[NODE + i]
        sin_half = sin_small(half_psi)
        sin_psi = 2.0 * sin_half * cos_small(half_psi)
        cos_psi = 1.0 - 2.0 * sin_half * sin_half
        rho = major_radius + minor_radius * cos_psi
        theta_f = entry_angle(rho, hub_height)
        square = _square_of_half(rho, hub_height)
        a = minor_radius * sin_psi
        b = half_width * cos_psi
        inverse_d = inverse_sqrt(a * a + b * b)
        y = half_width * sin_psi
        workspace[RHO + i] = rho
        workspace[ENTRY + i] = theta_f
        workspace[COS_ENTRY + i] = 1.0 - 2.0 * square
        workspace[SIN_ENTRY + i] = 2.0 * math.sqrt(square * (1.0 - square))
        workspace[NORMAL_Y + i] = a * inverse_d
        workspace[LATERAL_Y + i] = b * inverse_d
        workspace[V_X_LOCAL + i] = v_x - yaw_rate * y
        workspace[Y_LOCAL + i] = y
        workspace[AREA + i] = rho * (a * a + b * b) * inverse_d * weight * theta_f


@lru_cache(maxsize=32)
def section_rule(nodes: int) -> NDArray[np.float64]:
    """Gauss nodes for psi = psi_l sin(v), v in [-pi/2, pi/2]; blocks of LANES sin(v) and LANES weights.

    The substitution removes the square-root singularity of theta_f at the edges of the patch.
    """
    points, weights = np.polynomial.legendre.leggauss(nodes)
    v = points * (math.pi / 2)
    pairs = np.stack([np.sin(v), weights * (math.pi / 2) * np.cos(v)])
    return np.ascontiguousarray(pairs.reshape(2, -1, LANES).swapaxes(0, 1).reshape(-1))


@lru_cache(maxsize=32)
def contact_rule(nodes: int) -> NDArray[np.float64]:
    """Gauss nodes for theta = theta_f - (theta_f - theta_m) u^2, u in [0, 1]: rows u^2 and 2 u weight."""
    points, weights = np.polynomial.legendre.leggauss(nodes)
    u = (points + 1.0) / 2.0
    return np.stack([u * u, u * weights])
