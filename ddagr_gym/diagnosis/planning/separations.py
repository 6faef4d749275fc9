"""What rivals of each other leave of one another's readings in planned drives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.planning.planned_drive import Plan
from ddagr_gym.diagnosis.result.equivalence import runs_apart
from ddagr_gym.diagnosis.search.candidates import Candidate, candidates_of
from ddagr_gym.diagnosis.search.scan import drive_extent, probe_columns
from ddagr_gym.identification.least_squares import explained_by
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.physics.effects import Effect

Array = NDArray[np.float64]

_NOTHING = 1e-12
"""Information below which there is nothing but rounding."""


@dataclass(frozen=True, eq=False)
class Columns:
    """Projected sensitivities of a plan's windows.

    Attributes:
        table: (W, M + S, P + K) nuisances, then effects at their sizes and their probes.
        precision: (P,).
        whole: column of each rival at its size.
        probes: columns of each rival's candidates, with the precision of their multiples.
    """

    table: Array
    precision: Array
    whole: tuple[int, ...]
    probes: tuple[tuple[tuple[tuple[int, ...], Array], ...], ...]


@dataclass(frozen=True)
class Separation:
    """Of a pair in a manoeuvre.

    Attributes:
        gain: of the right name over the wrong one.
        channels: (8,) shares of the channels in it.
        whole: all that the right name gains; 0 where it is alone.
    """

    gain: float
    channels: tuple[float, ...]
    whole: float = 0.0

    @property
    def runs(self) -> float:
        """Runs of the manoeuvre that tell the two apart, infinite where none does."""
        return runs_apart(self.gain, self.whole)


def columns_of(prepared: Plan, rivals: Sequence[Effect]) -> Columns:
    """Simulate every rival at its size and by its probes, and project the windows' unknowns out."""
    problem, fitted = prepared.problem, prepared.fitted
    extent = drive_extent(problem, fitted.prediction)
    free = np.flatnonzero(problem.free)
    columns = list(np.moveaxis(fitted.by_parameter[..., free], 2, 0))
    whole, probes = [], []
    for rival in rivals:
        whole.append(len(columns))
        columns += probe_columns(problem, fitted, [rival])
        own = []
        for candidate in _close(candidates_of(type(rival), extent, 0), rival):
            places = tuple(range(len(columns), len(columns) + len(candidate.probes)))
            columns += probe_columns(problem, fitted, candidate.probes)
            own.append((places, 1.0 / np.array(candidate.scales) ** 2))
        probes.append(tuple(own))
    table = fitted.elimination.project(problem.padded(np.stack(columns, axis=2)))
    return Columns(table, 1.0 / problem.prior[free] ** 2, tuple(whole), tuple(probes))


def _close(candidates: Sequence[Candidate], rival: Effect) -> list[Candidate]:
    """Candidates that may imitate another effect: none of a flip or limit, which stands where it was fitted."""
    if rival.categorical or not rival.differentiable:
        return []
    if {"centre_x", "centre_y"} <= set(rival.shape_names()):
        return []
    return list(candidates)


def separations(prepared: Plan, columns: Columns, number: int, count: int) -> dict[tuple[int, int], Separation]:
    """By pair (truth, rival) in one manoeuvre; the truth against nothing where it is alone."""
    chosen = prepared.problem.blocked.windows.recording == number
    table = columns.table[chosen]
    flat = table.reshape(-1, table.shape[2])
    total = flat.T @ flat
    alone = [_separation((a, -1), columns, total, table) for a in range(count)]
    pairs = [(a, b) for a in range(count) for b in range(count) if a != b]
    found = {(a, b): replace(_separation((a, b), columns, total, table), whole=alone[a].gain) for a, b in pairs}
    return found or {(0, -1): alone[0]}


def _separation(pair: tuple[int, int], columns: Columns, total: Array, table: Array) -> Separation:
    """What the best imitation by the rival leaves of the truth."""
    truth = columns.whole[pair[0]]
    groups: list[tuple[tuple[int, ...], Array]] = [((), np.zeros(0))]
    if pair[1] >= 0:
        whole = columns.whole[pair[1]]
        own = columns.probes[pair[1]] or (((), np.zeros(0)),)
        groups = [((whole, *places), np.concatenate([[0.0], precision])) for places, precision in own]
    left = [_left_over(truth, places, precision, columns, total, table) for places, precision in groups]
    return min(left, key=lambda item: item.gain)


def _left_over(
    truth: int, places: Sequence[int], precision: Array, columns: Columns, total: Array, table: Array
) -> Separation:
    p = len(columns.precision)
    index = np.array([*range(p), *places, truth])
    inside = total[np.ix_(index, index)]
    weights = np.concatenate([columns.precision, precision])
    ridge = weights + 1e-9 * np.maximum(np.diag(inside)[:-1], _NOTHING)
    answer = explained_by(inside[:-1, :-1], ridge, inside[:-1, -1])
    gain = 0.5 * max(float(inside[-1, -1] - inside[-1, :-1] @ answer), 0.0)
    rest = table[..., truth] - table[..., index[:-1]] @ answer
    rows = rest.shape[1] // len(CHANNELS) * len(CHANNELS)
    # the rows of the priors lie below the block means
    energy = (rest[:, :rows].reshape(rest.shape[0], -1, len(CHANNELS)) ** 2).sum(axis=(0, 1))
    whole = float(energy.sum())
    return Separation(gain, tuple((energy / whole).tolist() if whole > 0.0 else energy.tolist()))
