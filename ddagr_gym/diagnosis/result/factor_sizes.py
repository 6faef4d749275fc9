"""Sizes of soils as factors: a linearised fit in their logarithms, held against the fit's own cost.

Strength and stiffness of a soil do nearly the same. Over the short steps of a fit the simulator's adaptive integration
leaves noise in both derivatives; two columns that are nearly parallel then differ mostly by it, and that passes for
knowledge. Derivatives over :data:`SPAN` to both sides, by the logarithm of a factor, are ten times as long as that
noise.

Along the direction d in which two logarithms are known worst, everything else answering as the linear model says, the
fit's own cost J is taken at -T, 0 and T standard deviations. The parabola through the three,

    J(t) = J(0) + b t + 1/2 k t^2,                                                                                  (1)

says where the middle of the posterior is, t = -b/k, and how wide it is, 1/sqrt(k) times what the linear model says.
Another simulator's soil law makes other forces of the same sizes; what that bends shows most where the sizes are known
worst, so that :data:`FORM` is added along d.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.effect_parameters import EffectParameter, moved
from ddagr_gym.identification.gauss_newton import Fitted, cost_of
from ddagr_gym.identification.least_squares import Linearised
from ddagr_gym.identification.problem import Problem
from ddagr_gym.physics.effects import Effect

Array = NDArray[np.float64]

SPAN = 0.15
"""Step of a difference by the logarithm of a factor, to both sides (ours: steps of 0.1 to 0.2 give the same deviations
within 5 %, those of the fit half of them)."""

REACH = 2.0
"""T, standard deviations at which the cost is taken (ours): a rise by 2, well above the noise of a cost of 0.3."""

WIDEST = 3.0
"""Most by which a posterior is wider than the linear model says (ours)."""

NARROWEST = 1.0
"""Least of it (ours): noise of the cost must not make anything surer than resampling says."""

FORM = 0.55
"""Standard deviation, along the direction, of the logarithms that other soil laws show (chosen on 34 drives of the
project's own blind generator, on which intervals held 49 of 68 sizes before)."""

SHORTEST = 0.5
"""Standard deviations up to a bound below which the cost is not asked (ours)."""

_STILL = 1e-9
"""Change of a logarithm that is none."""


@dataclass(frozen=True, eq=False)
class Valley:
    """Posterior along the direction in which sizes of a soil are known worst, beside the linear model.

    Attributes:
        direction: (P,) of all parameters for one standard deviation along it.
        middle: -b/k, in these deviations from the fit.
        width: 1/sqrt(k).
        form: FORM, in these deviations.
    """

    direction: Array
    middle: float
    width: float
    form: float


def factors(effects: Sequence[Effect], parameters: Sequence[EffectParameter]) -> NDArray[np.bool_]:
    """(E,) which parameters of effects are sizes of a soil."""
    found = [bool(effects[p.effect].soils) and p.field in effects[p.effect].size_names() for p in parameters]
    return np.array(found, dtype=np.bool_)


def log_scale(least: float) -> float:
    """Distance from 1 of a factor, as a logarithm."""
    return math.log1p(least)


def in_logarithms(
    problem: Problem, fitted: Fitted, linear: Linearised, parameters: Sequence[EffectParameter]
) -> Linearised:
    """The linearised problem in the logarithms of the sizes of soils, with derivatives over wide steps.

    Args:
        problem: what was fitted.
        fitted: with effects.
        linear: at the fit: free nuisances, then the parameters.
        parameters: of the effects.
    """
    first = len(linear.here) - len(parameters)
    parts = {name: np.array(getattr(linear, name)) for name in ("here", "expected", "deviation", "low", "high")}
    sensitivity = np.array(linear.sensitivity)
    for k in np.flatnonzero(factors(fitted.point.effects, parameters)).tolist():
        item, place = parameters[k], first + k
        value = float(parts["here"][place])
        sensitivity[..., place] = _column(problem, fitted, item, value)
        found = (value, item.neutral, 1.0 + item.scale, item.low, item.high)
        for name, number in zip(parts, found, strict=True):
            parts[name][place] = math.log(number)
    return replace(linear, sensitivity=sensitivity, **parts)


def _column(problem: Problem, fitted: Fitted, parameter: EffectParameter, value: float) -> Array:
    """(W, R) projected sensitivity to the logarithm of a factor."""
    ends = [min(max(value * math.exp(step), parameter.low), parameter.high) for step in (-SPAN, SPAN)]
    point = fitted.point
    below, above = (
        problem.predict(replace(point, effects=moved(point.effects, [parameter], np.array([end])))) for end in ends
    )
    column = problem.blocked.change(above, below) / math.log(ends[1] / ends[0])
    return np.asarray(fitted.elimination.project(problem.padded(column[..., None]))[..., 0])


def factors_of(values: Array, chosen: NDArray[np.bool_]) -> Array:
    """Effect parameters (..., E) with the chosen ones as factors instead of logarithms."""
    return np.where(chosen, np.exp(np.where(chosen, values, 0.0)), values)


def valleys(
    problem: Problem, fitted: Fitted, linear: Linearised, parameters: Sequence[EffectParameter]
) -> tuple[Valley, ...]:
    """One for each effect with several sizes of a soil, equation (1); two simulations each.

    Args:
        problem: what was fitted.
        fitted: with effects.
        linear: of :func:`in_logarithms`.
        parameters: of the effects.
    """
    first = len(linear.here) - len(parameters)
    chosen = factors(fitted.point.effects, parameters)
    # a shape without a prior that nothing shows has no covariance: it stays where it is
    covariance: Array = np.asarray(np.linalg.pinv(linear.information, hermitian=True), dtype=np.float64)
    found = []
    for number in range(len(fitted.point.effects)):
        places = [first + k for k, p in enumerate(parameters) if p.effect == number and chosen[k]]
        if len(places) > 1:
            direction = _worst(covariance, places)
            middle, width = _parabola(problem, fitted, linear, parameters, direction)
            found.append(Valley(direction, middle, width, FORM / float(np.linalg.norm(direction[places]))))
    return tuple(found)


def _worst(covariance: Array, places: Sequence[int]) -> Array:
    """(P,) change of all parameters for one standard deviation along the worst known direction of some."""
    values, vectors = np.linalg.eigh(covariance[np.ix_(places, places)])
    return np.asarray(covariance[:, places] @ vectors[:, -1] / math.sqrt(float(values[-1])))


def _parabola(
    problem: Problem, fitted: Fitted, linear: Linearised, parameters: Sequence[EffectParameter], direction: Array
) -> tuple[float, float]:
    """Middle and width of the posterior along a direction, equation (1); those of the linear model next to a bound."""
    sizes = len(linear.here) - len(parameters) + np.flatnonzero(factors(fitted.point.effects, parameters))
    room = np.minimum(linear.high - linear.here, linear.here - linear.low)[sizes]
    reach = min(REACH, float(np.min(room / np.maximum(np.abs(direction[sizes]), _STILL))))
    if reach < SHORTEST:
        return 0.0, NARROWEST
    here = _cost(problem, fitted, linear, parameters, linear.here, fitted.cost)
    below, above = (
        _cost(problem, fitted, linear, parameters, linear.after(step * direction)) - here for step in (-reach, reach)
    )
    if not (math.isfinite(below) and math.isfinite(above)):
        return 0.0, WIDEST
    slope, curvature = 0.5 * (above - below) / reach, (above + below) / reach**2
    width = 1.0 / math.sqrt(max(curvature, WIDEST**-2))
    return float(np.clip(-slope * width**2, -reach, reach)), max(width, NARROWEST)


def _cost(
    problem: Problem,
    fitted: Fitted,
    linear: Linearised,
    parameters: Sequence[EffectParameter],
    values: Array,
    known: float | None = None,
) -> float:
    """Cost of a model at values (P,), with the prior of the logarithms where these stand for factors.

    Args:
        problem: what was fitted.
        fitted: with effects.
        linear: with the priors of the logarithms.
        parameters: of the effects.
        values: of free nuisances and effect parameters.
        known: cost without a change of priors; simulated by default.
    """
    point, free = fitted.point, np.flatnonzero(problem.free)
    chosen = factors(point.effects, parameters)
    effects = moved(point.effects, parameters, factors_of(values[len(free) :], chosen))
    if known is None:
        nuisances = point.values.copy()
        nuisances[free] = values[: len(free)]
        tried = problem.moved(replace(point, effects=effects), nuisances)
        known = cost_of(problem, tried, problem.predict(tried), fitted.elimination)[0]
    own = np.flatnonzero(chosen).tolist()
    places = [len(free) + k for k in own]
    by_logarithm = ((values[places] - linear.expected[places]) / linear.deviation[places]) ** 2
    by_factor = [((math.exp(values[len(free) + k]) - parameters[k].neutral) / parameters[k].scale) ** 2 for k in own]
    return known + 0.5 * float(by_logarithm.sum() - sum(by_factor))
