"""What the probes of a scan explain of the residual beside all nuisances: gains, scores and held-out gains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.search.candidates import Candidate
from ddagr_gym.diagnosis.search.inner_products import Reduced, Terms

Array = NDArray[np.float64]

_FOLDS = 4
"""Parts of the drives that are left out in turn (ours: three quarters of a drive show nearly what all of it does)."""

_STRETCH = 6.0
"""Length of the stretches that are dealt out to the parts [s] (ours: three short windows, so that a part that is left
out is not known from its neighbours)."""


@dataclass(frozen=True)
class Gain:
    """What a candidate explains.

    Attributes:
        candidate: index among the candidates.
        name: of the effect.
        gain: fall of the cost (half a sum of squares).
        multiples: of the probes.
    """

    candidate: int
    name: str
    gain: float
    multiples: tuple[float, ...]


def best_multiples(reduced: Reduced, candidate: Candidate, dispersion: float = 1.0) -> tuple[float, Array]:
    """Gain and multiples of a candidate's probes, inside what exists in nature (theory: diagnosis, eq. (3)).

    Args:
        reduced: sums over windows.
        candidate: which probes.
        dispersion: variance of the weighted residuals by which the gain is divided.
    """
    index = np.array(candidate.columns)
    gradient = reduced.gradient[index]
    information = reduced.information[np.ix_(index, index)] + np.diag(1.0 / np.array(candidate.scales) ** 2)
    if candidate.whole is not None:
        theta = np.array([candidate.whole])
    else:
        theta = _solve_one_sided(information, gradient, np.array(candidate.one_sided))
    gain = float(theta @ gradient - 0.5 * theta @ information @ theta)
    return gain / dispersion, theta


def _solve_one_sided(information: Array, gradient: Array, one_sided: NDArray[np.bool_]) -> Array:
    """Least squares with some unknowns not negative; by trying which of them are zero (there are at most two)."""
    size = len(gradient)
    ridge = 1e-8 * np.diag(np.maximum(np.diag(information), 1e-12))
    best, found = 0.0, np.zeros(size)
    for pattern in range(1, 2**size):
        used = np.array([bool(pattern >> k & 1) for k in range(size)])
        theta = np.zeros(size)
        theta[used] = np.linalg.solve((information + ridge)[np.ix_(used, used)], gradient[used])
        if (theta[one_sided] < 0.0).any():
            continue
        gain = float(theta @ gradient - 0.5 * theta @ information @ theta)
        if gain > best:
            best, found = gain, theta
    return found


def gains(terms: Terms, weights: Array | None = None, dispersion: float = 1.0) -> list[Gain]:
    """Gain of the best candidate of each effect, largest first."""
    reduced = terms.reduced(weights)
    best: dict[str, Gain] = {}
    for k, candidate in enumerate(terms.candidates):
        gain, theta = best_multiples(reduced, candidate, dispersion)
        if candidate.is_direction and terms.turned:
            gain = max(gain, _gain_by_frame(terms, candidate, weights, dispersion))
        if candidate.name not in best or gain > best[candidate.name].gain:
            best[candidate.name] = Gain(k, candidate.name, gain, tuple(theta.tolist()))
    return sorted(best.values(), key=lambda item: -item.gain)


def _gain_by_frame(terms: Terms, candidate: Candidate, weights: Array | None, dispersion: float) -> float:
    """Gain of a direction that every frame may see turned, less what a heading explains by chance in each further one.

    Drives out and back show the same slope with opposite signs: taken to start in one direction they cancel.
    """
    frames = [frame if weights is None else frame * weights for frame in terms.frames]
    found = [best_multiples(terms.reduced(frame), candidate, dispersion)[0] for frame in frames if frame.any()]
    return sum(found) - 0.5 * (len(found) - 1)


def scores(terms: Terms, gains_: Sequence[Gain]) -> dict[str, float]:
    """Cluster-robust score of each effect along its best direction: sum over windows over its own scatter [-].

    Theory: diagnosis, eq. (4).

    The scatter is the sandwich estimate by window, so that correlated errors inside windows do not count as evidence.
    """
    reduced = terms.reduced()
    p = terms.nuisances
    result = {}
    for gain in gains_:
        candidate = terms.candidates[gain.candidate]
        theta = np.array(gain.multiples)
        direction = np.zeros(terms.normals.shape[1])
        direction[1 + p + np.array(candidate.columns)] = theta
        direction[1 : 1 + p] = -(reduced.nuisance[:, 1 + np.array(candidate.columns)] @ theta)
        by_window = terms.normals[:, 0] @ direction
        mean = by_window.mean()
        scatter = np.sqrt(((by_window - mean) ** 2).sum())
        result[gain.name] = float(by_window.sum() / scatter) if scatter > 0.0 else 0.0
    return result


def _fold_of(terms: Terms) -> NDArray[np.int64]:
    """(W,) fold of each window: the stretches of every recording that hold windows are dealt out in turn.

    Windows of long drives are spread along them: numbered by the clock, stretches would all fall into one or two folds.
    """
    stretch = np.floor(terms.time / _STRETCH).astype(np.int64)
    for recording in np.unique(terms.recording):
        own = terms.recording == recording
        occupied, rank = np.unique(stretch[own], return_inverse=True)
        stretch[own] = occupied[0] + rank.reshape(-1)
    return np.asarray((stretch + terms.recording) % _FOLDS)


def held_out_gains(terms: Terms, dispersion: float = 1.0) -> dict[str, float]:
    """Fall of the cost on windows that were left out while multiples and nuisances were fitted, by effect.

    Theory: diagnosis, section 4.

    Args:
        terms: of a scan.
        dispersion: see :func:`best_multiples`.
    """
    fold = _fold_of(terms)
    total: dict[str, float] = {}
    parts = np.unique(fold) if np.ptp(fold) > 0 else ()
    for part in parts:
        outside = (fold != part).astype(float)
        reduced = terms.reduced(outside)
        inside = terms.normals[fold == part].sum(axis=0)
        for gain in gains(terms, outside):
            change = _held_out(terms, reduced, inside, gain, 1.0 / len(parts))
            total[gain.name] = total.get(gain.name, 0.0) + change / dispersion
    return total


def _held_out(terms: Terms, reduced: Reduced, inside: Array, gain: Gain, share: float) -> float:
    """Fall of the cost on other windows by a candidate fitted elsewhere, beside the nuisances fitted elsewhere.

    The nuisances' priors count with the windows' ``share``: an effect that lets them return to what is known of soil
    and robot explains something even where the readings fit as well without it.
    """
    p = terms.nuisances
    columns = np.array(terms.candidates[gain.candidate].columns)
    theta = np.array(gain.multiples)
    base = reduced.nuisance[:, 0]

    def cost(change: Array, multiples: Array) -> float:
        vector = np.zeros(inside.shape[0])
        vector[0] = 1.0
        vector[1 : 1 + p] = -change
        vector[1 + p + columns] = -multiples
        prior = 0.5 * share * float((terms.precision * (terms.values + change) ** 2).sum())
        return 0.5 * float(vector @ inside @ vector) + prior

    answered = base - reduced.nuisance[:, 1 + columns] @ theta
    return cost(base, np.zeros(len(theta))) - cost(answered, theta)
