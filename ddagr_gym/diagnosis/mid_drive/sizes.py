"""The size of an effect window by window: gradient and information with all that is shared projected out.

With the residual r_w of a window without the effect, the change c_w that the effect as fitted makes there and the
sensitivities B_w to what all windows share (nuisances, other effects, the effect's own shapes), all without what the
window's own unknowns explain, sizes a_w over the fitted one and shared parameters p minimise

    sum_w 1/2 |r_w - B_w p - a_w c_w|^2 + 1/2 |(p + v)/s|^2,                                                        (1)

v being where the parameters stand from what is expected. Without p this is 1/2 a' M a - a' g with

    M = diag(c_w' c_w) - X H^-1 X',   g_w = c_w' r_w - X_w H^-1 h,   X_w = c_w' B_w,                                (2)
    H = sum_w B_w' B_w + s^-2,        h = sum_w B_w' r_w - s^-2 v.

M^-1 is the covariance of the sizes: what a shared parameter could say as well leaves them uncertain together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.effect_parameters import effect_parameters
from ddagr_gym.identification.gauss_newton import Fitted, linearised
from ddagr_gym.identification.least_squares import explained_by
from ddagr_gym.identification.misfit import projected_residual
from ddagr_gym.identification.problem import Problem
from ddagr_gym.physics.effects import Effect

Array = NDArray[np.float64]

LEAST_INFORMATION = 0.05
"""Information of a window over the mean of all, below which the effect does not act there (ours)."""

_KNOWN = 1e-3
"""Share of the information of a direction that shared parameters leave, below which nothing is known of it (ours)."""

_RIDGE = 1e-9
"""Relative, for shared parameters without a prior that say the same."""


@dataclass(frozen=True, eq=False)
class WindowSizes:
    """Sizes of an effect in W windows, equation (2); windows in which it does not act are left out.

    Attributes:
        recording: (W,) of each window.
        start: (W,) [s].
        end: (W,) [s].
        gradient: (W,) of the sizes.
        information: (W, W) of the sizes.
    """

    recording: NDArray[np.int64]
    start: Array
    end: Array
    gradient: Array
    information: Array

    @property
    def count(self) -> int:
        """W."""
        return len(self.start)


def window_sizes(problem: Problem, fitted: Fitted, number: int) -> WindowSizes:
    """Sizes of one effect of a fit by window; a few simulations.

    Args:
        problem: what was fitted.
        fitted: with the effect.
        number: of the effect among those of the fit.
    """
    effects = fitted.point.effects
    others = (*effects[:number], *effects[number + 1 :])
    without = problem.predict(replace(fitted.point, effects=others))
    whole = _always(effects[number])
    everywhere = problem.during({name: spell for name, spell in problem.spells.items() if name != whole.name})
    unchanged = whole is effects[number] and whole.name not in problem.spells
    full = fitted.prediction if unchanged else _with(everywhere, fitted, number, whole)
    change = problem.blocked.change
    columns = np.stack([change(fitted.prediction, without), change(full, without)], axis=2)
    columns = fitted.elimination.project(problem.padded(columns))
    shared, precision, value = _shared(problem, fitted, number)
    residual = projected_residual(problem, fitted) + columns[..., 0]
    windows = problem.blocked.windows
    return sizes_of(
        residual, columns[..., 1], shared, precision, value, windows.recording, windows.time, windows.duration
    )


def sizes_of(
    residual: Array,
    column: Array,
    shared: Array,
    precision: Array,
    value: Array,
    recording: NDArray[np.int64],
    time: Array,
    duration: float,
) -> WindowSizes:
    """Equation (2).

    Args:
        residual: (W, R) r_w.
        column: (W, R) c_w.
        shared: (W, R, P) B_w.
        precision: (P,) s^-2.
        value: (P,) v.
        recording: (W,) of each window.
        time: (W,) at which it starts [s].
        duration: of a window [s].
    """
    own = np.einsum("wr,wr->w", column, column)
    acts = own > LEAST_INFORMATION * float(own.mean())
    inner = np.einsum("wrp,wrq->pq", shared, shared, optimize=True)
    gradient = np.einsum("wrp,wr->p", shared, residual) - precision * value
    cross = np.einsum("wr,wrp->wp", column, shared)[acts]
    answer = explained_by(inner, precision, np.concatenate([gradient[:, None], cross.T], axis=1), _RIDGE)
    free = np.einsum("wr,wr->w", column, residual)[acts] - cross @ answer[:, 0]
    information = np.diag(own[acts]) - cross @ answer[:, 1:]
    return WindowSizes(
        recording[acts], time[acts], time[acts] + duration, *_what_is_known(free, information, own[acts])
    )


def _what_is_known(gradient: Array, information: Array, own: Array) -> tuple[Array, Array]:
    """Gradient and information without the directions that shared parameters explain altogether."""
    scale = np.sqrt(own)
    values, vectors = np.linalg.eigh(0.5 * (information + information.T) / np.outer(scale, scale))
    known = values > _KNOWN
    kept = vectors[:, known]
    projected = scale * (kept @ (kept.T @ (gradient / scale)))
    return projected, np.outer(scale, scale) * ((kept * values[known]) @ kept.T)


def _always(effect: Effect) -> Effect:
    """The effect from the beginning on, whatever onset of its own it has."""
    if "onset" not in effect.shape_names():
        return effect
    return effect.with_values(onset=float(effect.parameter("onset").metadata["low"]))


def _with(problem: Problem, fitted: Fitted, number: int, effect: Effect) -> Array:
    effects = fitted.point.effects
    return problem.predict(replace(fitted.point, effects=(*effects[:number], effect, *effects[number + 1 :])))


def _shared(problem: Problem, fitted: Fitted, number: int) -> tuple[Array, Array, Array]:
    """Sensitivities (W, R, P) to all that windows share but the effect's own sizes, prior precisions, and values."""
    linear = linearised(problem, fitted)
    effect = fitted.point.effects[number]
    own = {*effect.size_names(), "onset"}
    parameters = effect_parameters(fitted.point.effects)
    others = [item.effect != number or item.field not in own for item in parameters]
    kept = np.array([*([True] * int(problem.free.sum())), *others])
    value = np.where(np.isfinite(linear.deviation), linear.here - linear.expected, 0.0)
    return linear.sensitivity[..., kept], linear.precision[kept], value[kept]
