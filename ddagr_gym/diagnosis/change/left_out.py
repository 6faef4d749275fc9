"""How well windows are forecast by fits without them: what a change is certified with."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.answer.change import ChangeCertificate
from ddagr_gym.identification.fit_numerics import FIELD_TOLERANCE
from ddagr_gym.identification.gauss_newton import Fitted, fit
from ddagr_gym.identification.problem import Point, Problem

Array = NDArray[np.float64]

PARTS = 2
"""Parts of the windows, which are forecast by the fit to the others in turn (ours): neighbours judge each other."""

ITERATIONS = 3
"""Steps of a fit to the other windows (ours): it begins at the fit to all."""

USUAL = 0.9
"""Share of the ordinary drives' windows that are forecast well enough, by definition (ours)."""


def left_out_losses(problem: Problem, fitted: Fitted) -> Array:
    """(W,) mean robust loss of a sample of each window, forecast from the readings at its start by a fit without it.

    Args:
        problem: of drives.
        fitted: to all of their windows, with or without effects.
    """
    number = np.arange(problem.blocked.windows.count)
    found = np.full(len(number), np.nan)
    for part in range(PARTS):
        out = number % PARTS == part
        found[out] = _losses_without(problem, fitted, out)
    return found


def _losses_without(problem: Problem, fitted: Fitted, out: NDArray[np.bool_]) -> Array:
    """Losses of the windows that are left out."""
    point = fitted.point
    start = Point(point.values, point.states[~out], point.effects)
    others = fit(problem.subset(~out), start, iterations=ITERATIONS, tolerance=FIELD_TOLERANCE, renewals=1).point
    judged = problem.subset(out)
    here = Point(others.values, judged.starts(others.values), others.effects)
    prediction = judged.predict(here)
    losses = judged.losses(judged.residual(here, prediction))
    samples = np.maximum((judged.blocked.mask > 0.0).sum(axis=1), 1)
    return np.where(np.isfinite(prediction).all(axis=(1, 2)), losses / samples, np.inf)


def certificate(without: Array, corrected: Array, ordinary: Array) -> ChangeCertificate | None:
    """How many windows are forecast as well as those of ordinary drives; None where nothing is known of these.

    Args:
        without: (W,) losses of the drives without what changed.
        corrected: (W,) the same with it.
        ordinary: (V,) losses of ordinary drives.
    """
    if not ordinary.size:
        return None
    limit = float(np.quantile(ordinary, USUAL))
    return ChangeCertificate(
        windows=len(corrected),
        as_well=int((corrected <= limit).sum()),
        as_well_without=int((without <= limit).sum()),
        expected=USUAL,
        ordinary_windows=len(ordinary),
        limit=limit,
        losses=_quartiles(corrected),
        losses_without=_quartiles(without),
        losses_of_ordinary=_quartiles(ordinary),
    )


def probability_of_ordinary(certificate: ChangeCertificate) -> float:
    """Of as few well forecast windows in an ordinary drive, whose windows are like those of the others.

    Of W further values those below the k-th of V are beta-binomial, with k and V + 1 - k (S. S. Wilks, Ann. Math. Stat.
    12 (1941) 91); the q-quantile is the one with k = 1 + q (V - 1), between two whole ones.

    Args:
        certificate: of the drives.
    """
    from scipy.stats import betabinom

    place = 1.0 + certificate.expected * (certificate.ordinary_windows - 1.0)
    above = certificate.ordinary_windows + 1.0 - place
    return float(betabinom.cdf(certificate.as_well, certificate.windows, place, above))


def _quartiles(losses: Array) -> tuple[float, float, float]:
    low, middle, high = (float(value) for value in np.quantile(losses, (0.25, 0.5, 0.75)))
    return low, middle, high
