"""How sure: resampled intervals of the parameters of named effects."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from ddagr_gym.diagnosis.answer.nuisance_spread import NuisanceSpread
from ddagr_gym.diagnosis.result.factor_sizes import (
    Valley,
    factors,
    factors_of,
    in_logarithms,
    log_scale,
    valleys,
)
from ddagr_gym.identification.effect_parameters import EffectParameter, effect_parameters
from ddagr_gym.identification.gauss_newton import Fitted, linearised
from ddagr_gym.identification.least_squares import Linearised, bounded_step
from ddagr_gym.identification.problem import Problem
from ddagr_gym.physics.effects import Effect
from ddagr_gym.recordings.checks.blocks import CONFIDENCE

Array = NDArray[np.float64]

LEVEL = 0.9
"""Of the intervals."""

DRAWS = 400
"""Resamplings of the windows (ours): the ends of a 90 % interval scatter by a sixteenth of its half width."""

STRUCTURE = 0.2
"""Half the width, in least meaningful sizes, that an interval has however many windows there are: another simulator's
form of the same effect differs by so much (on the project's own blind drives 15 of 25 intervals of resampling alone
held the truth, and most misses were within a tenth of the least meaningful size)."""

FORM = 0.1
"""The same as a share of the effect's size, in quadrature: a larger effect differs by more (on two sets of drives of
the project's own blind generator 34 of 45 intervals held the truth without it, 39 with it)."""

STRUCTURE_OF_LIMIT = 0.02
"""The same of a limit, as a share of it: one that a robot does not reach is no least size (one per cent there)."""

STRUCTURE_OF_LOAD = 0.5
"""The same of a limit of torque or power (ours): nothing measures a torque, only the speed at which the ground resists
with as much, and another soil law resists a turn with other torques (found over true power in five development cases:
1.2 to 1.7, benchmarks/motor_limits.py)."""


@dataclass(frozen=True, eq=False)
class Resampled:
    """Parameters of a fit from DRAWS resamplings of the windows.

    Attributes:
        parameters: (E,) of the effects.
        nuisances: (DRAWS, F) free ones.
        effects: (DRAWS, E) values of the effects' parameters.
    """

    parameters: tuple[EffectParameter, ...]
    nuisances: Array
    effects: Array

    def of(self, number: int, field: str) -> Array:
        """(DRAWS,) of one field of an effect."""
        place = next(k for k, p in enumerate(self.parameters) if (p.effect, p.field) == (number, field))
        return np.asarray(self.effects[:, place])


def resampled_parameters(problem: Problem, fitted: Fitted, rng: np.random.Generator) -> Resampled:
    """Parameters from resamplings of the windows, by one Gauss-Newton step from the fit.

    Windows rather than samples are drawn, so that errors which are alike within a window widen the intervals. What a
    prior expects is drawn from it each time, so that sizes which the data cannot tell from something uncertain (a delay
    from the sample in which commands act, a bias from that of the recording) are as uncertain as that. Sizes of a soil
    are drawn as logarithms, along the cost's own valley (:mod:`ddagr_gym.diagnosis.result.factor_sizes`).

    Args:
        problem: what was fitted.
        fitted: with effects.
        rng: of the resampling.
    """
    parameters = effect_parameters(fitted.point.effects)
    chosen = factors(fitted.point.effects, parameters)
    linear = in_logarithms(problem, fitted, linearised(problem, fitted), parameters)
    found = resampled(linear, rng)
    for valley in valleys(problem, fitted, linear, parameters):
        found = along(found, linear, valley, rng)
    first = len(linear.here) - len(parameters)
    return Resampled(parameters, found[:, :first], factors_of(found[:, first:], chosen))


def resampled(linear: Linearised, rng: np.random.Generator) -> Array:
    """(DRAWS, P) parameters of a linearised fit from resamplings of its windows.

    Args:
        linear: at the fit.
        rng: of the resampling.
    """
    columns = np.concatenate([linear.residual[..., None], linear.sensitivity], axis=2)
    normals = np.matmul(columns.transpose(0, 2, 1), columns)
    here, deviation, low, high = linear.here, linear.deviation, linear.low, linear.high
    count, found = len(normals), []
    for _ in range(DRAWS):
        weights = np.bincount(rng.integers(count, size=count), minlength=count).astype(float)
        total = np.tensordot(weights, normals, axes=1)
        # a shape's deviation is infinite: nothing is expected of it
        gradient = total[1:, 0] - ((here - linear.expected) / deviation - rng.normal(size=len(here))) / deviation
        step = bounded_step(total[1:, 1:] + np.diag(deviation**-2.0), gradient, low - here, high - here)
        found.append(np.clip(here + step, low, high))
    return np.array(found)


