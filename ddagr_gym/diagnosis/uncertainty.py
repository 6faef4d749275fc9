"""How sure: resampled intervals of the parameters of named effects, and the least sizes that a drive could show."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.problem import Problem
from ddagr_gym.diagnosis.refit import EffectParameter, Fitted, bounded_step, effect_columns, effect_parameters, read
from ddagr_gym.diagnosis.scores import Terms, reduce
from ddagr_gym.diagnosis.thresholds import Thresholds
from ddagr_gym.physics.effects import Effect

Array = NDArray[np.float64]

LEVEL = 0.9
"""Of the intervals."""

STRUCTURE = 0.2
"""Half the width, in least meaningful sizes, that an interval has however many windows there are: another simulator's
form of the same effect differs by so much (on the project's own blind drives 15 of 25 intervals of resampling alone
held the truth, and most misses were within a tenth of the least meaningful size)."""

STRUCTURE_OF_LIMIT = 0.02
"""The same of a limit, as a share of it: one that a robot does not reach is no least size (one per cent there)."""


def resampled_parameters(
    problem: Problem, fitted: Fitted, rng: np.random.Generator, draws: int = 400
) -> tuple[tuple[EffectParameter, ...], Array]:
    """Effect parameters from resamplings of the windows, (draws, E), by one Gauss-Newton step from the fit.

    Windows rather than samples are drawn, so that errors which are alike within a window widen the intervals.

    Args:
        problem: what was fitted.
        fitted: with effects.
        rng: of the resampling.
        draws: how often.
    """
    parameters = effect_parameters(fitted.point.effects)
    free = np.flatnonzero(problem.free)
    by_effect = effect_columns(problem, fitted.point, fitted.prediction, parameters)
    sensitivities = np.concatenate([fitted.by_parameter[..., free], by_effect], axis=2)
    residual = problem.residual(fitted.point, fitted.prediction)[..., None]
    columns = fitted.elimination.project(np.concatenate([residual, problem.padded(sensitivities)], axis=2))
    normals = np.matmul(columns.transpose(0, 2, 1), columns)
    here = np.concatenate([fitted.point.values[free], read(fitted.point.effects, parameters)])
    low = np.concatenate([problem.low[free], [p.low for p in parameters]])
    high = np.concatenate([problem.high[free], [p.high for p in parameters]])
    precision = np.concatenate([1.0 / problem.prior[free] ** 2, [p.scale**-2 for p in parameters]])
    middle = np.concatenate([np.zeros(len(free)), [p.neutral for p in parameters]])
    count, found = len(normals), []
    for _ in range(draws):
        weights = np.bincount(rng.integers(count, size=count), minlength=count).astype(float)
        total = np.tensordot(weights, normals, axes=1)
        gradient = total[1:, 0] - precision * (here - middle)
        step = bounded_step(total[1:, 1:] + np.diag(precision), gradient, low - here, high - here)
        found.append((here + step)[len(free) :])
    return parameters, np.array(found).reshape(draws, len(parameters))


def intervals(draws: Array, level: float = LEVEL) -> list[tuple[float, float]]:
    """Central intervals of each column of (draws, E)."""
    tail = 0.5 * (1.0 - level)
    return [(float(a), float(b)) for a, b in np.quantile(draws, [tail, 1.0 - tail], axis=0).T]


def with_structure(interval: tuple[float, float], effect: Effect, field: str) -> tuple[float, float]:
    """An interval widened in quadrature by what resampling one simulator's fit cannot show, within the field's bounds.

    Args:
        interval: resampled.
        effect: at its fitted size.
        field: of the effect; a shape, which has no least meaningful size, keeps its interval.
    """
    data = effect.parameter(field).metadata
    structure = STRUCTURE * data["least"] if effect.differentiable else STRUCTURE_OF_LIMIT * abs(getattr(effect, field))
    middle, half = 0.5 * (interval[0] + interval[1]), 0.5 * (interval[1] - interval[0])
    wide = float(np.hypot(half, structure))
    return max(middle - wide, min(data["low"], interval[0])), min(middle + wide, max(data["high"], interval[1]))


def least_detectable(terms: Terms, thresholds: Thresholds, dispersion: float) -> Mapping[str, dict[str, float]]:
    """Distance of each size from neutral whose expected gain reaches the gate, by effect and field.

    The gain of a size s is s^2 I / 2 with the information I that is left beside the nuisances; infinite where there is
    none. The smallest over an effect's probes of that field is given.
    """
    reduced = reduce(terms)
    found: dict[str, dict[str, float]] = {}
    for candidate in terms.candidates:
        gate = thresholds.of(candidate.name).gain * dispersion
        for column, probe in zip(candidate.columns, candidate.probes, strict=True):
            if not probe.differentiable or probe.categorical:
                continue
            information = float(reduced.information[column, column])
            for name in probe.size_names():
                away = abs(getattr(probe, name) - probe.parameter(name).metadata["neutral"])
                if away == 0.0:
                    continue
                size = away * float(np.sqrt(2.0 * gate / information)) if information > 0.0 else np.inf
                best = found.setdefault(candidate.name, {})
                best[name] = min(best.get(name, np.inf), size)
    return found
