"""Sizes of one drive against those of ordinary ones: how far these scatter, and how well that is known.

Equations (2) to (4) of :mod:`ddagr_gym.diagnosis.change.shifts`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.change.expected_scatter import ExpectedScatter
from ddagr_gym.diagnosis.change.sizes import Sizes

Array = NDArray[np.float64]

FEWEST = 1.0
"""Degrees of freedom of ordinary drives from which on they can agree with what is expected (ours): two drives."""


@dataclass(frozen=True, eq=False)
class Away:
    """Sizes of one drive against those of others; attributes as of :class:`Shift`."""

    value: Array
    mean: Array
    covariance: Array
    between: Array
    degrees: float
    drives: float
    few: float


def away_from(
    here: Sizes,
    others: Sequence[Sizes],
    pieces: Sequence[Sizes],
    structure: Array,
    least: Array,
    expectation: ExpectedScatter,
) -> Away:
    """Sizes of a drive against those of ordinary ones, equations (2) to (4).

    Args:
        here: of the drive.
        others: of ordinary drives.
        pieces: of parts of the only ordinary drive; none where there are several.
        structure: (k, k) covariance by which simulators of another structure differ, F.
        least: (k,) least sizes that matter.
        expectation: whose degrees of freedom are d0 and d1.
    """
    expected, known = here.between + structure, expectation.degrees
    mean, spread, of_mean, degrees = _ordinary_scatter(others, structure, least)
    few = known + degrees
    if expectation.agreeing > known and degrees >= FEWEST and largest_share(spread, expected) <= 1.0:
        known, spread = expectation.agreeing, expected
    scatter = (known * expected + degrees * spread) / (known + degrees)
    if pieces:
        scatter = _widened(scatter, structure, pieces, least, known)
    between = scatter + (scatter + of_mean) / (degrees + 1.0)
    whole, drives = here.within + between, known + degrees
    freedom = degrees_of_freedom(whole, between, drives, here.windows)
    return Away(here.value - mean, mean, whole, between, freedom, drives, few)


def degrees_of_freedom(covariance: Array, between: Array, drives: float, windows: float) -> float:
    """Of a covariance within a drive and between drives, equation (3).

    Args:
        covariance: (k, k) of sizes.
        between: (k, k) share of ordinary drives in it.
        drives: degrees of freedom with which that is known.
        windows: how many windows in effect tell the rest of it.
    """
    if windows <= 1.0:
        return drives
    share = min(1.0, largest_share(between, covariance))
    return max(drives, 1.0 / (share**2 / drives + (1.0 - share) ** 2 / (windows - 1.0)))


def largest_share(part: Array, whole: Array) -> float:
    """Largest ratio of the variances of any combination of sizes by two covariances (k, k)."""
    return float(np.linalg.eigvals(np.linalg.solve(whole, part)).real.max())


def _widened(expected: Array, structure: Array, pieces: Sequence[Sizes], least: Array, known: float) -> Array:
    """Expected scatter, shrunk together with that of the pieces of a drive where these scatter more."""
    if len(pieces) < 2:
        return expected
    _, spread, _, degrees = _ordinary_scatter(pieces, structure, least)
    return expected + degrees / (known + degrees) * _positive(spread - expected)


def _ordinary_scatter(found: Sequence[Sizes], structure: Array, least: Array) -> tuple[Array, Array, Array, float]:
    """Mean of ordinary drives, their scatter besides their own covariances, the mean of these, degrees of freedom.

    A drive that says little, or of which little was known, counts for little.
    """
    scale = least**-2.0
    size = np.array([float(scale @ np.diag(item.within + item.between + structure)) for item in found])
    weight = (1.0 / size) / float((1.0 / size).sum())
    count = 1.0 / float((weight**2).sum())
    values = np.stack([item.value for item in found])
    mean = weight @ values
    away = values - mean
    inside = np.tensordot(weight, np.stack([item.within for item in found]), axes=1)
    # of two drives or more the weighted scatter has n/(n - 1) of its expected size missing
    whole = np.einsum("n,nk,nl->kl", weight, away, away) * count / max(count - 1.0, 0.5)
    return mean, _positive(whole - inside), inside, count - 1.0


def _positive(matrix: Array) -> Array:
    """The nearest covariance: negative variances are none."""
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)
