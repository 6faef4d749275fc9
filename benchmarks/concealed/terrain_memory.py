"""Terrain that keeps what wheels did to it: a grid of depths that all four wheels deform, sideways too.

A cell holds how deep it lies below the untouched surface, after the soil has sprung back. A wheel of sinkage s stands
on the floor d that earlier passes left under it, mean over the tyre's width, and d + s = Z below the untouched surface.
Soil that has carried depth d carries a stiffer load until it is as deep again,

    p = k min((Z - d_k)/r, Z)^n

under each part k of the width, with the share r of the depth that springs back: reloading by a stiffness of k r^-n,
then the curve of untouched soil (elastic reloading after Wong, Theory of Ground Vehicles, section 2.4). A wheel that
moves sideways presses what it meets, and is held by the wall of its rut with the passive earth pressure of the wall's
height. What the same wheel pressed a moment ago is not yet a rut. A robot whose rear wheels stand in ruts is tilted,
which its accelerometer sees, but does not drive uphill.
"""

from __future__ import annotations

import math

import numpy as np

from .ground import RUT_CELL, RUT_CELLS, rut_index
from .jit import kernel

HEIGHT_GRID = 3
"""Value of ``Ground.rut_mode``."""
FLOOR_BEFORE, DEPTH, PRESSED = 0, 1, 2
"""Layers of the grid: floor before the present pass, depth after it [m], time of the last contact [s]."""
FLOOR, WALL_LEFT, WALL_RIGHT = 3, 4, 5
"""Columns of what lies under a wheel, beside strength, stiffness and relief: floor and heights of its walls [m]."""
PASSING = 0.8
"""How long ago a wheel must have passed for its track to be a rut [s]."""
ACROSS = 5
"""Places across the tyre at which the grid is read."""
SPACING = 0.04
"""Between these places [m]."""
CONTACT = 0.1
"""Length of contact over which floor and walls are averaged [m]."""


@kernel
def new_grid(kept):  # type: ignore[no-untyped-def]
    """Untouched grid (3, cells, cells), of one cell where none is kept."""
    cells = RUT_CELLS if kept else 1
    grid = np.zeros((3, cells, cells))
    grid[PRESSED] = -np.inf
    return grid


@kernel
def _floor(grid, i, j, time):  # type: ignore[no-untyped-def]
    """Depth of a cell before the present pass [m]."""
    if time - grid[PRESSED, i, j] > PASSING:
        grid[FLOOR_BEFORE, i, j] = grid[DEPTH, i, j]
    return grid[FLOOR_BEFORE, i, j]


@kernel
def _wall(grid, side, floor, x, y, yaw, time):  # type: ignore[no-untyped-def]
    """Height over ``floor`` of what lies ``side`` [m] to the left of a wheel."""
    i, j = rut_index(x - side * math.sin(yaw), y + side * math.cos(yaw))
    return max(floor - _floor(grid, i, j, time), 0.0)


@kernel
def press(grid, rebound, exponent, under, sinkage, x, y, yaw, travel, time):  # type: ignore[no-untyped-def]
    """Press a wheel into the grid and return the relative stiffening of the soil under it.

    Args:
        grid: of :func:`new_grid`; changed.
        rebound: share of the depth that springs back, r.
        exponent: of the pressure, n.
        under: row of the wheel; floor and walls are changed.
        sinkage: below the floor [m].
        x, y, yaw: of the wheel, world frame [m], [rad].
        travel: since the last call [m].
        time: [s].
    """
    depth = under[FLOOR] + sinkage
    floor, support = 0.0, 0.0
    for k in range(ACROSS):
        side = SPACING * (k - ACROSS // 2)
        i, j = rut_index(x - side * math.sin(yaw), y + side * math.cos(yaw))
        below = _floor(grid, i, j, time)
        carried = min(max(depth - below, 0.0) / rebound, depth)
        support += (carried / max(sinkage, 1e-4)) ** exponent / ACROSS
        floor += below / ACROSS
        grid[DEPTH, i, j] = max(grid[DEPTH, i, j], (1.0 - rebound) * depth)
        grid[PRESSED, i, j] = time
    share = min(travel / CONTACT, 1.0)
    beside = SPACING * (ACROSS // 2) + RUT_CELL
    under[WALL_LEFT] += share * (_wall(grid, beside, floor, x, y, yaw, time) - under[WALL_LEFT])
    under[WALL_RIGHT] += share * (_wall(grid, -beside, floor, x, y, yaw, time) - under[WALL_RIGHT])
    under[FLOOR] += share * (floor - under[FLOOR])
    return support - 1.0
