"""The Gauss-Newton iteration: joint fit of nuisance parameters, initial states and the parameters of assumed effects.

Each step solves the linearised problem of :mod:`ddagr_gym.identification.least_squares`, moves parameters and initial
states, and is shortened until the cost falls. Where windows have variations besides their states, which no step moves,
the cost is that with every local unknown at its best (variable projection; G. H. Golub and V. Pereyra, SIAM J. Numer.
Anal. 10 (1973) 413), to first order about the last derivatives; otherwise it is that of the states as they stand.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.effect_parameters import EffectParameter, effect_columns, effect_parameters, moved, read
from ddagr_gym.identification.least_squares import Elimination, Linearised, beside_residual
from ddagr_gym.identification.problem import STATE_PRIOR, Point, Problem
from ddagr_gym.identification.size_prior import size_penalty
from ddagr_gym.identification.window_model import Reference

Array = NDArray[np.float64]

DAMPING = (1.0, 0.5, 0.25, 0.1, 0.03)
"""Shares of a step that are tried until the cost falls (ours): below a thirtieth the derivatives are wrong, not the
length."""

_LONGEST = 3.0
"""Prior standard deviations that a parameter moves in one step (ours): beyond, the derivatives are of no use."""

_SPOILT = 1.2
"""Factor on a window's cost from which the linear step of its state has failed (ours)."""

_EFFECT_RENEWALS = 5
"""Steps in which derivatives to effects are computed anew (ours): they are less linear than nuisances, and fewer."""

_STATES = len(STATE_PRIOR)


