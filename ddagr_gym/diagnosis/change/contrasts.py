"""Whether the sizes of effects differ before and after some time of one drive.

Before and after that time robot, ground and sensors are the same, so that what ordinary drives differ by, which hides
small changes between drives, does not count. With an effect's columns in the windows after a time and in those before
it as two effects of k sizes, a and b, beside all that may differ between drives (equation (1) of
:mod:`ddagr_gym.diagnosis.change.shifts`),

    d = a - b,    S = V + B + L,                                                                                    (1)

and d' S^-1 d/k is compared with an F distribution of k and v - 2 degrees of freedom. V is the covariance of d by
leaving out every window in turn (the jackknife), which holds where few windows lie on one side of the time and some
show more than others. They then are few in effect: with the share u_w of window w in the variance of d as independent
readings would make it,

    v = (sum_w u_w)^2 / sum_w u_w^2                                                                                 (2)

(F. E. Satterthwaite, Biometrics Bull. 2 (1946) 110). B is what the priors of robot, ground and sizes leave of d, L are
the squares of a fifth of the least sizes that matter, of limits and signs of a fiftieth of the whole. Windows are taken
as independent: where a size drifts with the ground, neighbours are alike and V is too small.
"""

from __future__ import annotations

from collections.abc import Container, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.change.drive_scan import Compared, DriveScan, elsewhere, named_in
from ddagr_gym.diagnosis.change.expected_scatter import ExpectedScatter
from ddagr_gym.diagnosis.change.ordinary import Scores
from ddagr_gym.diagnosis.change.shifts import LEVEL, Shift, family_probability, probability_of
from ddagr_gym.diagnosis.change.sizes import NOTHING, Sizes, at_least, explained, shown, windows_in_effect
from ddagr_gym.diagnosis.mid_drive.change_in_time import FEWEST_ASIDE, FEWEST_WINDOWS
from ddagr_gym.diagnosis.mid_drive.search_in_time import ALIKE
from ddagr_gym.diagnosis.result.detectable import least_multiple
from ddagr_gym.identification.spells import Spell
from ddagr_gym.identification.windows import WindowSet

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

MOST_TIMES = 15
"""Times of the drives at which effects are first looked for (ours): the tests at more of them hardly differ."""

TIMES_AS_TESTS = 3
"""As how many tests these times count: they share most windows, and the smallest of their probabilities is below a
level as often as that of two or three tests, in drawn readings (tests/diagnosis/change/test_contrasts.py)."""

SEARCHES = 2
"""By which the level of false alarms is divided within a drive (ours): that between drives comes on top."""

FEWEST_DEGREES = 1.0
"""Of freedom, below which the windows do not tell how far a size is known."""


@dataclass(frozen=True, eq=False)
class Contrast:
    """Sizes in a part of the drives less those in the rest.

    Attributes:
        sizes: with their covariances, equation (1) without L.
        degrees: of freedom, from equation (2).
        gain: fall of the cost by sizes that differ, over those that are alike in all of the drives.
    """

    sizes: Sizes
    degrees: float
    gain: float


def contrast_sizes(scores: Scores, keys: Sequence[str], ridge: Array, beside: Sequence[str]) -> Contrast | None:
    """Sizes where an effect is present less those elsewhere; None where the drives hardly show one of them.

    Args:
        scores: with those of every window.
        keys: (k,) of columns that have others elsewhere.
        ridge: (k,) information on their multiples before any data.
        beside: keys of columns that are estimated with them.
    """
    both, known = (*keys, *elsewhere(keys)), shown(scores, beside)
    if scores.gradients is None or scores.informations is None or len(shown(scores, both)) < len(both):
        return None
    rows = [scores.keys.index(key) for key in (*both, *known)]
    inner = scores.information[np.ix_(rows, rows)]
    prior = np.diag(np.concatenate([ridge, ridge, np.zeros(len(known))]) + NOTHING * np.diag(inner))
    one = np.eye(len(keys))
    apart = np.concatenate([one, -one, np.zeros((len(keys), len(known)))], axis=1)
    answer = np.asarray(np.linalg.solve(inner + prior, apart.T).T)
    informations = scores.informations[:, rows][:, :, rows]
    degrees = windows_in_effect(answer @ informations @ answer.T) - 2.0
    if degrees < FEWEST_DEGREES:
        return None
    gradients = (scores.gradient - scores.gradients)[:, rows, None]
    without = np.linalg.solve(inner + prior - informations, gradients)[..., 0] @ apart.T
    robot = answer @ scores.between[np.ix_(rows, rows)] @ answer.T
    value, whole = answer @ scores.gradient[rows], answer @ inner @ answer.T
    within = at_least(_jackknife(without - value), whole - robot)
    gain = 0.5 * float(value @ np.linalg.solve(whole, value))
    # the prior of the sizes draws both to nothing, and most where the drive shows least
    return Contrast(Sizes(value, within, robot + answer @ prior @ answer.T), degrees, gain)


