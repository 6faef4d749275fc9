"""Is the bound reached? The most probable unknowns of a turn, from all its readings (maximum a posteriori)."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from benchmarks.velocity_bound.information import accumulated_information
from benchmarks.velocity_bound.turn_model import TurnModel

Array = NDArray[np.float64]

_LINEARISATIONS = 2  # the first at the truth
_STEPS = 12  # with the derivatives of one of them: dear are these, cheap is a step
_SETTLED = 0.1  # of the posterior's log from step to step: far below what noise makes of it
_SHARES = np.array([1.0, 0.5, 0.25, 0.1])  # of a Gauss-Newton step that are tried


class Smoothed(NamedTuple):
    """Most probable unknowns.

    Attributes:
        unknowns: (P,) standardised.
        motion: (T, 6) to which they lead.
        cost: negative log of the posterior, less a constant, at the start and after each step.
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
    for linearisation in range(_LINEARISATIONS):
        slopes = derivatives if linearisation == 0 else model.derivatives(now)[1]
        solve = _gauss_newton(slopes[..., free] / deviations[:, None])
        for _ in range(_STEPS):
            step = np.zeros(len(now))
            step[free] = solve((readings - modelled) / deviations, now[free])
            tried = now + _SHARES[:, None] * step
            motions, candidates = model.simulate(tried)
            values = cost(candidates, tried)
            best = int(np.argmin(values))
            gained = history[-1] - float(values[best])
            if gained > 0.0:
                now, modelled, motion = tried[best], candidates[best], motions[best]
                history.append(float(values[best]))
            if gained < _SETTLED:
                break
    return Smoothed(now, motion, np.array(history))


def _gauss_newton(slopes: Array) -> Callable[[Array, Array], Array]:
    """(standardised residuals (T, C), unknowns (P,)) -> step (P,), by standardised derivatives (T, C, P)."""
    factor = cho_factor(accumulated_information(slopes, np.ones(slopes.shape[1]), len(slopes))[-1])

    def step(residuals: Array, now: Array) -> Array:
        return np.asarray(cho_solve(factor, np.einsum("tcp,tc->p", slopes, residuals) - now))

    return step