@dataclass(frozen=True, eq=False)
class Fitted:
    """A fitted model.

    Attributes:
        point: where it stands.
        prediction: (W, T, 8).
        cost: losses of the weighted residuals and priors.
        elimination: of the local unknowns at the last derivatives.
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

    def subset(self, chosen: NDArray[np.int64] | NDArray[np.bool_]) -> Fitted:
        """The same in some of its windows, with its sensitivities there; the cost remains that of all."""
        return replace(
            self,
            point=replace(self.point, states=self.point.states[chosen]),
            prediction=self.prediction[chosen],
            elimination=self.elimination.subset(chosen),
            by_parameter=self.by_parameter[chosen],
            window_cost=self.window_cost[chosen],
        )


def cost_of(problem: Problem, point: Point, prediction: Array, elimination: Elimination) -> tuple[float, Array]:
    """Cost, and the windows' shares of it (W,); infinite where predictions fail.

    Theory: identification, eq. (6).
    """
    shares = _losses(problem, _counted(problem, elimination, problem.residual(point, prediction)), prediction)
    total = float(shares.sum()) + _prior_cost(problem, point)
    return (total if np.isfinite(total) else np.inf), shares


def _counted(problem: Problem, elimination: Elimination, residual: Array) -> Array:
    """Residuals (W, R) as they enter the cost: what steps never move, the variations of a window, is eliminated."""
    return elimination.remaining(residual) if problem.nuisances.local else residual


def _losses(problem: Problem, residual: Array, prediction: Array) -> Array:
    """(W,) losses of residuals; infinite where the prediction failed.

    Residuals leave out what is not there: a window that cannot be predicted would cost nothing.
    """
    return np.where(np.isfinite(prediction).all(axis=(1, 2)), problem.losses(residual), np.inf)


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
    repeats: int = 0,
    renewed: bool = True,
    reuse: Fitted | None = None,
    first: Fitted | None = None,
    fixed: frozenset[str] = frozenset(),
    progress: Callable[[], None] = lambda: None,
    give_up: Callable[[float, float], bool] = lambda before, after: False,
) -> Fitted:
    """Fit from ``start`` (the nominal model by default).

    Args:
        problem: what to fit.
        start: first point with its effects.
        iterations: most steps; 0 only computes the sensitivities at the start.
        tolerance: relative gain of a step that ends the fit.
        renewals: how often the nuisances' sensitivities are computed before they are kept; those of the result are new,
            or from a step before where that step was too small to matter.
        repeats: further whole steps with the sensitivities of each step, as long as one gains more than the tolerance
            (Shamanskii's method; C. T. Kelley, Iterative Methods for Linear and Nonlinear Equations, 1995, section
            5.4.3): one costs a prediction, new sensitivities one for every parameter.
        renewed: whether the result has sensitivities of its own, too, where the last step was not too small to matter;
            they serve what comes after, and do not move it.
        reuse: fit whose nuisance sensitivities are kept throughout, so that only those of the effects are simulated.
        first: fit at ``start`` whose nuisance sensitivities serve for the first step only.
        fixed: names of effect parameters to leave alone.
        progress: called after each step.
        give_up: called with the cost before and after each step; the fit ends where it says so.
    """
    known = reuse or first
    parameters = effect_parameters(() if start is None else start.effects, fixed)
    here = _begun(problem, problem.start() if start is None else start, parameters, known)
    converged, done, fresh, hopeless = False, 0, known is None, False
    while done < iterations and not (converged or hopeless):
        done += 1
        before = here.cost
        here = _steps(problem, here, parameters, tolerance, repeats)
        progress()
        hopeless = give_up(before, here.cost)
        small = before - here.cost < tolerance * here.cost
        # a step that fails with sensitivities of another point says nothing about this one
        converged = small and (fresh or reuse is not None)
        fresh = reuse is None and not converged and (done < renewals or small)
        anew = bool(parameters) and done < max(renewals, _EFFECT_RENEWALS) and not converged
        again = anew and done < iterations
        reference = problem.reference(here.point) if fresh or again else None
        if fresh:
            here = _renewed(problem, here, reference)
        if again:
            here = replace(here, by_effect=effect_columns(problem, here.point, parameters, reference))
        if anew and not fresh:
            here = replace(here, by_parameter=problem.heading_columns(here.point, here.by_parameter, reference))
    if renewed and reuse is None and done and not converged and not fresh:
        here = _renewed(problem, here, problem.reference(here.point))
    cost, shares = cost_of(problem, here.point, here.prediction, here.elimination)
    return Fitted(here.point, here.prediction, cost, here.elimination, here.by_parameter, done, converged, shares)


@dataclass(frozen=True, eq=False)
class _Iterate:
    """Where an iteration stands, with the derivatives of the next step, which may be of an earlier point.

    Attributes:
        point: parameters, initial states and effects.
        prediction: (W, T, 8) there.
        cost: there, with the local unknowns of the elimination.
        elimination: of the local unknowns.
        by_parameter: (W, M, P) weighted nuisance sensitivities.
        by_effect: (W, M, E) the same of the effects' parameters.
    """

    point: Point
    prediction: Array
    cost: float
    elimination: Elimination
    by_parameter: Array
    by_effect: Array


def _begun(problem: Problem, point: Point, parameters: Sequence[EffectParameter], known: Fitted | None) -> _Iterate:
    """The first point, with the nuisances' sensitivities of a known fit where there is one."""
    prediction = known.prediction if known is not None and known.point is point else problem.predict(point)
    if not np.isfinite(prediction).all():
        point = replace(point, states=problem.starts(point.values))
        prediction = problem.predict(point)
    reference = problem.reference(point) if known is None or parameters else None
    if known is not None:
        by_parameter = problem.heading_columns(point, known.by_parameter, reference)
        elimination = known.elimination
    else:
        by_parameter = problem.parameter_columns(point, prediction, reference)
        elimination = problem.eliminate(point, prediction, by_parameter, reference)
    by_effect = effect_columns(problem, point, parameters, reference)
    cost, _ = cost_of(problem, point, prediction, elimination)
    return _Iterate(point, prediction, cost, elimination, by_parameter, by_effect)