def _jackknife(away: Array) -> Array:
    """(k, k) covariance of a value, of (W, k) by how much it differs without each window."""
    return (len(away) - 1.0) / len(away) * away.T @ away


def contrast_of(compared: Compared, scores: Scores, looks: int) -> Shift | None:
    """Sizes of a candidate in a part of the drives against those in the rest, equation (1).

    Args:
        compared: the candidate.
        scores: with its columns elsewhere.
        looks: as how many tests it counts.
    """
    found = _contrast(compared, scores)
    return None if found is None else _shift(compared, found, looks)


def _contrast(compared: Compared, scores: Scores) -> Contrast | None:
    return contrast_sizes(scores, compared.keys, compared.ridge, named_in(scores.keys))


def _shift(compared: Compared, found: Contrast, looks: int) -> Shift:
    candidate, sizes = compared.candidate, found.sizes
    least = np.array([least_multiple(candidate, k) for k in range(len(compared.keys))])
    between = sizes.between + np.diag((ExpectedScatter().of(candidate) * least) ** 2)
    covariance = sizes.within + between
    probability = probability_of(candidate.has_sizes, sizes.value, covariance, found.degrees)
    nothing = np.zeros(len(compared.keys))
    return Shift(
        compared, sizes.value, nothing, covariance, between, found.degrees, probability,
        drives=found.degrees, few=found.degrees, looks=looks, apart=True,
    )  # fmt: skip


def in_order(windows: WindowSet) -> Integers:
    """(W,) place of each window of a single drive in the order of time."""
    return np.argsort(np.argsort(windows.time, kind="stable"))


def places_tried(windows: WindowSet) -> list[int]:
    """Places of windows from which on an effect is first looked for; none in a drive that is too short.

    Nor in several drives: what differs between two of them differs between ordinary drives too.
    """
    if windows.count < FEWEST_WINDOWS or len(np.unique(windows.recording)) > 1:
        return []
    first, last = FEWEST_ASIDE, windows.count - FEWEST_ASIDE
    return sorted({round(place) for place in np.linspace(first, last, min(MOST_TIMES, last - first + 1)).tolist()})


def looks_of(windows: WindowSet) -> int:
    """As how many tests a change of an effect counts, over all times and both searches; at least 1."""
    return max(SEARCHES * min(TIMES_AS_TESTS, len(places_tried(windows))), 1)


@dataclass(frozen=True)
class _Surest:
    """The surest change of an effect over the times that were tried."""

    probability: float
    gain: float
    first: int
    compared: Compared


def begun_in_drive(scan: DriveScan, windows: WindowSet, tests: int, names: Container[str]) -> dict[str, Spell]:
    """Effects that change within a drive, with what explains about as much, and from when on or up to when.

    Args:
        scan: of the drive, with all candidates present everywhere.
        windows: of the scan.
        tests: number of candidates that are compared.
        names: of effects that can be what changed.
    """
    best = _surest(scan, windows, names)
    tried = looks_of(windows) * tests
    sure = [item for item in best.values() if family_probability(item.probability, tried) < LEVEL]
    most = max((item.gain for item in sure), default=np.inf)
    return {name: _spell(scan, windows, item) for name, item in best.items() if item.gain >= ALIKE * most}


def _surest(scan: DriveScan, windows: WindowSet, names: Container[str]) -> dict[str, _Surest]:
    """By effect the surest change, whether it begins or ends."""
    place, best = in_order(windows), dict[str, _Surest]()
    for first in places_tried(windows):
        scores = scan.parted(place >= first).scores()
        for item in (item for item in scan.compared if item.name in names):
            found = _contrast(item, scores)
            if found is None:
                continue
            shift = _shift(item, found, 1)
            probability = probability_of(True, shift.value, shift.covariance, shift.degrees)
            if item.name not in best or probability < best[item.name].probability:
                best[item.name] = _Surest(probability, found.gain, first, item)
    return best


def _spell(scan: DriveScan, windows: WindowSet, found: _Surest) -> Spell:
    """From when on, or up to when, the effect explains most, near the time at which it was found."""
    place, item, tried = in_order(windows), found.compared, places_tried(windows)
    step = max((later - earlier for earlier, later in pairwise(tried)), default=1)
    near = [first for first in range(found.first - step, found.first + step + 1) if tried[0] <= first <= tried[-1]]
    scores = {first: scan.parted(place >= first).scores() for first in near}
    gains = {first: made.gain for first in near if (made := _contrast(item, scores[first])) is not None}
    first = max(gains, key=gains.__getitem__)
    at, named = int(np.flatnonzero(place == first)[0]), named_in(scores[first].keys)
    later, earlier = (explained(scores[first], keys, item.ridge, named) for keys in (item.keys, item.elsewhere))
    return Spell(int(windows.recording[at]), float(windows.time[at]), ends=earlier > later)
