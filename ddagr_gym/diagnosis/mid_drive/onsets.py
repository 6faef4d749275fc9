"""When each named effect began: refits in which it is present in a part of the drives only, and what they say."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from ddagr_gym.diagnosis.answer.onset import BEGINS, CONSTANT, DRIFTS, ENDS, STEPS, Onset, TimedSize
from ddagr_gym.diagnosis.answer.verdict import Diagnosis
from ddagr_gym.diagnosis.mid_drive.change_in_time import Alternative, TimeRegression
from ddagr_gym.diagnosis.mid_drive.sizes import window_sizes
from ddagr_gym.identification.gauss_newton import Fitted, fit
from ddagr_gym.identification.misfit import dispersion_of
from ddagr_gym.identification.problem import Problem
from ddagr_gym.identification.spells import Spell

THRESHOLD = 6.0
"""Logarithm of the likelihood ratio that a change of a size in mid-drive needs (ours)."""

LEAST_CHANGE = 0.5
"""Change of a size over the larger of the two, below which it counts as constant (ours): an effect whose form is not
the library's has another size in other manoeuvres, and manoeuvres follow each other."""

ABSENT = 0.25
"""Size over the other one up to which an effect counts as absent (ours)."""

_WINDOWS, _STRETCHES = 1, 15
"""Windows of a stretch at least, and stretches of a recording at most, whose sizes are told (ours)."""

_REFIT = 6
"""Most steps of a refit that only asks on which side of a time an effect is present (ours), with the nuisances'
sensitivities of the fit before: only those of the effects are simulated."""


def onsets_of(problem: Problem, fitted: Fitted) -> dict[str, Onset]:
    """How the size of every effect of a fit goes with time, by name; none that acts in too few windows.

    Args:
        problem: what was fitted, with the parts of the drives in which effects are present.
        fitted: with effects.
    """
    found = {}
    for number, effect in enumerate(fitted.point.effects):
        regression = TimeRegression.of(window_sizes(problem, fitted, number))
        best = regression.best()
        if best is not None:
            found[effect.name] = _onset(regression, best, problem.spells.get(effect.name))
    return found


def with_onsets(diagnosis: Diagnosis, found: Mapping[str, Onset]) -> Diagnosis:
    """A diagnosis whose findings say when."""
    return replace(diagnosis, findings=tuple(replace(f, onset=found.get(f.name)) for f in diagnosis.findings))


def _onset(regression: TimeRegression, best: Alternative, spell: Spell | None) -> Onset:
    kind = _kind(best, spell)
    told = regression.anchored(spell) if spell is not None and kind in (BEGINS, ENDS) else regression
    sizes = tuple(TimedSize(*item) for item in told.in_stretches(_WINDOWS, _STRETCHES))
    if kind == CONSTANT:
        return Onset(kind, None, None, None, 1.0, 1.0, best.evidence, THRESHOLD, sizes)
    before, after = told.around(best)
    time, interval = (None, None) if kind == DRIFTS else (best.time, best.interval)
    return Onset(kind, time, interval, best.recording, before, after, best.evidence, THRESHOLD, sizes)


def changes(best: Alternative) -> bool:
    """Whether a size changes in the drive: more than by chance, and by more than its form explains."""
    larger = max(abs(best.before), abs(best.after))
    return best.evidence > THRESHOLD and abs(best.after - best.before) > LEAST_CHANGE * larger


def _kind(best: Alternative, spell: Spell | None) -> str:
    if not changes(best):
        return CONSTANT
    if best.line:
        return DRIFTS
    if spell is not None:
        return ENDS if spell.ends else BEGINS
    return STEPS


def spells_of(
    problem: Problem, fitted: Fitted, progress: Callable[[str], None] = lambda line: None
) -> dict[str, Spell]:
    """Parts of the drives in which effects of a fit are present, where that explains more than their being constant.

    Args:
        problem: what was fitted.
        fitted: with effects.
        progress: called with what is being done.
    """
    found: dict[str, Spell] = {}
    for number, effect in enumerate(fitted.point.effects):
        best = TimeRegression.of(window_sizes(problem, fitted, number)).best()
        if best is None or best.line or not changes(best):
            continue
        progress(f"refitting {effect.name} in a part of the drive")
        spell = _side(problem, fitted, effect.name, best)
        if spell is not None:
            found[effect.name] = spell
    return found


def _side(problem: Problem, fitted: Fitted, name: str, best: Alternative) -> Spell | None:
    """Whether an effect is present after a time or before it, by refits; None where neither explains it.

    The likelier side first: where that explains half of what the step of the size does, the other one is not tried.
    """
    dispersion, falls = dispersion_of(problem, fitted), dict[Spell, float]()
    likelier = abs(best.before) > abs(best.after)
    for ends in (likelier, not likelier):
        side = Spell(best.recording, best.time, ends=ends)
        refitted = _refitted(problem.during({**problem.spells, name: side}), fitted)
        falls[side] = (fitted.cost - refitted.cost) / dispersion
        if falls[side] > max(0.5 * best.evidence, THRESHOLD):
            return side
    chosen = max(falls, key=falls.__getitem__)
    return chosen if falls[chosen] > THRESHOLD else None


def _refitted(problem: Problem, fitted: Fitted) -> Fitted:
    return fit(problem, fitted.point, iterations=_REFIT, reuse=fitted)
