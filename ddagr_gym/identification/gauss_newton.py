"""Joint fit of nuisance parameters, initial states and the parameters of assumed effects by Gauss-Newton."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.problem import Elimination, Point, Problem
from ddagr_gym.identification.size_prior import size_penalty, size_scale
from ddagr_gym.identification.window_fit import STATE_PRIOR
from ddagr_gym.physics.effects import Effect

Array = NDArray[np.float64]

DAMPING = (1.0, 0.5, 0.25, 0.1, 0.03)
"""Shares of a step that are tried until the cost falls."""

_LONGEST = 3.0  # standard deviations that a parameter moves in one step: beyond, the sensitivities are of no use
_KEPT = frozenset(
    {
        ("payload", "x"), ("payload", "y"), ("payload", "height"), ("lateral_bulldozing", "density"),
        ("soil_patch", "edge"), ("towed_drag", "hitch_distance"), ("encoder_scale", "loop"),
    }
)  # fmt: skip
"""Shapes that a diagnosis leaves at their defaults: free, they let one effect stand for another (a payload that is not
at the centre is a centre of mass offset too), and drives hardly show them."""

_EFFECT_RENEWALS = 5  # effects are less linear than nuisances, and fewer
_STATES = len(STATE_PRIOR)
_NEVER = 1e5  # an onset at which an effect holds always, or never


@dataclass(frozen=True)
class EffectParameter:
    """One moving field of an assumed effect.

    Attributes:
        effect: its place among the assumed effects.
        field: name of the field.
        step: for finite differences, in its unit.
        low: bound.
        high: bound.
        neutral: value without effect; of a shape its default, which costs nothing.
        scale: standard deviation about neutral before any data, infinite for a shape.
    """

    effect: int
    field: str
    step: float
    low: float
    high: float
    neutral: float
    scale: float


@dataclass(frozen=True, eq=False)
class Fitted:
    """A fitted model.

    Attributes:
        point: where it stands.
        prediction: (W, T, 8).
        cost: half the sum of squares of weighted residuals and priors, the windows' unknowns eliminated.
        elimination: of the windows' unknowns at the last derivatives.
        by_parameter: (W, M, P) weighted nuisance sensitivities there.
        iterations: steps taken.
        converged: whether the last step lowered the cost by less than the tolerance.
        window_cost: (W,) share of each window in the cost, without the parameters' priors.
    """

    point: Point
    prediction: Array
    cost: float
    elimination: Elimination
    by_parameter: Array
    iterations: int
    converged: bool
    window_cost: Array


def effect_parameters(effects: Sequence[Effect], fixed: frozenset[str] = frozenset()) -> tuple[EffectParameter, ...]:
    """Fields of effects that a fit moves: all with a step, but none of a categorical effect and no flags.

    Args:
        effects: assumed.
        fixed: names of fields to leave alone.
    """
    found = []
    for number, effect in enumerate(effects):
        if effect.categorical or effect.name == "sensor_hold":
            continue
        for name in (*effect.size_names(), *effect.shape_names()):
            data = effect.parameter(name).metadata
            at_neutral = not effect.differentiable and getattr(effect, name) == data["neutral"]
            if (effect.name, name) in _KEPT:
                continue
            if data["step"] == 0.0 or name in fixed or abs(getattr(effect, name)) > _NEVER or at_neutral:
                continue
            of_size = data["neutral"] is not None and effect.differentiable
            scale = size_scale(effect, name) if of_size else np.inf
            neutral = data["neutral"] if of_size else 0.0
            found.append(EffectParameter(number, name, data["step"], data["low"], data["high"], neutral, scale))
    return tuple(found)


def moved(effects: tuple[Effect, ...], parameters: Sequence[EffectParameter], values: Array) -> tuple[Effect, ...]:
    """Effects with parameters at values, clipped to their bounds."""
    changed = list(effects)
    for parameter, value in zip(parameters, values, strict=True):
        inside = float(min(max(value, parameter.low), parameter.high))
        changed[parameter.effect] = changed[parameter.effect].with_values(**{parameter.field: inside})
    return tuple(changed)


def read(effects: Sequence[Effect], parameters: Sequence[EffectParameter]) -> Array:
    """Values of parameters of effects."""
    return np.array([getattr(effects[p.effect], p.field) for p in parameters], dtype=np.float64)


def effect_columns(problem: Problem, point: Point, base: Array, parameters: Sequence[EffectParameter]) -> Array:
    """Weighted sensitivity to effect parameters, (W, M, E)."""
    columns = np.empty((*problem.blocked.mask.shape, len(parameters)))
    values = read(point.effects, parameters)
    for k, parameter in enumerate(parameters):
        step = parameter.step if parameter.low <= values[k] + parameter.step <= parameter.high else -parameter.step
        tried = values.copy()
        tried[k] += step
        changed = problem.predict(replace(point, effects=moved(point.effects, parameters, tried)))
        columns[..., k] = problem.blocked.change(changed, base) / step
    return columns


def cost_of(problem: Problem, point: Point, prediction: Array, elimination: Elimination) -> tuple[float, Array]:
    """Cost with the windows' unknowns eliminated, and the windows' shares (W,); infinite where predictions fail.

    Theory: identification, eq. (6).
    """
    residual = elimination.project(problem.residual(point, prediction)[..., None])[..., 0]
    shares = 0.5 * (residual**2).sum(axis=1)
    # residuals leave out what is not there: a window that cannot be predicted would cost nothing
    shares[~np.isfinite(prediction).all(axis=(1, 2))] = np.inf
    total = float(shares.sum()) + _prior_cost(problem, point)
    return (total if np.isfinite(total) else np.inf), shares


def _prior_cost(problem: Problem, point: Point) -> float:
    free = problem.free
    return 0.5 * float(((point.values[free] / problem.prior[free]) ** 2).sum()) + size_penalty(point.effects)


def fit(
    problem: Problem,
    start: Point | None = None,
    *,
    iterations: int = 10,
    tolerance: float = 2e-4,
    renewals: int = 2,
    reuse: Fitted | None = None,
    first: Fitted | None = None,
    fixed: frozenset[str] = frozenset(),
) -> Fitted:
    """Fit from ``start`` (the nominal model by default).

    Args:
        problem: what to fit.
        start: first point with its effects.
        iterations: most steps; 0 only computes the sensitivities at the start.
        tolerance: relative gain of a step that ends the fit.
        renewals: how often the nuisances' sensitivities are computed before they are kept; those of the result are new,
            or from a step before where that step was too small to matter.
        reuse: fit whose nuisance sensitivities are kept throughout, so that only those of the effects are simulated.
        first: fit at ``start`` whose nuisance sensitivities serve for the first step only.
        fixed: names of effect parameters to leave alone.
    """
    point = problem.start() if start is None else start
    parameters = effect_parameters(point.effects, fixed)
    known = reuse or first
    prediction = known.prediction if known is not None and known.point is point else problem.predict(point)
    if not np.isfinite(prediction).all():
        point = replace(point, states=problem.starts(point.values))
        prediction = problem.predict(point)
    if known:
        by_parameter = problem.heading_columns(point, prediction, known.by_parameter)
        elimination = known.elimination
    else:
        by_parameter, elimination = _sensitivities(problem, point, prediction)
    by_effect = effect_columns(problem, point, prediction, parameters)
    cost, _ = cost_of(problem, point, prediction, elimination)
    converged, done, fresh = False, 0, known is None
    while done < iterations and not converged:
        done += 1
        before = cost
        point, prediction, cost = _step(
            problem, point, prediction, cost, elimination, by_parameter, by_effect, parameters, tolerance * cost
        )
        small = before - cost < tolerance * cost
        # a step that fails with sensitivities of another point says nothing about this one
        converged = small and (fresh or reuse is not None)
        fresh = False
        if reuse is None and not converged and (done < renewals or small):
            by_parameter, elimination = _sensitivities(problem, point, prediction)
            cost, _ = cost_of(problem, point, prediction, elimination)
            fresh = True
        if parameters and done < max(renewals, _EFFECT_RENEWALS) and not converged:
            if done < iterations:
                by_effect = effect_columns(problem, point, prediction, parameters)
            if not fresh:
                by_parameter = problem.heading_columns(point, prediction, by_parameter)
    if reuse is None and done and not converged and not fresh:
        by_parameter, elimination = _sensitivities(problem, point, prediction)
    cost, shares = cost_of(problem, point, prediction, elimination)
    return Fitted(point, prediction, cost, elimination, by_parameter, done, converged, shares)


def _sensitivities(problem: Problem, point: Point, prediction: Array) -> tuple[Array, Elimination]:
    by_parameter = problem.parameter_columns(point, prediction)
    return by_parameter, problem.eliminate(point, prediction, by_parameter)


def _step(
    problem: Problem,
    point: Point,
    prediction: Array,
    cost: float,
    elimination: Elimination,
    by_parameter: Array,
    by_effect: Array,
    parameters: Sequence[EffectParameter],
    least: float,
) -> tuple[Point, Array, float]:
    """One damped Gauss-Newton step; the point itself where none lowers the cost.

    Shares of it that promise less than ``least`` are not tried.
    """
    free = np.flatnonzero(problem.free)
    sensitivities = np.concatenate([by_parameter[..., free], by_effect], axis=2)
    raw = np.concatenate([problem.residual(point, prediction)[..., None], problem.padded(sensitivities)], axis=2)
    columns = elimination.project(raw)
    right, left = columns[..., 0], columns[..., 1:]
    precision = np.concatenate([1.0 / problem.prior[free] ** 2, [p.scale**-2 for p in parameters]])
    middle = np.concatenate([np.zeros(len(free)), [p.neutral for p in parameters]])
    here = np.concatenate([point.values[free], read(point.effects, parameters)])
    low = np.concatenate([problem.low[free], [p.low for p in parameters]])
    high = np.concatenate([problem.high[free], [p.high for p in parameters]])
    information = np.einsum("wmp,wmq->pq", left, left, optimize=True) + np.diag(precision)
    gradient = np.einsum("wmp,wm->p", left, right) - precision * (here - middle)
    reach = _LONGEST * np.concatenate([problem.prior[free], [p.scale for p in parameters]])
    change = bounded_step(information, gradient, np.maximum(low - here, -reach), np.minimum(high - here, reach))
    explained = elimination.explain(raw)
    states = explained[:, :_STATES, 0] - explained[:, :_STATES, 1:] @ change
    shares = 0.5 * (right**2).sum(axis=1)
    for damping in DAMPING:
        if damping < 1.0 and damping * float(gradient @ change) < least:
            break
        values = point.values.copy()
        values[free] += damping * change[: len(free)]
        effects = moved(point.effects, parameters, here[len(free) :] + damping * change[len(free) :])
        start = problem.moved(replace(point, effects=effects), values)
        stepped = replace(start, states=start.states + damping * states)
        tried, predicted, after = _best_by_window(problem, stepped, start, elimination, shares)
        if after < cost:
            return tried, predicted, after
    return point, prediction, cost


def _best_by_window(
    problem: Problem, trial: Point, other: Point, elimination: Elimination, before: Array
) -> tuple[Point, Array, float]:
    """A trial with the initial states of another one in the windows that it would make worse, where those are better.

    Windows share nothing but the parameters; one near rest whose linear step fails must not stop all others.

    Args:
        problem: what to fit.
        trial: with the linear step of the states.
        other: the same with other states.
        elimination: of the windows' unknowns.
        before: (W,) costs of the windows before the step.
    """
    prediction = problem.predict(trial)
    costs = cost_of(problem, trial, prediction, elimination)[1]
    states = trial.states.copy()
    doubtful = np.flatnonzero(~(costs <= before))
    if doubtful.size:
        part = problem.subset(doubtful)
        again = replace(other, states=other.states[doubtful])
        predicted = part.predict(again)
        others = cost_of(part, again, predicted, elimination.subset(doubtful))[1]
        better = np.nan_to_num(others, nan=np.inf) < np.nan_to_num(costs[doubtful], nan=np.inf)
        rows = doubtful[better]
        states[rows], prediction[rows], costs[rows] = again.states[better], predicted[better], others[better]
    total = float(costs.sum()) + _prior_cost(problem, trial)
    return replace(trial, states=states), prediction, total if np.isfinite(total) else np.inf


def bounded_step(information: Array, gradient: Array, low: Array, high: Array) -> Array:
    """Newton step inside bounds: the minimum of the quadratic model there (bounded-variable least squares).

    Theory: identification, eq. (8).

    Args:
        information: (P, P), positive definite or nearly so.
        gradient: (P,) downhill.
        low: (P,) at most 0.
        high: (P,) at least 0.
    """
    from scipy.optimize import lsq_linear

    scale = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-30))
    scaled = information * np.outer(scale, scale) + 1e-9 * np.eye(len(scale))
    lower = np.linalg.cholesky(scaled)
    right = np.linalg.solve(lower, gradient * scale)
    # a fixed parameter would be an empty interval
    bounds = (np.minimum(low, 0.0) / scale - 1e-12, np.maximum(high, 0.0) / scale + 1e-12)
    found = lsq_linear(lower.T, right, bounds=bounds, method="bvls")
    return np.asarray(found.x * scale)
