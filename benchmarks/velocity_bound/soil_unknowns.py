"""The soil of an episode as standard normal numbers: the nine of the distribution, and the modes of its variation."""

from __future__ import annotations

from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from ddagr_gym.parameters import Soil
from ddagr_gym.physics.layout import (
    SOIL_COHESION,
    SOIL_COHESIVE_MODULUS,
    SOIL_FRICTION_TANGENT,
    SOIL_FRICTIONAL_MODULUS,
)
from ddagr_gym.physics.soil_draws import (
    _CHOLESKY,
    _LOGARITHMIC,
    _STIFFNESS_OVER_STRENGTH,
    _STRENGTH_AND_STIFFNESS,
    CORRELATED,
    REFERENCE_SINKAGE,
    REFERENCE_WIDTH,
    SoilDistribution,
)
from ddagr_gym.physics.terrain import SoilField

Array = NDArray[np.float64]

_STRENGTH = (SOIL_COHESION, SOIL_FRICTION_TANGENT)
_STIFFNESS = (SOIL_COHESIVE_MODULUS, SOIL_FRICTIONAL_MODULUS)
_LOST = 1e-6  # of a share from the ends of its range


class _Given:
    """In place of a generator: hands out given numbers, so that a soil is built where soils are drawn."""

    def __init__(self, normals: Array) -> None:
        self._normals = normals

    def standard_normal(self, size: int) -> Array:
        return self._normals[:size]

    def uniform(self, size: int) -> Array:
        return np.asarray(norm.cdf(self._normals[-size:]))


def soil_of(distribution: SoilDistribution, normals: Array) -> Soil:
    """Soil of nine standard normal numbers: those of the five correlated parameters, then of the other four."""
    return distribution.sample(cast(Any, _Given(normals)))


def normals_of(distribution: SoilDistribution, soil: Soil) -> Array:
    """Numbers (9,) of which :func:`soil_of` makes this soil of the distribution."""
    pressure = soil.cohesive_modulus / REFERENCE_WIDTH + soil.frictional_modulus
    values = {
        "reference_pressure": pressure * REFERENCE_SINKAGE**soil.sinkage_exponent,
        "cohesive_share": soil.cohesive_modulus / REFERENCE_WIDTH / pressure,
    }
    shares = {}
    for name in distribution.range_names():
        low, high = getattr(distribution, name)
        value = values[name] if name in values else float(getattr(soil, name))
        if name in _LOGARITHMIC:
            low, high, value = np.log([low, high, value])
        shares[name] = np.clip((value - low) / (high - low), _LOST, 1.0 - _LOST)
    mixed = norm.ppf([shares[name] for name in CORRELATED])
    others = norm.ppf([shares[name] for name in shares if name not in CORRELATED])
    return np.concatenate([np.linalg.solve(_CHOLESKY, mixed), others])


class FieldModes(NamedTuple):
    """Soil along the wheels' paths by few independent numbers (Karhunen and Loeve).

    Attributes:
        nodes: (nx, ny, M) standard normal field at the nodes for a unit of each mode.
        strength: (M,) true coordinates of strength.
        stiffness: (M,) of what stiffness has of its own.
        kept: share of the variance along the paths that the modes hold.
    """

    nodes: Array
    strength: Array
    stiffness: Array
    kept: float


def log_deviations(variation: float) -> tuple[float, float]:
    """Standard deviations of the logs of strength and stiffness for a relative variation of strength."""
    strength, stiffness = np.sqrt(np.log1p(np.square([variation, _STIFFNESS_OVER_STRENGTH * variation])))
    return float(strength), float(stiffness)


def field_modes(
    field: SoilField, mean: Array, places: Array, variation: float, length: float, share: float = 0.99
) -> FieldModes:
    """The fewest modes that hold ``share`` of the variance at the places.

    Args:
        field: the true soil by place.
        mean: (9,) soil about which it varies, in the order of ``layout.SOIL_PARAMETERS``.
        places: (N, 2) of the hubs along the drive [m].
        variation: of strength, relative [-].
        length: of correlation [m].
        share: of the variance [-].
    """
    weights = _interpolation(field, places)
    axes = [field.origin[i] + field.spacing[i] * np.arange(field.values.shape[i]) for i in range(2)]
    kernels = [np.exp(-(((axis[:, None] - axis[None]) / length) ** 2)) for axis in axes]
    onto = np.kron(*kernels) @ weights.T
    values, vectors = np.linalg.eigh(weights @ onto)
    values, vectors = values[::-1], vectors[:, ::-1]
    count = int(np.searchsorted(np.cumsum(values) / values.sum(), share)) + 1
    values, vectors = values[:count], vectors[:, :count]
    strength, stiffness = (
        ((np.log(field.values[..., at] / mean[at]) + 0.5 * spread**2) / spread).ravel() @ weights.T
        for at, spread in zip((_STRENGTH[0], _STIFFNESS[1]), log_deviations(variation), strict=True)
    )
    own = (stiffness - _STRENGTH_AND_STIFFNESS * strength) / np.sqrt(1.0 - _STRENGTH_AND_STIFFNESS**2)
    return FieldModes(
        (onto @ vectors / np.sqrt(values)).reshape(*field.values.shape[:2], count),
        strength @ vectors / np.sqrt(values),
        own @ vectors / np.sqrt(values),
        float(values.sum() / np.trace(weights @ onto)),
    )


def _interpolation(field: SoilField, places: Array) -> Array:
    """Weights (N, nx ny) of the nodes in the bilinear interpolation at places (N, 2), held at the edges."""
    shape = field.values.shape[:2]
    lower, part = [], []
    for i in range(2):
        along = np.clip((places[:, i] - field.origin[i]) / field.spacing[i], 0.0, shape[i] - 1.0)
        lower.append(np.minimum(along.astype(int), shape[i] - 2))
        part.append(along - lower[-1])
    weights = np.zeros((len(places), shape[0] * shape[1]))
    rows = np.arange(len(places))
    for i in (0, 1):
        for j in (0, 1):
            own = (part[0] if i else 1.0 - part[0]) * (part[1] if j else 1.0 - part[1])
            weights[rows, (lower[0] + i) * shape[1] + lower[1] + j] += own
    return weights


def varied_field(field: SoilField, modes: FieldModes, strength: Array, own: Array, variation: float) -> Array:
    """Values (nx, ny, 9) of a field whose modes differ by ``strength`` and ``own`` (M,) from the truth."""
    changes = modes.nodes @ strength, modes.nodes @ own
    together = _STRENGTH_AND_STIFFNESS * changes[0] + np.sqrt(1.0 - _STRENGTH_AND_STIFFNESS**2) * changes[1]
    deviations = log_deviations(variation)
    values = field.values.copy()
    values[..., _STRENGTH] *= np.exp(deviations[0] * changes[0])[..., None]
    values[..., _STIFFNESS] *= np.exp(deviations[1] * together)[..., None]
    return values