def along(draws: Array, linear: Linearised, valley: Valley, rng: np.random.Generator) -> Array:
    """Draws (DRAWS, P) with the middle and the width that the cost itself has along a valley, and what forms add.

    Args:
        draws: of the linear model.
        linear: at the fit.
        valley: of the cost.
        rng: of the forms.
    """
    # the direction is one standard deviation of the linear model long: its inner product with itself is 1
    place = (draws - linear.here) @ (linear.information @ valley.direction)
    wanted = valley.middle + valley.width * (place - place.mean()) + valley.form * rng.normal(size=len(draws))
    return np.asarray(np.clip(draws + np.outer(wanted - place, valley.direction), linear.low, linear.high))


def intervals(draws: Array, level: float = LEVEL) -> list[tuple[float, float]]:
    """Central intervals of each column of (draws, E)."""
    tail = 0.5 * (1.0 - level)
    return [(float(a), float(b)) for a, b in np.quantile(draws, [tail, 1.0 - tail], axis=0).T]


def student_quantile(degrees: float) -> float:
    """Half the width of an interval in standard deviations, by Student's t.

    Args:
        degrees: of freedom; infinite for a normal variable.
    """
    from scipy.special import stdtrit

    return float(stdtrit(degrees, 0.5 + 0.5 * LEVEL))


def answer_interval(value: float, interval: tuple[float, float]) -> tuple[float, float]:
    """Interval of an answer from that of ``ddagr check``, which is surer.

    Args:
        value: estimate.
        interval: of the check.
    """
    narrower = student_quantile(math.inf) / float(ndtri(0.5 + 0.5 * CONFIDENCE))
    low, high = (value + narrower * (end - value) for end in interval)
    return low, high


def nuisance_spread(problem: Problem, fitted: Fitted, draws: Resampled) -> NuisanceSpread:
    """How sure the free nuisances are, and how those of robot and soil go together.

    Args:
        problem: what was fitted.
        fitted: from which the draws were made.
        draws: of :func:`resampled_parameters`.
    """
    free = [problem.nuisances.parameters[k] for k in np.flatnonzero(problem.free).tolist()]
    known = zip(free, intervals(draws.nuisances), fitted.point.values[problem.free].tolist(), strict=True)
    found = {p.name: (min(low, value), max(high, value)) for p, (low, high), value in known}
    # whatever has a scope, a shift or a heading belongs to recordings
    shared = [k for k, p in enumerate(free) if p.scope is None and not (p.shift or p.heading)]
    return NuisanceSpread(found, tuple(free[k].name for k in shared), _correlation(draws.nuisances[:, shared]))


def _correlation(draws: Array) -> tuple[tuple[float, ...], ...]:
    """Of the columns of (draws, P), to four digits; one that nothing moves goes with no other."""
    away = draws - draws.mean(axis=0)
    size = np.linalg.norm(away, axis=0)
    unit = np.divide(away, size, out=np.zeros_like(away), where=size > 0.0)
    matrix = unit.T @ unit
    np.fill_diagonal(matrix, 1.0)
    return tuple(tuple(row) for row in np.round(matrix, 4).tolist())


def with_structure(interval: tuple[float, float], effect: Effect, field: str) -> tuple[float, float]:
    """An interval widened in quadrature by what resampling one simulator's fit cannot show, within the field's bounds.

    Theory: diagnosis, eq. (10). Sizes of a soil are widened as logarithms.

    Args:
        interval: resampled.
        effect: at its fitted size.
        field: of the effect; a shape, which has no least meaningful size, keeps its interval.
    """
    if effect.soils and field in effect.size_names():
        return _factor_with_structure(interval, effect, field)
    data = effect.parameter(field).metadata
    value = getattr(effect, field)
    if effect.differentiable:
        away = 0.0 if data["neutral"] is None else value - data["neutral"]
        structure = float(np.hypot(STRUCTURE * data["least"], FORM * away))
    else:
        structure = (STRUCTURE_OF_LOAD if field in effect.load_sizes else STRUCTURE_OF_LIMIT) * abs(value)
    return _widened(interval, structure, value, data["low"], data["high"])


def _factor_with_structure(interval: tuple[float, float], effect: Effect, field: str) -> tuple[float, float]:
    data, value = effect.parameter(field).metadata, math.log(getattr(effect, field))
    structure = math.hypot(STRUCTURE * log_scale(data["least"]), FORM * value)
    ends = (math.log(interval[0]), math.log(interval[1]))
    low, high = _widened(ends, structure, value, math.log(data["low"]), math.log(data["high"]))
    return math.exp(low), math.exp(high)


def _widened(
    interval: tuple[float, float], structure: float, value: float, lowest: float, highest: float
) -> tuple[float, float]:
    middle, half = 0.5 * (interval[0] + interval[1]), 0.5 * (interval[1] - interval[0])
    wide = float(np.hypot(half, structure))
    low, high = max(middle - wide, min(lowest, interval[0])), min(middle + wide, max(highest, interval[1]))
    # few windows carry the fit where their resampling leaves its value out
    return min(low, value), max(high, value)
