"""How far sizes scatter between ordinary drives: what both kinds of simulated pairs are fitted by."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.result.uncertainty import STRUCTURE, STRUCTURE_OF_LIMIT

Array = NDArray[np.float64]

DEGREES = (24.0, 16.0, 12.0, 10.0, 8.0, 6.0, 5.0, 4.0, 3.0)
"""Degrees of freedom that are tried, the most first; the fewest stay where none keeps the level of alarms."""
MOST = 30.0
"""Largest scatter that is tried, in least sizes that matter."""
STEPS = 60
"""Values that are tried between the least and the largest."""


def least_scatter(has_sizes: bool) -> float:
    """Scatter below which none counts, in least sizes that matter, of limits and signs in the whole of them."""
    return STRUCTURE if has_sizes else STRUCTURE_OF_LIMIT


def log_density(value: Array, covariance: Array, degrees: float) -> float:
    """Logarithm of the density of the multivariate t distribution about 0.

    Args:
        value: (k,).
        covariance: (k, k) its scale.
        degrees: of freedom.
    """
    k = len(value)
    square = float(value @ np.linalg.solve(covariance, value))
    constant = math.lgamma(0.5 * (degrees + k)) - math.lgamma(0.5 * degrees) - 0.5 * k * math.log(degrees * math.pi)
    spread = 0.5 * float(np.linalg.slogdet(covariance)[1])
    return constant - spread - 0.5 * (degrees + k) * math.log1p(square / degrees)


def most_likely(least: float, most: float, density: Callable[[float], float]) -> float:
    """Value between two bounds, spaced by equal factors, of which the logarithm of a density is largest."""
    tried: list[float] = np.geomspace(least, most, STEPS).tolist()
    return max(tried, key=density)


def rounded(values: Array, digits: int) -> list[float]:
    """Numbers as JSON has them, with so many digits."""
    return [float(f"{value:.{digits}g}") for value in values]
