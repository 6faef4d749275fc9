"""Where the refit of a limit starts: a limit has no derivative where nothing reaches it, so that costs are compared."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from ddagr_gym.diagnosis.search.candidates import Candidate, moved_field
from ddagr_gym.identification.gauss_newton import Fitted, cost_of
from ddagr_gym.identification.problem import Problem
from ddagr_gym.physics.effects import Effect

_FACTORS = (1.0, 1.4)
"""On the limits that a scan tries, which lie by factors of 1.5 to 2 apart (ours)."""

_KINDS = 2
"""Of limits that are refitted (ours): a refit costs about as much as the comparison of all of them."""


def limit_guesses(
    problem: Problem, start: Fitted, others: Sequence[Effect], candidates: Sequence[Candidate]
) -> list[Effect]:
    """The limits that leave least beside other effects, nothing refitted: the best size of each of the two best kinds.

    What a deep limit changes says little of a mild one, nor one kind of limit of another: the linear gain of a scan
    can point to a limit that no few steps lead away from.

    Args:
        problem: what to fit.
        start: fit to begin at.
        others: effects that are assumed already.
        candidates: limits of one effect.
    """
    best: dict[str, tuple[float, Effect]] = {}
    for kind, effect in _tried(candidates):
        point = replace(start.point, effects=(*others, effect))
        left = float(cost_of(problem, point, problem.predict(point), start.elimination)[0])
        if kind not in best or left < best[kind][0]:
            best[kind] = (left, effect)
    ranked = sorted(best.values(), key=lambda item: item[0])
    return [effect for _, effect in ranked[:_KINDS]]


def _tried(candidates: Sequence[Candidate]) -> Iterator[tuple[str, Effect]]:
    """Kind of the limit, which is the field that it moves, and the limit."""
    for candidate in candidates:
        probe = candidate.probes[0]
        name, data, _ = moved_field(probe)
        for factor in _FACTORS:
            yield name, probe.with_values(**{name: min(factor * getattr(probe, name), data["high"])})
