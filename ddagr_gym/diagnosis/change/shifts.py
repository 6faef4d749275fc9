"""Shifts of the sizes of effects from what they are in ordinary drives, in standard deviations of all that varies.

With the gradient g and the information H of a drive's columns, the sizes t of an effect beside those of named ones are

    t = A g,    A = (H + R)^-1,    V = A W A    (within the drive),    B = A C A    (expected between drives),      (1)

with the windows' scatter W of the gradient, what the priors of robot, soil and biases move it by, C, and the reach R of
sizes that exist. The same sizes t_i of n ordinary drives scatter by T_r about their mean m besides their own V_i
(method of moments). Few drives say little of T_r: it is drawn towards what is expected, with the weight of a few
further drives (G. K. Smyth, Stat. Appl. Genet. Mol. Biol. 3 (2004) 3),

    T = (d0 (B + F) + d_r T_r)/(d0 + d_r),    S = V + T + (T + V_m)/n,                                              (2)

and (t - m)' S^-1 (t - m)/k is compared with F(k, d). Of S only the share between drives, U = S - V, is known as badly
as d0 + d_r drives tell it; V is known by the windows of the drive, of which some v count (equation (2) of
:mod:`ddagr_gym.diagnosis.change.contrasts`). With the largest share r of U in the variance of any combination of sizes

    d = max(d0 + d_r, 1/(r^2/(d0 + d_r) + (1 - r)^2/(v - 1)))                                                       (3)

(F. E. Satterthwaite, Biometrics Bull. 2 (1946) 110). F is what simulators of another structure differ by:
measured for drives from before (:mod:`ddagr_gym.diagnosis.change.measured_scatter`), for calibrations the square of a
fifth of the least meaningful size, of signs and limits of a fiftieth of the whole.

Of a single ordinary drive T is B + F, and wider where its pieces scatter more than that: they say nothing of what all
of them share.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.change.drive_scan import Compared, scattered
from ddagr_gym.diagnosis.change.ordinary import Comparison, Scores
from ddagr_gym.diagnosis.result.detectable import least_multiple

Array = NDArray[np.float64]

LEVEL = 0.05
"""Of false alarms over the whole library."""

POWER = 0.8
"""With which a least detectable shift is found."""

MOST_LIMITS = 4.0
"""Multiples of its limit at which a change is found for sure, for the search of where it is (ours): five degrees of
freedom need one and a half."""

NOTHING = 1e-9
"""Share of the information before projection below which there is nothing but rounding."""


@dataclass(frozen=True, eq=False)
class Sizes:
    """Sizes of an effect in one drive, as multiples of its probes.

    Attributes:
        value: (k,).
        within: (k, k) covariance within the drive.
        between: (k, k) expected covariance between drives.
        windows: how many windows in effect tell the covariance within the drive; 0 where that was not kept.
    """

    value: Array
    within: Array
    between: Array
    windows: float = 0.0


@dataclass(frozen=True, eq=False)
class Shift:
    """Sizes of an effect against ordinary drives, as multiples of its probes.

    Attributes:
        compared: the probes.
        value: (k,) from the mean of ordinary drives.
        mean: (k,) of ordinary drives.
        covariance: (k, k) of the value, equation (2).
        between: (k, k) share of ordinary drives in it.
        degrees: of freedom, equation (3).
        probability: of an ordinary drive to show as much, for this candidate alone.
        drives: degrees of freedom with which the share of ordinary drives is known, d0 + d_r.
        looks: as how many tests it counts: in so many parts of the drive it was looked for.
        apart: whether it is against the rest of the drive in place of ordinary drives.
    """

    compared: Compared
    value: Array
    mean: Array
    covariance: Array
    between: Array
    degrees: float
    probability: float
    drives: float
    looks: int = 1
    apart: bool = False

    @property
    def distance(self) -> float:
        """In standard deviations."""
        return float(np.sqrt(self.value @ np.linalg.solve(self.covariance, self.value)))

    def limit(self, tests: int) -> float:
        """Distance that ordinary drives exceed for any of so many candidates at the level."""
        return distance_at(single_level(tests * self.looks), len(self.value), self.degrees)

    def detectable(self, tests: int) -> Array:
        """(k,) multiples of each probe alone that pass the limit with the power."""
        reach = distance_found(self.limit(tests), len(self.value), self.degrees)
        return np.asarray(reach / np.sqrt(np.diag(np.linalg.inv(self.covariance))))


def single_level(tests: int) -> float:
    """Level of one of several tests whose family has :data:`LEVEL` (Z. Sidak, JASA 62 (1967) 626)."""
    return float(-np.expm1(np.log1p(-LEVEL) / tests))


def family_probability(single: float, tests: int) -> float:
    """Probability of the smallest of several tests, by the same."""
    return float(-np.expm1(tests * np.log1p(-min(single, 1.0 - 1e-16))))


def distance_at(level: float, dimension: int, degrees: float) -> float:
    """Distance that is exceeded with a probability."""
    from scipy.special import fdtri

    return float(np.sqrt(dimension * fdtri(dimension, degrees, 1.0 - level)))


def distance_found(limit: float, dimension: int, degrees: float) -> float:
    """Distance of a change that passes a limit with :data:`POWER`, by the noncentral F distribution."""
    from scipy.optimize import brentq
    from scipy.special import ncfdtr

    def missed(distance: float) -> float:
        return float(ncfdtr(dimension, degrees, distance**2, limit**2 / dimension)) - (1.0 - POWER)

    return float(brentq(missed, 0.0, MOST_LIMITS * limit))


def sizes_of(scores: Scores, keys: Sequence[str], ridge: Array, beside: Sequence[str] = ()) -> Sizes | None:
    """Sizes of some probes, equation (1); None where the drive shows nothing of one of them.

    Args:
        scores: of a drive.
        keys: of the probes.
        ridge: (k,) information on their multiples before any data.
        beside: keys of columns that are estimated with them.
    """
    if not scanned(scores, keys):
        return None
    known = shown(scores, beside)
    rows = [scores.keys.index(key) for key in (*keys, *known)]
    inner = scores.information[np.ix_(rows, rows)]
    k = len(keys)
    if not (np.diag(inner)[:k] > NOTHING).all():
        return None
    prior = np.concatenate([ridge, np.zeros(len(known))]) + NOTHING * np.diag(inner)
    inverse = np.asarray(np.linalg.inv(inner + np.diag(prior))[:k], dtype=np.float64)
    gradient = scores.gradient[rows]
    within = (
        inverse
        @ _within(scores, rows, np.asarray(np.linalg.solve(inner + np.diag(prior), gradient), dtype=np.float64))
        @ inverse.T
    )
    expected = scores.between[np.ix_(rows, rows)]
    # what independent readings make of the gradient, without what the priors do: that is between drives
    independent = inverse @ (inner - expected) @ inverse.T
    windows = 0.0
    if scores.informations is not None:
        windows = windows_in_effect(inverse @ scores.informations[:, rows][:, :, rows] @ inverse.T)
    return Sizes(inverse @ gradient, at_least(within, independent), inverse @ expected @ inverse.T, windows)


def windows_in_effect(shares: Array) -> float:
    """How many windows tell a covariance, of the (W, k, k) shares that each has in it, by their sizes in the whole."""
    sizes = np.einsum("kl,wlk->w", np.linalg.pinv(shares.sum(axis=0), hermitian=True), shares)
    return float(sizes.sum() ** 2 / (sizes**2).sum())


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
    share = min(1.0, float(np.linalg.eigvals(np.linalg.solve(covariance, between)).real.max()))
    return max(drives, 1.0 / (share**2 / drives + (1.0 - share) ** 2 / (windows - 1.0)))


def shown(scores: Scores, keys: Sequence[str]) -> tuple[str, ...]:
    """Those of some columns of which a drive shows anything: a limit that it does not reach has none."""
    return tuple(
        key for key in keys if scanned(scores, [key]) and scores.information[(scores.keys.index(key),) * 2] > NOTHING
    )


def scanned(scores: Scores, keys: Sequence[str]) -> bool:
    """Whether a drive was asked for some columns: one whose poses are in frames of their own is not for places."""
    return set(keys) <= set(scores.keys)


def explained(scores: Scores, keys: Sequence[str], ridge: Array, beside: Sequence[str] = ()) -> float:
    """Fall of the cost by an effect at the best of its sizes, to first order; 0 where the drive shows nothing of it.

    Arguments as of :func:`sizes_of`.
    """
    known = shown(scores, beside)
    if len(shown(scores, keys)) < len(keys):
        return 0.0
    falls = []
    for chosen, prior in (((*keys, *known), ridge), (known, np.zeros(0))):
        rows = [scores.keys.index(key) for key in chosen]
        inner, right = scores.information[np.ix_(rows, rows)], scores.gradient[rows]
        whole = np.concatenate([prior, np.zeros(len(known))]) + NOTHING * np.diag(inner)
        falls.append(0.5 * float(right @ np.linalg.solve(inner + np.diag(whole), right)) if rows else 0.0)
    return falls[0] - falls[1]


def _within(scores: Scores, rows: Sequence[int], sizes: Array) -> Array:
    """Covariance of the gradient by the windows' scatter, at the sizes where the windows are known.

    At nothing a large size would count as scatter of the windows that show it.
    """
    if scores.gradients is None or scores.informations is None:
        return np.asarray(scores.within[np.ix_(rows, rows)])
    return scattered(scores.gradients[:, rows] - scores.informations[:, rows][:, :, rows] @ sizes)


def at_least(scattered: Array, independent: Array) -> Array:
    """The windows' covariance, with deviations that are at least those of independent rows."""
    size = np.diag(scattered)
    wide = np.sqrt(np.maximum(np.maximum(size, np.diag(independent)), 0.0) / np.where(size > 0.0, size, 1.0))
    return np.asarray(scattered * np.outer(wide, wide) + np.diag(np.where(size > 0.0, 0.0, np.diag(independent))))