def _renewed(problem: Problem, here: _Iterate, reference: Reference | None) -> _Iterate:
    """The same point with its own sensitivities to the nuisances."""
    by_parameter = problem.parameter_columns(here.point, here.prediction, reference)
    elimination = problem.eliminate(here.point, here.prediction, by_parameter, reference)
    cost, _ = cost_of(problem, here.point, here.prediction, elimination)
    return replace(here, cost=cost, elimination=elimination, by_parameter=by_parameter)


def linearised(problem: Problem, fitted: Fitted) -> Linearised:
    """The linearised problem at a fit: its free nuisances, then the parameters of its effects."""
    parameters = effect_parameters(fitted.point.effects)
    by_effect = effect_columns(problem, fitted.point, parameters)
    here = _Iterate(fitted.point, fitted.prediction, fitted.cost, fitted.elimination, fitted.by_parameter, by_effect)
    return _linearised(problem, here, _raw_columns(problem, here), parameters)


def fit_states(problem: Problem, values: Array, iterations: int = 2) -> tuple[Array, Array]:
    """Initial states (W, 8) and prediction (W, T, 8) at fixed parameters, from the windows' first guess.

    Args:
        problem: with its windows.
        values: (P,) of the parameters.
        iterations: Gauss-Newton steps; a step that raises a window's cost is not taken in that window.
    """
    point = Point(values, problem.starts(values))
    prediction = problem.predict(point)
    cost = _losses(problem, problem.residual(point, prediction), prediction)
    for _ in range(iterations):
        reference = problem.reference(point)
        elimination = problem.eliminate(point, prediction, problem.local_columns(point, reference), reference)
        change = elimination.explain(problem.residual(point, prediction)[..., None])[:, :_STATES, 0]
        tried = replace(point, states=point.states + change)
        changed = problem.predict(tried)
        after = _losses(problem, problem.residual(tried, changed), changed)
        better = after < cost
        point = replace(point, states=np.where(better[:, None], tried.states, point.states))
        prediction = np.where(better[:, None, None], changed, prediction)
        cost = np.where(better, after, cost)
    return point.states, prediction


def _raw_columns(problem: Problem, here: _Iterate) -> Array:
    """Residual and sensitivities as columns (W, R, 1 + P)."""
    residual = problem.residual(here.point, here.prediction)
    return beside_residual(residual, here.by_parameter[..., problem.free], here.by_effect)


def _linearised(problem: Problem, here: _Iterate, raw: Array, parameters: Sequence[EffectParameter]) -> Linearised:
    """Of raw columns: residual first, then the free nuisances, then effect parameters."""
    free, point = problem.free, here.point
    columns = here.elimination.project(raw)
    return Linearised(
        columns[..., 0],
        columns[..., 1:],
        here=np.concatenate([point.values[free], read(point.effects, parameters)]),
        expected=np.concatenate([np.zeros(free.sum()), [p.neutral for p in parameters]]),
        deviation=np.concatenate([problem.prior[free], [p.scale for p in parameters]]),
        low=np.concatenate([problem.low[free], [p.low for p in parameters]]),
        high=np.concatenate([problem.high[free], [p.high for p in parameters]]),
    )


def _steps(
    problem: Problem, here: _Iterate, parameters: Sequence[EffectParameter], tolerance: float, repeats: int
) -> _Iterate:
    """A step, and whole ones with the same sensitivities for as long as they gain more than ``tolerance``."""
    for dampings in (DAMPING, *repeats * [(1.0,)]):
        before = here.cost
        here = _step(problem, here, parameters, tolerance, dampings)
        if before - here.cost < tolerance * here.cost:
            break
    return here


