"""What is missing where no name fits: sparse, unit-checked terms of the residual wrench, commands and readings.

    response     what forces along a window do to its readings
    regressors   on what they may depend
    stability    which terms are found in halves of the data again and again
    ceiling      what a flexible model would explain, and where it acts

Terms are fitted to the same block residuals as everything else, beside the windows' unknowns, the nominal parameters
and the sizes of the named effects, so a term is what is left after all of these have been refitted.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.answer.unnamed_terms import UnnamedTerm, UnnamedTerms
from ddagr_gym.diagnosis.answer.verdict import Diagnosis
from ddagr_gym.diagnosis.preprocessing.session import DiagnosisSession
from ddagr_gym.diagnosis.search.scanned_model import ScannedModel, SearchResult
from ddagr_gym.diagnosis.unnamed.boosted_baseline import boosted_share, concentration_of
from ddagr_gym.diagnosis.unnamed.regressors import Motion, Term, library, motion_of
from ddagr_gym.diagnosis.unnamed.response import INPUTS, Response, course_of, linearise
from ddagr_gym.diagnosis.unnamed.stability_selection import (
    Stable,
    Sums,
    coefficients,
    held_out_share,
    intervals,
    select,
)
from ddagr_gym.identification.effect_parameters import effect_columns, effect_parameters
from ddagr_gym.identification.least_squares import beside_residual
from ddagr_gym.identification.problem import Problem
from ddagr_gym.identification.windows import CHANNELS

Array = NDArray[np.float64]

STRETCH = 6.0
"""Length of the pieces of a recording that are drawn or left out together [s] (ours: three windows)."""

FEWEST_STRETCHES, MOST_STRETCHES = 16, 40
"""Pieces at least and at most; shorter or longer recordings get shorter or longer pieces."""

LEAST_SHARE = 0.01
"""Share of the left-out residual by which a further term must lower it (ours: below, it is of no use to anybody)."""

_FOLDS = 4
"""Parts of the pieces that are left out in turn (ours: each has four pieces at least, as there are 16)."""

_RIDGES = (0.03, 0.3, 3.0)
"""Penalties of the whole library, relative to each column's information, of which the best counts (ours: two decades
about 0.3)."""

_LEVEL = 0.9
"""Of the intervals of coefficients: that of all intervals of a diagnosis."""


def unnamed_terms(session: DiagnosisSession, found: SearchResult, diagnosis: Diagnosis) -> UnnamedTerms | None:
    """Terms that explain what the names leave; None where these explain everything.

    Args:
        session: of the diagnosis.
        found: of the search.
        diagnosis: its verdict.
    """
    if diagnosis.complete:
        return None
    return find_terms(session.problem, found.chosen, session.rng("unnamed terms"))


def find_terms(problem: Problem, model: ScannedModel, rng: np.random.Generator) -> UnnamedTerms:
    """Search for terms that explain what a model leaves.

    Args:
        problem: windows and nominal model.
        model: the model whose residual is to be explained, with the effects that it names.
        rng: of the halves.
    """
    fitted = model.fitted
    course = course_of(problem, fitted)
    motion = motion_of(problem, course)
    terms = library(problem, motion)
    columns = term_columns(problem, terms, linearise(problem, fitted, course))
    projected = fitted.elimination.project(_raw(problem, model, columns))
    group = stretches(problem)
    sums = _sums(problem, model, projected, group)
    fold = np.arange(int(group.max()) + 1) % _FOLDS

    found = select(
        sums,
        [term.plainness for term in terms],
        rng,
        worth=lambda chosen: held_out_share(sums, chosen, fold),
        least=LEAST_SHARE,
    )
    chosen = [item.column for item in found]
    share = held_out_share(sums, chosen, fold)
    ceiling = _ceiling(problem, sums, projected, motion, fold[group], fold)
    where = _where(problem, sums, projected, columns, motion, chosen)
    written = _written(sums, terms, found)
    return UnnamedTerms(_equation(written), written, share, max(ceiling, share), where)


def term_columns(problem: Problem, terms: Sequence[Term], response: Response) -> Array:
    """Weighted block means of the channels per unit coefficient, (W, M, K)."""
    count, blocks = problem.blocked.sigma.shape[:2]
    result = np.zeros((count, blocks, len(CHANNELS), len(terms)))
    for target in dict.fromkeys(term.target for term in terms):
        places = [k for k, term in enumerate(terms) if term.target == target]
        courses = np.stack([terms[k].signal.values for k in places], axis=2)
        result[..., places] = _answer(problem, target, courses, response)
    # no sample: sigma is infinite and the column zero
    return (result / problem.blocked.sigma[..., None]).reshape(count, -1, len(terms))


def _answer(problem: Problem, target: str, courses: Array, response: Response) -> Array:
    """(W, B, 8, K) change of the channels."""
    if target in INPUTS:
        return response.to(target, courses)
    if target in CHANNELS:
        direct = np.zeros((*courses.shape[:2], len(CHANNELS), courses.shape[2]))
        direct[:, :, CHANNELS.index(target)] = courses
        return direct
    axis = target[-1]
    pushed = response.to(f"F_{axis}", problem.robot.mass * courses)
    pushed[:, :, CHANNELS.index(f"specific_force_{axis}")] -= courses
    return pushed


def _raw(problem: Problem, model: ScannedModel, columns: Array) -> Array:
    """(W, M + S, 1 + P + K) residual, what a refit could still move, and the terms."""
    fitted = model.fitted
    free = problem.open_at(fitted.point)
    parameters = effect_parameters(fitted.point.effects)
    by_effect = effect_columns(problem, fitted.point, parameters)
    sensitivities = (fitted.by_parameter[..., free], by_effect, columns)
    residual = problem.residual(fitted.point, fitted.prediction)
    return beside_residual(residual, *(np.nan_to_num(part) for part in sensitivities))


def stretches(problem: Problem) -> NDArray[np.int64]:
    """(W,) number of the stretch of a recording that each window belongs to, in order."""
    windows = problem.blocked.windows
    total = windows.count * windows.duration
    length = max(min(STRETCH, total / FEWEST_STRETCHES), total / MOST_STRETCHES, windows.duration)
    key = windows.recording * 1_000_000 + np.floor(windows.time / length + 1e-6).astype(np.int64)
    return np.unique(key, return_inverse=True)[1].astype(np.int64)


def _sums(problem: Problem, model: ScannedModel, projected: Array, group: NDArray[np.int64]) -> Sums:
    """Inner products by stretch."""
    point = model.fitted.point
    free = problem.open_at(point)
    parameters = effect_parameters(point.effects)
    number = int(group.max()) + 1
    size = projected.shape[2]
    normals = np.zeros((number, size, size))
    for g in range(number):
        rows = projected[group == g].reshape(-1, size)
        normals[g] = rows.T @ rows
    here = [getattr(point.effects[p.effect], p.field) - p.neutral if np.isfinite(p.scale) else 0.0 for p in parameters]
    precision = np.concatenate([1.0 / problem.prior[free] ** 2, [p.scale**-2 for p in parameters]])
    return Sums(normals, precision, np.concatenate([point.values[free], here]))


def _ceiling(
    problem: Problem, sums: Sums, projected: Array, motion: Motion, fold: NDArray[np.int64], by_group: NDArray[np.int64]
) -> float:
    """The better of the whole library at once, shrunk, and boosted trees on each channel."""
    everything = list(range(sums.normals.shape[1] - 1 - sums.nuisances))
    ridge = max(held_out_share(sums, everything, by_group, ridge=r) for r in _RIDGES)
    residual = problem.blocked.by_channel(projected[..., 0])
    return max(ridge, boosted_share(residual, np.isfinite(problem.blocked.sigma), motion, fold), 0.0)


def _where(
    problem: Problem, sums: Sums, projected: Array, columns: Array, motion: Motion, chosen: Sequence[int]
) -> str:
    """Operating condition in which the terms act most, or in which most is left where there is none."""
    acting = columns[..., np.asarray(chosen)] @ coefficients(sums, chosen) if chosen else projected[..., 0]
    energy = (problem.blocked.by_channel(acting) ** 2).sum(axis=2)
    return concentration_of(energy, motion, problem.blocked.windows.recording).words


def _written(sums: Sums, terms: Sequence[Term], found: Sequence[Stable]) -> tuple[UnnamedTerm, ...]:
    """Terms with their coefficients and intervals."""
    if not found:
        return ()
    chosen = [item.column for item in found]
    values = coefficients(sums, chosen)
    low, high = intervals(sums, chosen, _LEVEL)
    written = []
    for k, item in enumerate(found):
        term = terms[item.column]
        others = [terms[a] for a in item.alike if a != item.column]
        alternatives = tuple(f"{other.target} ~ {other.signal.name}" for other in others)
        written.append(
            UnnamedTerm(
                term.signal.name, term.target, float(values[k]), str(term.unit), (float(low[k]), float(high[k])),
                item.share, alternatives,
            )
        )  # fmt: skip
    return tuple(written)


def _equation(terms: Sequence[UnnamedTerm]) -> str:
    """Terms by target: ``F_y = -35.2 [-38, -31] N sin(yaw) + ...; yaw_rate = ...``."""
    parts = []
    for target in dict.fromkeys(term.target for term in terms):
        pieces = [_piece(term) for term in terms if term.target == target]
        parts.append(f"{target} = " + " + ".join(pieces))
    return "; ".join(parts)


def _piece(term: UnnamedTerm) -> str:
    unit = "" if term.unit == "-" else f" {term.unit}"
    regressor = "" if term.regressor == "1" else f" {term.regressor}"
    low, high = term.interval
    return f"{term.coefficient:.3g} [{low:.3g}, {high:.3g}]{unit}{regressor}"