def shift_of(
    compared: Compared,
    drive: Scores,
    ordinary: Comparison,
    beside: Sequence[str] = (),
    beside_ordinary: Sequence[str] = (),
) -> Shift | None:
    """Shift of a candidate's sizes, equation (2); None where the drive, or ordinary ones, show nothing of it.

    Args:
        compared: the candidate.
        drive: its scores.
        ordinary: what it is compared with.
        beside: keys of the drive's columns of named effects.
        beside_ordinary: keys of the same effects in ordinary drives.
    """
    here = sizes_of(drive, compared.keys, compared.ridge, beside)
    others = _sizes_in(compared, ordinary.drives, beside_ordinary)
    if here is None or len(others) < min(2, len(ordinary.drives)):
        return None
    least = np.array([least_multiple(compared.candidate, k) for k in range(len(compared.keys))])
    structure = np.diag((ordinary.expected.of(compared.candidate) * least) ** 2)
    pieces = _sizes_in(compared, ordinary.pieces, beside_ordinary) if len(others) == 1 else []
    away = away_from(here, others, pieces, structure, least, ordinary.expected.degrees)
    probability = probability_of(compared.candidate.has_sizes, away.value, away.covariance, away.degrees)
    return Shift(compared, away.value, away.mean, away.covariance, away.between, away.degrees, probability, away.drives)


