"""Shifts of the sizes of effects from what they are in ordinary drives, in standard deviations of all that varies.

With the gradient g and the information H of a drive's columns, the sizes t of an effect beside those of named ones are

    t = A g,    A = (H + R)^-1,    V = A W A    (within the drive),    B = A C A    (expected between drives),      (1)

with the windows' scatter W of the gradient, what the priors of robot, soil and biases move it by, C, and the reach R of
sizes that exist. The same sizes t_i of n ordinary drives scatter by T_r about their mean m besides their own V_i
(method of moments). Few drives say little of T_r: it is drawn towards what is expected, with the weight of a few
further drives (G. K. Smyth, Stat. Appl. Genet. Mol. Biol. 3 (2004) 3),

    T = (d0 (B + F) + d_r T_r)/(d0 + d_r),    S = V + T + (T + V_m)/n,                                              (2)

and (t - m)' S^-1 (t - m)/k is compared with F(k, d). Of S only the share between drives, U = S - V, is known as badly
as d' = d0 + d_r drives tell it; V is known by the windows of the drive, of which some v count (equation (2) of
:mod:`ddagr_gym.diagnosis.change.contrasts`). With the largest share r of U in the variance of any combination of sizes

    d = max(d', 1/(r^2/d' + (1 - r)^2/(v - 1)))                                                                     (3)

(F. E. Satterthwaite, Biometrics Bull. 2 (1946) 110). F is what simulators of another structure differ by
(:mod:`ddagr_gym.diagnosis.change.measured_scatter`). How well simulated drives tell it, d1, counts for drives from
before. A robot's own ordinary drives say more of it: against a calibration d0 is few, but for an effect of which these
drives scatter no more than B + F, to whom the expectation does then apply,

    T = B + F,    d' = d1 + d_r    where no combination of sizes has more of T_r than of B + F.                     (4)

Of a single ordinary drive T is B + F, and wider where its pieces scatter more than that: they say nothing of what all
of them share.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.change.between_drives import away_from
from ddagr_gym.diagnosis.change.drive_scan import Compared
from ddagr_gym.diagnosis.change.ordinary import Comparison, Scores
from ddagr_gym.diagnosis.change.sizes import Sizes, sizes_of
from ddagr_gym.diagnosis.result.detectable import least_multiple

Array = NDArray[np.float64]

LEVEL = 0.05
"""Of false alarms over the whole library."""

POWER = 0.8
"""With which a least detectable shift is found."""

MOST_LIMITS = 4.0
"""Multiples of its limit at which a change is found for sure, for the search of where it is (ours): five degrees of
freedom need one and a half."""


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
        drives: degrees of freedom with which the share of ordinary drives is known, d'; of what is against the rest of
            the drive, those of the windows.
        few: the same without equation (4), d0 + d_r.
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
    few: float
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
        return least_found(self.covariance, self.degrees, single_level(tests * self.looks))


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


def least_found(covariance: Array, degrees: float, level: float) -> Array:
    """(k,) sizes, each alone, that pass the limit of a level with :data:`POWER`.

    Args:
        covariance: (k, k) of sizes.
        degrees: of freedom.
        level: of a single test.
    """
    k = len(covariance)
    reach = distance_found(distance_at(level, k, degrees), k, degrees)
    return np.asarray(reach / np.sqrt(np.diag(np.linalg.inv(covariance))))


def distance_found(limit: float, dimension: int, degrees: float) -> float:
    """Distance of a change that passes a limit with :data:`POWER`, by the noncentral F distribution."""
    from scipy.optimize import brentq
    from scipy.special import ncfdtr

    def missed(distance: float) -> float:
        return float(ncfdtr(dimension, degrees, distance**2, limit**2 / dimension)) - (1.0 - POWER)

    return float(brentq(missed, 0.0, MOST_LIMITS * limit))


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
    away = away_from(here, others, pieces, structure, least, ordinary.expected)
    probability = probability_of(compared.candidate.has_sizes, away.value, away.covariance, away.degrees)
    return Shift(
        compared, away.value, away.mean, away.covariance, away.between, away.degrees, probability, away.drives, away.few
    )


def _sizes_in(compared: Compared, drives: Sequence[Scores], beside: Sequence[str]) -> list[Sizes]:
    found = [sizes_of(item, compared.keys, compared.ridge, beside) for item in drives]
    return [item for item in found if item is not None]


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