def _step(
    problem: Problem,
    here: _Iterate,
    parameters: Sequence[EffectParameter],
    tolerance: float,
    dampings: Sequence[float],
) -> _Iterate:
    """One of some shares of a Gauss-Newton step; the point itself where none lowers the cost.

    Those that promise a relative gain below ``tolerance`` are not tried.
    """
    point, elimination, least = here.point, here.elimination, tolerance * here.cost
    raw = _raw_columns(problem, here)
    step = _WholeStep.of(problem, here, raw, parameters)
    shares = problem.losses(_counted(problem, elimination, raw[..., 0]))
    promised = float(step.linear.gradient @ step.change)
    if not problem.nuisances.local:
        promised += elimination.explained_square(raw[..., 0])
    for damping in dampings:
        if damping < 1.0 and damping * promised < least:
            break
        stepped, start = step.share(problem, point, parameters, damping)
        tried, predicted, after = _best_by_window(problem, stepped, start, elimination, shares)
        if after < here.cost:
            return replace(here, point=tried, prediction=predicted, cost=after)
    return here


@dataclass(frozen=True, eq=False)
class _WholeStep:
    """A step of which shares are tried.

    Attributes:
        linear: the linearised problem.
        change: (P,) of its parameters.
        states: (W, 8) of the initial states.
    """

    linear: Linearised
    change: Array
    states: Array

    @classmethod
    def of(cls, problem: Problem, here: _Iterate, raw: Array, parameters: Sequence[EffectParameter]) -> _WholeStep:
        """That of raw columns."""
        linear = _linearised(problem, here, raw, parameters)
        change = linear.step(linear.information, linear.gradient, _LONGEST)
        explained = here.elimination.explain(raw)
        return cls(linear, change, explained[:, :_STATES, 0] - explained[:, :_STATES, 1:] @ change)

    def share(
        self, problem: Problem, point: Point, parameters: Sequence[EffectParameter], damping: float
    ) -> tuple[Point, Point]:
        """The point after a share of it, and the same with the initial states as they were."""
        free = np.flatnonzero(problem.free)
        after = self.linear.after(damping * self.change)
        values = point.values.copy()
        values[free] = after[: len(free)]
        start = problem.moved(replace(point, effects=moved(point.effects, parameters, after[len(free) :])), values)
        return replace(start, states=start.states + damping * self.states), start


def values_after_step(problem: Problem, known: Fitted) -> Array:
    """Nuisances (P,) after the share of one step, by known sensitivities, that lowers the cost most; or as they are.

    A window that the states of the step make worse keeps those before it, where it is better with them.

    Args:
        problem: what to fit, without effects.
        known: where it stands, fitted to this or to another problem on the same windows.
    """
    here = _begun(problem, known.point, (), known)
    step = _WholeStep.of(problem, here, _raw_columns(problem, here), ())
    before = cost_of(problem, here.point, here.prediction, here.elimination)[1]
    best = here
    for damping in DAMPING:
        stepped, start = step.share(problem, known.point, (), damping)
        tried, predicted, cost = _best_by_window(problem, stepped, start, here.elimination, before)
        if cost < best.cost:
            best = replace(here, point=tried, prediction=predicted, cost=cost)
        elif best is not here:
            break
    return best.point.values


def _best_by_window(
    problem: Problem, trial: Point, other: Point, elimination: Elimination, before: Array
) -> tuple[Point, Array, float]:
    """A trial with the initial states of another one in the windows that it would make worse, where those are better.

    Windows share nothing but the parameters; one near rest whose linear step fails must not stop all others. Where
    windows have no unknowns but their states, a little worse is what the parameters cost them.

    Args:
        problem: what to fit.
        trial: with the linear step of the states.
        other: the same with other states.
        elimination: of the local unknowns.
        before: (W,) costs of the windows before the step.
    """
    prediction = problem.predict(trial)
    costs = cost_of(problem, trial, prediction, elimination)[1]
    states = trial.states.copy()
    rise = 1.0 if problem.nuisances.local else _SPOILT
    doubtful = np.flatnonzero(~(costs <= rise * before))
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