@dataclass(frozen=True, eq=False)
class Away:
    """Sizes of one drive against those of others; attributes as of :class:`Shift`."""

    value: Array
    mean: Array
    covariance: Array
    between: Array
    degrees: float
    drives: float


def away_from(
    here: Sizes, others: Sequence[Sizes], pieces: Sequence[Sizes], structure: Array, least: Array, known: float
) -> Away:
    """Sizes of a drive against those of ordinary ones, equations (2) and (3).

    Args:
        here: of the drive.
        others: of ordinary drives.
        pieces: of parts of the only ordinary drive; none where there are several.
        structure: (k, k) covariance by which simulators of another structure differ, F.
        least: (k,) least sizes that matter.
        known: degrees of freedom of what is expected, d0.
    """
    expected = here.between + structure
    mean, spread, of_mean, degrees = _ordinary_scatter(others, structure, least)
    scatter = (known * expected + degrees * spread) / (known + degrees)
    if pieces:
        scatter = _widened(scatter, structure, pieces, least, known)
    between = scatter + (scatter + of_mean) / (degrees + 1.0)
    whole, drives = here.within + between, known + degrees
    freedom = degrees_of_freedom(whole, between, drives, here.windows)
    return Away(here.value - mean, mean, whole, between, freedom, drives)


def _sizes_in(compared: Compared, drives: Sequence[Scores], beside: Sequence[str]) -> list[Sizes]:
    found = [sizes_of(item, compared.keys, compared.ridge, beside) for item in drives]
    return [item for item in found if item is not None]


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


def probability_of(has_sizes: bool, value: Array, covariance: Array, degrees: float) -> float:
    """Of an ordinary drive to show sizes as far away; of what is there or not nothing is less than nothing.

    Args:
        has_sizes: False for a limit or a sign.
        value: (k,) sizes.
        covariance: (k, k) of them.
        degrees: of freedom.
    """
    from scipy.special import fdtrc

    if not has_sizes and value[0] <= 0.0:
        return 1.0
    k = len(value)
    return float(fdtrc(k, degrees, float(value @ np.linalg.solve(covariance, value)) / k))


@dataclass(frozen=True)
class Pull:
    """A parameter of robot, ground or sensors that a fit moved from its calibrated value.

    Attributes:
        name: of the parameter.
        distance: in the deviations that ordinary drives have.
        degrees: of freedom.
    """

    name: str
    distance: float
    degrees: float

    @property
    def probability(self) -> float:
        """Of an ordinary drive to move this parameter as much."""
        from scipy.special import stdtr

        return float(2.0 * stdtr(self.degrees, -self.distance))

    def limit(self, tests: int) -> float:
        """Distance that ordinary drives exceed in any of so many tests at the level."""
        return distance_at(single_level(tests), 1, self.degrees)
