"""When an effect shows: its score along the drives, and the change points of that score.

The score of a piece of a drive is the inner product of what the model without the effect leaves there with what the
effect does there, both without what the nuisances could explain. Its mean is the information of the piece where the
effect is at work as fitted, and nothing where it is not; raw residuals change for many reasons, the score for this one
(power 0.93 against 0.13 in the study that the project follows).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.answer.location import Span
from ddagr_gym.extras import need
from ddagr_gym.identification.gauss_newton import Fitted
from ddagr_gym.identification.least_squares import explained_by
from ddagr_gym.identification.misfit import projected_residual
from ddagr_gym.identification.problem import Problem

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

PIECE = 0.5
"""Length of the pieces into which windows fall [s] (ours: shorter than what a robot of this size does on purpose)."""

_SHOWS = 3.0
"""Standard deviations from which on a stretch shows an effect (ours: one in 700 stretches of noise)."""

_SHOWS_ITSELF = 2.0
"""The same for a part of such a stretch (ours)."""

_PENALTY = 3.0
"""Of a change point, times the logarithm of the number of pieces (ours: above the 2 of Yao's criterion)."""

_LEAST_INFORMATION = 0.05
"""Squared size of an effect in a piece over the mean of all pieces, below which it does not act there (ours)."""

_CLOSED_GAP = 1.0
"""Time between pieces up to which they belong to one stretch [s] (ours)."""

_SHORTEST = 2
"""Pieces between two change points at least."""


@dataclass(frozen=True, eq=False)
class ScoreProcess:
    """Score of one effect by window and piece.

    Attributes:
        name: of the effect.
        score: (W, Q) inner product of the residual without the effect and the effect.
        information: (W, Q) squared size of the effect: the score's variance, and its mean as the effect was fitted.
        gain: (W, Q) fall of the cost by the effect.
        remainder: (W, Q) inner product of the residual beside the effect and the effect; sums to nearly nothing.
        own: (W, Q) squared size of the effect before the nuisances' answer, which reaches pieces where it does nothing.
    """

    name: str
    score: Array
    information: Array
    gain: Array
    remainder: Array
    own: Array


def piece_blocks(blocks: int, block: float) -> Integers:
    """(B,) piece of each of a window's blocks; a rest that is shorter than a piece joins the last one.

    Args:
        blocks: B.
        block: length of one [s].
    """
    length = max(round(PIECE / block), 1)
    return np.minimum(np.arange(blocks) // length, max(blocks // length, 1) - 1)


def by_piece(values: Array, pieces: Integers) -> Array:
    """Sums (W, Q) over the blocks of each piece, and over channels, of (W, B) or (W, B, 8)."""
    flat = values if values.ndim == 2 else values.sum(axis=2)
    return np.stack([flat[:, pieces == q].sum(axis=1) for q in range(int(pieces[-1]) + 1)], axis=1)


def pieces_of(problem: Problem) -> Integers:
    """(B,) piece of each block of a problem's windows."""
    _, blocks, length, _ = problem.blocked.weights.shape
    return piece_blocks(blocks, length * problem.blocked.windows.period)


def piece_length(problem: Problem) -> float:
    """Seconds of a piece, the last one of a window apart."""
    _, _, length, _ = problem.blocked.weights.shape
    return float(np.count_nonzero(pieces_of(problem) == 0) * length * problem.blocked.windows.period)


def as_it_stands(problem: Problem, nominal: Fitted) -> Fitted:
    """The nominal model before any refit, from the initial states that suit the refitted one."""
    point = replace(nominal.point, values=np.zeros(len(problem.prior)))
    return replace(nominal, point=point, prediction=problem.predict(point))


def score_processes(problem: Problem, fitted: Fitted) -> tuple[ScoreProcess, ...]:
    """Score of each effect of a fitted model; one simulation per effect.

    Args:
        problem: what was fitted.
        fitted: with effects, or none.
    """
    if not fitted.point.effects:
        return ()
    pieces = pieces_of(problem)
    left = problem.blocked.by_channel(projected_residual(problem, fitted))
    without = _without_nuisances(problem, fitted)
    found = []
    for number, effect in enumerate(fitted.point.effects):
        column = _effect_column(problem, fitted, number)
        own = fitted.elimination.project(problem.padded(column[..., None]))[..., 0]
        moved = problem.blocked.by_channel(without(own))
        information = by_piece(moved**2, pieces)
        beside = by_piece(left * moved, pieces)
        gain, acts = beside + 0.5 * information, by_piece(problem.blocked.by_channel(own) ** 2, pieces)
        found.append(ScoreProcess(effect.name, beside + information, information, gain, beside, acts))
    return tuple(found)


def _effect_column(problem: Problem, fitted: Fitted, number: int) -> Array:
    """(W, M) weighted change of the block means by one of the effects, all else as it stands."""
    effects = fitted.point.effects
    without = replace(fitted.point, effects=(*effects[:number], *effects[number + 1 :]))
    return problem.blocked.change(fitted.prediction, problem.predict(without))


def _without_nuisances(problem: Problem, fitted: Fitted) -> Callable[[Array], Array]:
    """Function that takes from a column (W, M + S), projected already, what the nuisances explain of it."""
    free = np.flatnonzero(problem.free)
    columns = fitted.elimination.project(problem.padded(fitted.by_parameter[..., free]))
    inner, precision = np.einsum("wmp,wmq->pq", columns, columns, optimize=True), 1.0 / problem.prior[free] ** 2

    def without(own: Array) -> Array:
        change = explained_by(inner, precision, np.einsum("wmp,wm->p", columns, own))
        return np.asarray(own - columns @ change)

    return without


def change_points(signal: Array) -> list[int]:
    """Ends of the stretches of (n,) between whose means a signal of unit variance jumps, the last one n.

    Theory: diagnosis, section 10.

    PELT with squared errors (R. Killick, P. Fearnhead, I. Eckley, 2012; in C with a linear kernel).

    Raises:
        InputError: ruptures is not installed.
    """
    if len(signal) < 2 * _SHORTEST:
        return [len(signal)]
    need("ruptures")
    import ruptures

    search = ruptures.KernelCPD(kernel="linear", min_size=_SHORTEST).fit(np.asarray(signal).reshape(-1, 1))
    return [int(end) for end in search.predict(pen=_PENALTY * np.log(len(signal)))]


def spans(
    process: ScoreProcess, recording: Integers, time: Array, piece: float, duration: float, dispersion: float = 1.0
) -> tuple[Span, ...]:
    """Stretches in which an effect shows, in the order of time.

    Pieces in which the effect does next to nothing (another place, a standing robot) belong to no stretch.

    Args:
        process: of the effect.
        recording: (W,) of each window.
        time: (W,) at which it starts [s].
        piece: length of a piece [s].
        duration: of a window [s].
        dispersion: variance of the standardised residuals.
    """
    found: list[Span] = []
    total = max(float(process.gain.sum()), 1e-12)
    acts = process.own > _LEAST_INFORMATION * float(process.own.mean())
    acts &= process.information > 1e-9
    count = process.score.shape[1]
    for number in np.unique(recording):
        rows = np.flatnonzero(recording == number)
        rows = rows[np.argsort(time[rows], kind="stable")]
        start = (time[rows, None] + piece * np.arange(count)).ravel()
        last = np.arange(count) == count - 1
        end = np.where(np.tile(last, len(rows)), np.repeat(time[rows] + duration, count), start + piece)
        columns = np.stack([start, end, *(v[rows].ravel() for v in (process.score, process.information, process.gain))])
        found += _shown(int(number), columns[:, acts[rows].ravel()], total, dispersion)
    return tuple(found)


def _shown(number: int, pieces: Array, total: float, dispersion: float) -> list[Span]:
    """Spans of one recording from the pieces (5, n) that can show the effect: start, end, score, information, gain."""
    start, end, score, information, _ = pieces
    if not len(start):
        return []
    standard = score / np.sqrt(dispersion * information)
    shows = np.zeros(len(start), dtype=bool)
    first = 0
    for stop in change_points(standard):
        known = np.sqrt(dispersion * information[first:stop].sum())
        shows[first:stop] = score[first:stop].sum() > _SHOWS * known
        first = stop
    gaps = np.append(False, start[1:] > end[:-1] + _CLOSED_GAP)
    group = np.cumsum(gaps | np.append(False, shows[1:] != shows[:-1]))
    parts = [_span(number, pieces[:, group == k], total, dispersion) for k in np.unique(group[shows])]
    return [part for part in parts if part.size > _SHOWS_ITSELF * part.deviation]


def _span(number: int, pieces: Array, total: float, dispersion: float) -> Span:
    start, end, score, information, gain = pieces
    known = float(information.sum())
    share, size = float(gain.sum()) / total, float(score.sum()) / known
    return Span(number, float(start[0]), float(end[-1]), share, size, float(np.sqrt(dispersion / known)))


def time_share(found: Sequence[Span], windows: int, duration: float) -> float:
    """Share of the driven time that spans cover.

    Args:
        found: spans.
        windows: W.
        duration: of a window [s].
    """
    return min(sum(item.end - item.start for item in found) / max(windows * duration, 1e-12), 1.0)
