"""Soil that differs from place to place: a grid of soils, interpolated under each wheel."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.jit import kernel
from ddagr_gym.parameters import Soil
from ddagr_gym.physics.layout import BASE_SOIL, SOIL, SOIL_PARAMETERS, WHEEL_X, WHEEL_Y
from ddagr_gym.physics.wheel_forces import soil_vector


@dataclass(frozen=True)
class SoilField:
    """Soil parameters on a rectangular grid of the world; constant beyond its edge.

    Attributes:
        origin: world x, y of the first node [m].
        spacing: distance between nodes along x and y [m].
        values: (nx, ny, 9) in the order of ``layout.SOIL_PARAMETERS``.
    """

    origin: tuple[float, float]
    spacing: tuple[float, float]
    values: NDArray[np.float64]

    def __post_init__(self) -> None:
        if self.values.ndim != 3 or self.values.shape[2] != len(SOIL_PARAMETERS) or min(self.values.shape[:2]) < 2:
            raise InputError(
                f"SoilField.values has shape {self.values.shape}: give (nx, ny, {len(SOIL_PARAMETERS)}), nx, ny >= 2."
            )
        if not np.isfinite(self.values).all():
            raise InputError("SoilField.values contains NaN or infinity: give finite soil parameters.")
        if not np.isfinite((*self.origin, *self.spacing)).all() or min(self.spacing) <= 0:
            raise InputError(
                f"SoilField has origin {self.origin} and spacing {self.spacing}: give finite places and positive "
                "distances in m."
            )

    @classmethod
    def sample(cls, soil_at: Callable[[float, float], Soil], x: ArrayLike, y: ArrayLike) -> SoilField:
        """Field from a function of place, sampled on evenly spaced ``x`` (nx,) and ``y`` (ny,) [m]."""
        xs, ys = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        if xs.size < 2 or ys.size < 2:
            raise InputError(f"the grid has {xs.size} x {ys.size} nodes: give at least 2 x 2.")
        for name, nodes in (("x", xs), ("y", ys)):
            if not np.allclose(np.diff(nodes), nodes[1] - nodes[0], rtol=1e-6, atol=0.0):
                raise InputError(f"{name} of the grid is {nodes.tolist()}: give evenly spaced nodes.")
        values = np.array([[soil_vector(soil_at(float(a), float(b))) for b in ys] for a in xs])
        spacing = (float(xs[1] - xs[0]), float(ys[1] - ys[0]))
        return cls((float(xs[0]), float(ys[0])), spacing, values)


class SoilGrids(NamedTuple):
    """Soil grids of a batch of N environments.

    Attributes:
        values: (grids, nx, ny, 9) in the order of ``layout.SOIL_PARAMETERS``.
        geometry: (grids, 4) origin x, origin y, spacing x, spacing y [m].
        chosen: (N,) grid of each environment, -1 for the base soils of its row.
    """

    values: NDArray[np.float64]
    geometry: NDArray[np.float64]
    chosen: NDArray[np.int64]


@kernel()
def _cell(position: float, origin: float, spacing: float, nodes: int) -> tuple[int, float]:
    """Lower node of the cell and the fraction across it, clamped to the grid."""
    place = min(max((position - origin) / spacing, 0.0), nodes - 1.0)
    lower = min(int(place), nodes - 2)
    return lower, place - lower


@kernel()
def sample_soil(row: NDArray[np.float64], grids: SoilGrids, n: int) -> None:
    """Soil under each wheel: the robot's base soils, or its grid interpolated bilinearly at the hub.

    Args:
        row: of environment ``n``: reads WHEEL_X, WHEEL_Y, BASE_SOIL; writes SOIL.
        grids: of the batch.
        n: environment.
    """
    if grids.chosen[n] < 0:
        for j in range(36):
            row[SOIL + j] = row[BASE_SOIL + j]
        return
    values, geometry = grids.values[grids.chosen[n]], grids.geometry[grids.chosen[n]]
    for wheel in range(4):
        i, fx = _cell(row[WHEEL_X + wheel], geometry[0], geometry[2], values.shape[0])
        j, fy = _cell(row[WHEEL_Y + wheel], geometry[1], geometry[3], values.shape[1])
        for p in range(9):
            near = values[i, j, p] + fy * (values[i, j + 1, p] - values[i, j, p])
            far = values[i + 1, j, p] + fy * (values[i + 1, j + 1, p] - values[i + 1, j, p])
            row[SOIL + 9 * wheel + p] = near + fx * (far - near)
