"""Is the bound reached? The most probable unknowns of a turn, from all its readings (maximum a posteriori)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.velocity_bound.information import accumulated_information
from benchmarks.velocity_bound.turn_model import TurnModel

Array = NDArray[np.float64]

_ITERATIONS = 2
_SHARES = np.array([1.0, 0.5, 0.25, 0.1])  # of a Gauss-Newton step that are tried


class Smoothed(NamedTuple):
    """Most probable unknowns.

    Attributes:
        unknowns: (P,) standardised.
        motion: (T, 6) to which they lead.
        cost: negative log of the posterior, less a constant, at the start and after each iteration.
    """

    unknowns: Array
    motion: Array
    cost: Array


def smooth(
    model: TurnModel, known: NDArray[np.bool_], deviations: Array, derivatives: Array, readings: Array
) -> Smoothed:
    """Fit the unknowns of a turn to its readings by Gauss and Newton, from the truth on.

    Args:
        model: of the turn.
        known: (P,) unknowns that are held at their true values.
        deviations: of the readings' noise (5,).
        derivatives: of the readings at the truth (T, 5, P).
        readings: with their noise (T, 5).
    """
    free = ~known

    def cost(modelled: Array, unknowns: Array) -> Array:
        wrong = np.sum(((readings - modelled) / deviations) ** 2, axis=(1, 2))
        return np.asarray(0.5 * (wrong + np.sum(unknowns[:, free] ** 2, axis=1)))

    now = model.truth
    motion, modelled = (array[0] for array in model.simulate(now[None]))
    history = [float(cost(modelled[None], now[None])[0])]
    for iteration in range(_ITERATIONS):
        slopes = derivatives if iteration == 0 else model.derivatives(now)[1]
        step = np.zeros(len(now))
        residuals = (readings - modelled) / deviations
        step[free] = _gauss_newton(slopes[..., free] / deviations[:, None], residuals, now[free])
        tried = now + _SHARES[:, None] * step
        motions, candidates = model.simulate(tried)
        values = cost(candidates, tried)
        best = int(np.argmin(values))
        if values[best] >= history[-1]:
            break
        now, modelled, motion = tried[best], candidates[best], motions[best]
        history.append(float(values[best]))
    return Smoothed(now, motion, np.array(history))


def _gauss_newton(slopes: Array, residuals: Array, now: Array) -> Array:
    """Step (P,) by standardised derivatives (T, C, P) and residuals (T, C)."""
    information = accumulated_information(slopes, np.ones(slopes.shape[1]), len(slopes))[-1]
    return np.asarray(np.linalg.solve(information, np.einsum("tcp,tc->p", slopes, residuals) - now))
