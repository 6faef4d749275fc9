"""Drives at which something changed, by what it does to the sizes of all effects.

The shifts x_ij of size j in drive i from the mean of ordinary drives are taken for

    x_ij = m_j + sum_e d_je a_ie + e_ij,    m_j ~ N(0, v_j^2 c_j^2),    e_ij ~ N(0, v_j^2 s_ij^2),                  (1)

m_j being what the mean of ordinary drives is off by, s_ij and c_j the deviations of
:class:`~ddagr_gym.diagnosis.answer.drive_series.SizePoint`, and a_e 1 in some drives in a row: to the last (it
stays), in a single one, or in some after which it is over. The scatter v_j is known from the f_j
degrees of freedom of ordinary drives to be about 1. The drives say more of it by the median of their successive
differences, which a change does not enter,

    r_j = median |x_ij/s_ij - x_(i-1)j/s_(i-1)j| / 0.954,    w = (n - 1)/3,                                         (2)

with about a third of the degrees of freedom of a mean square (ours). Where F(w, f_j) is compatible with it (1 %),
v_j^2 is (f_j + w r_j^2)/(f_j + w), at least 1, with f_j + w degrees of freedom; drives that scatter more than ordinary
ones are judged by these alone, and drives that scatter less are never taken for more exact. d/sd(d) is Student's t.

The event with the least probability over all n (n + 1)/2 rows of drives and all sizes is added where, with as many
tests as these are (Z. Sidak), ordinary drives show as much in less than 5 % of the cases; each size gets its own shift
at it, since a change of one effect moves the sizes of others. Then the next is looked for. The statistic is that of
D. M. Hawkins, P. Qiu, C. W. Kang (J. Quality Technology 35 (2003) 355), over rows of drives as in A. B. Olshen et al.
(Biostatistics 5 (2004) 557), since a step alone does not find what is over again. For a single drive it is the shift
that a comparison has.

An effect's size is not exact where it is large: within the drives of an event, others count from a tenth of its
distance on, as among the names of one drive. A parameter that is drawn towards its calibrated value, and which an event
has moved, says nothing of others there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.answer.drive_series import LAST, PASSES, SINGLE, STAYS
from ddagr_gym.diagnosis.change.model import FORM
from ddagr_gym.diagnosis.change.shifts import LEVEL, family_probability

Array = NDArray[np.float64]

MOST_EVENTS = 12
"""In one series (ours): where there are more, the sentence says that these are the clearest."""

INTERVAL = 0.9
"""Of the drive at which a change of several drives began."""

_MEDIAN_DIFFERENCE = 0.954
"""Median magnitude of the difference of two standard normal numbers."""

_CLEAR = 20.0
"""Times as likely that a change is over must be as that it stays, to be said (ours)."""

_COMPATIBLE = 0.01
"""Probability below which drives scatter more than ordinary ones."""

_NOTHING = 1e-9
"""Share of a column that is left beside others, below which it is one of them."""


@dataclass(frozen=True, eq=False)
class Sizes:
    """Shifts of all sizes in all drives.

    Attributes:
        values: (n, q) shifts; NaN where a drive shows nothing of a size.
        deviations: (n, q) of each drive.
        mean_deviations: (q,) of the mean of ordinary drives.
        degrees: (q,) of freedom of the scatter between these.
        drawn: (q,) whether the size is drawn towards its usual value, by how much depends on what else it has to make
            up for; None for none.
    """

    values: Array
    deviations: Array
    mean_deviations: Array
    degrees: Array
    drawn: NDArray[np.bool_] | None = None


@dataclass(frozen=True)
class Place:
    """Drives in a row that an event may concern.

    Attributes:
        first: number of the first, from 0.
        end: number behind the last.
    """

    first: int
    end: int

    def kind(self, drives: int) -> str:
        """What so many drives show of it: it stays, passes, is in a single one, or in the last."""
        if self.end - self.first == 1:
            return LAST if self.end == drives else SINGLE
        return STAYS if self.end == drives else PASSES


@dataclass(frozen=True, eq=False)
class Event:
    """An event and what it moved.

    Attributes:
        place: where.
        shifts: (q,) of the sizes; NaN where no drive tells.
        deviations: (q,) of the shifts.
        probabilities: (q,) over all sizes and places.
        earliest: drive at which it may as well have begun.
        latest: likewise.
    """

    place: Place
    shifts: Array
    deviations: Array
    probabilities: Array
    earliest: int
    latest: int


def change_points(sizes: Sizes) -> tuple[Event, ...]:
    """Events in the order of the drives.

    Args:
        sizes: of at least one drive.
    """
    drives = len(sizes.values)
    places = [Place(first, end) for first in range(drives) for end in range(first + 1, drives + 1)]
    found: list[Place] = []
    while len(found) < MOST_EVENTS:
        best = _best(sizes, found, places)
        if best is None:
            break
        found.append(best)
    found.sort(key=lambda place: (place.first, -place.end))
    return tuple(_event(sizes, [item for item in found if item is not place], place) for place in found)


def _tests(sizes: Sizes) -> int:
    drives, count = sizes.values.shape
    return int(drives * (drives + 1) // 2 * count)


def _best(sizes: Sizes, known: Sequence[Place], places: Sequence[Place]) -> Place | None:
    """The least probable place beside others; None where ordinary drives show as much."""
    fits = [_fit(sizes, j, known, places) for j in range(sizes.values.shape[1])]
    distance = np.stack([item.distances for item in fits])
    probability = np.where(
        distance > _needed(sizes, known, places), np.stack([item.probabilities for item in fits]), 1.0
    )
    least = float(probability.min())
    if family_probability(least, _tests(sizes)) >= LEVEL:
        return None
    # probabilities that are nothing to the computer are told apart by their distances
    rank = np.where(probability <= max(least, 1e-300), distance, -1.0)
    size, place = (int(k) for k in np.unravel_index(np.argmax(rank), rank.shape))
    stays = Place(places[place].first, len(sizes.values))
    other = places.index(stays)
    clear = fits[size].likelihoods[place] - fits[size].likelihoods[other] > np.log(_CLEAR)
    told = family_probability(float(fits[size].probabilities[other]), _tests(sizes)) < LEVEL
    return stays if told and not clear else places[place]


def _needed(sizes: Sizes, known: Sequence[Place], places: Sequence[Place]) -> Array:
    """(q, p) distance that a place needs in each size beside events that concern some of the same drives."""
    count = sizes.values.shape[1]
    needed = np.zeros((count, len(places)))
    for place in known:
        shared = np.array([item.first < place.end and place.first < item.end for item in places])
        others = [item for item in known if item is not place]
        fits = [_fit(sizes, j, others, [place]) for j in range(count)]
        distance = np.array([item.distances[0] for item in fits])
        single = [float(item.probabilities[0]) for item in fits]
        if sizes.drawn is not None:
            moved = np.array([family_probability(value, _tests(sizes)) < LEVEL for value in single])
            distance = np.where(sizes.drawn & moved, np.inf, distance)
        needed = np.maximum(needed, np.where(shared, FORM * distance[:, None], 0.0))
    return needed


@dataclass(frozen=True, eq=False)
class _Fit:
    """Each of several places beside known ones in one size.

    Attributes:
        shifts: (p,) in the size's unit; NaN where no drive tells.
        deviations: (p,) likewise.
        probabilities: (p,) of each alone; 1 where no drive tells.
        likelihoods: (p,) logarithms, but for a constant.
    """

    shifts: Array
    deviations: Array
    probabilities: Array
    likelihoods: Array

    @property
    def distances(self) -> Array:
        """(p,) in deviations."""
        return np.nan_to_num(np.abs(self.shifts) / self.deviations)


def _fit(sizes: Sizes, j: int, known: Sequence[Place], places: Sequence[Place]) -> _Fit:
    """Equation (1) for one size."""
    from scipy.special import stdtr

    seen = np.isfinite(sizes.values[:, j])
    weight = 1.0 / sizes.deviations[seen, j]
    # the last row is what is known of the mean of ordinary drives
    base = _whitened([Place(0, len(seen)), *known], seen, weight)
    base[-1, 0] = 1.0 / max(sizes.mean_deviations[j], _NOTHING * float(sizes.deviations[:, j].min()))
    right = np.append(weight * sizes.values[seen, j], 0.0)
    scatter, degrees = _scatter(right[:-1], float(sizes.degrees[j]))
    tried, inside = _whitened(places, seen, weight), _basis(base)
    size = (tried**2).sum(axis=0)
    tried, right = tried - inside @ (inside.T @ tried), right - inside @ (inside.T @ right)
    left = (tried**2).sum(axis=0)
    told = left > _NOTHING * np.maximum(size, _NOTHING)
    safe = np.where(told, left, 1.0)
    shift = np.where(told, tried.T @ right / safe, np.nan)
    deviation = np.where(told, scatter / np.sqrt(safe), np.nan)
    distance = np.nan_to_num(np.abs(shift) / deviation)
    residual = np.maximum(float(right @ right) / scatter**2 - distance**2, 0.0)
    likelihood = -0.5 * (degrees + len(weight)) * np.log(degrees + residual)
    return _Fit(shift, deviation, np.where(told, 2.0 * stdtr(degrees, -distance), 1.0), likelihood)


def _scatter(standardised: Array, degrees: float) -> tuple[float, float]:
    """Scatter v of drives beside that of ordinary ones, and its degrees of freedom, equation (2)."""
    from scipy.special import fdtrc

    if len(standardised) < 2:
        return 1.0, degrees
    more = (len(standardised) - 1.0) / 3.0
    square = float(np.median(np.abs(np.diff(standardised))) / _MEDIAN_DIFFERENCE) ** 2
    if fdtrc(more, degrees, square) < _COMPATIBLE:
        return 1.0, degrees
    return float(np.sqrt(max(1.0, (degrees + more * square) / (degrees + more)))), degrees + more


def _whitened(places: Sequence[Place], seen: NDArray[np.bool_], weight: Array) -> Array:
    """Columns of some places over the deviations of the drives, with a row of nothing for the mean."""
    drives = np.arange(len(seen))[:, None]
    first, end = (np.array([getattr(place, name) for place in places]) for name in ("first", "end"))
    rows = ((drives >= first) & (drives < end))[seen] * weight[:, None]
    return np.vstack([rows, np.zeros(rows.shape[1])])


def _basis(columns: Array) -> Array:
    """Orthonormal columns that span the same."""
    length = np.sqrt((columns**2).sum(axis=0))
    left, size, _ = np.linalg.svd(columns / np.where(length > 0.0, length, 1.0), full_matrices=False)
    return np.asarray(left[:, size > _NOTHING * size[0]])


def _event(sizes: Sizes, others: Sequence[Place], place: Place) -> Event:
    fits = [_fit(sizes, j, others, [place]) for j in range(sizes.values.shape[1])]
    single = np.array([item.probabilities[0] for item in fits])
    shifts, deviations = (np.array([getattr(item, name)[0] for item in fits]) for name in ("shifts", "deviations"))
    leading = int(np.argmax([item.distances[0] for item in fits]))
    earliest, latest = _interval(sizes, leading, others, place)
    probabilities = np.array([family_probability(float(value), _tests(sizes)) for value in single])
    return Event(place, shifts, deviations, probabilities, earliest, latest)


def _interval(sizes: Sizes, j: int, others: Sequence[Place], place: Place) -> tuple[int, int]:
    """Drives at which a change of several drives may have begun, each as probable as its Student likelihood says."""
    if place.end - place.first == 1:
        return place.first, place.first
    tried = [Place(first, place.end) for first in range(place.end) if Place(first, place.end) not in others]
    found = _fit(sizes, j, others, tried)
    weight = np.exp(found.likelihoods - found.likelihoods.max())
    order = np.argsort(-weight)
    needed = int(np.searchsorted(np.cumsum(weight[order]) / weight.sum(), INTERVAL)) + 1
    chosen = [tried[k].first for k in order[:needed]]
    return min(*chosen, place.first), max(*chosen, place.first)
