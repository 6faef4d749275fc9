"""Where effects act: how much of what one does lies in the windows and channels in which others act already."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.search.candidates import Candidate
from ddagr_gym.identification.gauss_newton import Fitted
from ddagr_gym.identification.problem import Problem

Array = NDArray[np.float64]


def overlaps(problem: Problem, fitted: Fitted, candidates: Sequence[Candidate], columns: Array) -> dict[str, float]:
    """Largest overlap of any probe of each effect with what the effects of the model do together.

    Args:
        problem: what was fitted.
        fitted: the model.
        candidates: what the columns are of.
        columns: (W, M + S, K) of the probes, the windows' unknowns eliminated.
    """
    if not fitted.point.effects:
        return {}
    without = problem.predict(replace(fitted.point, effects=()))
    acting = problem.padded(problem.blocked.change(fitted.prediction, without)[..., None])
    shape = problem.blocked.sigma.shape
    where = _energy(fitted.elimination.project(acting), shape)
    shares = np.minimum(_energy(columns, shape), where).sum(axis=(0, 1))
    found: dict[str, float] = {}
    for candidate in candidates:
        found[candidate.name] = max(found.get(candidate.name, 0.0), *(float(shares[k]) for k in candidate.columns))
    return found


def _energy(columns: Array, shape: tuple[int, ...]) -> Array:
    """(W, C, K) share of each column's sum of squares by window and channel, of (W, M + S, K)."""
    count, blocks, channels = shape
    squares = columns[:, : blocks * channels] ** 2
    cells = squares.reshape(count, blocks, channels, -1).sum(axis=1)
    return np.asarray(cells / np.maximum(cells.sum(axis=(0, 1)), 1e-30))
