"""Sizes of effects in one drive, with their covariances: equation (1) of :mod:`ddagr_gym.diagnosis.change.shifts`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.change.drive_scan import scattered
from ddagr_gym.diagnosis.change.ordinary import Scores

Array = NDArray[np.float64]

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
    sizes = np.asarray(np.linalg.solve(inner + np.diag(prior), gradient), dtype=np.float64)
    scatter, windows = _of_windows(scores, rows, sizes, inverse)
    within = inverse @ scatter @ inverse.T
    expected = scores.between[np.ix_(rows, rows)]
    # what independent readings make of the gradient, without what the priors do: that is between drives
    independent = inverse @ (inner - expected) @ inverse.T
    return Sizes(inverse @ gradient, at_least(within, independent), inverse @ expected @ inverse.T, windows)


def windows_in_effect(shares: Array) -> float:
    """How many windows tell a covariance, of the (W, k, k) shares that each has in it, by their sizes in the whole."""
    sizes = np.einsum("kl,wlk->w", np.linalg.pinv(shares.sum(axis=0), hermitian=True), shares)
    return float(sizes.sum() ** 2 / (sizes**2).sum())


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


def _of_windows(scores: Scores, rows: Sequence[int], sizes: Array, inverse: Array) -> tuple[Array, float]:
    """Covariance of the gradient by the windows' scatter at some sizes, and how many windows tell it (0: only sums).

    At nothing a large size would count as scatter of the windows that show it.
    """
    if scores.gradients is None or scores.informations is None:
        return np.asarray(scores.within[np.ix_(rows, rows)]), 0.0
    informations = scores.informations[:, rows][:, :, rows]
    scatter = scattered(scores.gradients[:, rows] - informations @ sizes)
    return scatter, windows_in_effect(inverse @ informations @ inverse.T)


def at_least(scattered: Array, independent: Array) -> Array:
    """The windows' covariance, with deviations that are at least those of independent rows."""
    size = np.diag(scattered)
    wide = np.sqrt(np.maximum(np.maximum(size, np.diag(independent)), 0.0) / np.where(size > 0.0, size, 1.0))
    return np.asarray(scattered * np.outer(wide, wide) + np.diag(np.where(size > 0.0, 0.0, np.diag(independent))))
