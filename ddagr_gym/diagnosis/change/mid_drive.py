"""What changed in mid-drive: names once more with an effect in a part of the drives."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ddagr_gym.diagnosis.change.contrasts import begun_in_drive
from ddagr_gym.diagnosis.change.naming import Named, name_changes
from ddagr_gym.diagnosis.change.ordinary import Comparison
from ddagr_gym.diagnosis.mid_drive.onsets import spells_of
from ddagr_gym.diagnosis.mid_drive.search_in_time import best_spells, spells_that_hold
from ddagr_gym.identification.gauss_newton import Fitted
from ddagr_gym.identification.misfit import dispersion_of
from ddagr_gym.identification.problem import Problem
from ddagr_gym.identification.spells import Spell


def name_in_parts(
    problem: Problem,
    fitted: Fitted,
    named: Named,
    ordinary: Comparison,
    rng: np.random.Generator,
    progress: Callable[[str], None] = lambda line: None,
) -> tuple[Problem, Named]:
    """The names with an effect in a part of the drives, where that explains more; else those that were found.

    Args:
        problem: of the drive.
        fitted: without effects.
        named: what changed, if all of it holds all along the drive.
        ordinary: what the drive is compared with.
        rng: of resampled windows.
        progress: called with what is being done.
    """
    for spells in _spells(problem, named, ordinary, progress):
        progress(f"comparing once more, {' and '.join(spells)} in a part of the drive")
        again = name_changes(problem.during(spells), fitted, ordinary, rng, progress)
        effects = {effect.name for effect in again.models[-1].fitted.point.effects}
        fall = named.models[-1].fitted.cost - again.models[-1].fitted.cost
        kept = spells_that_hold(spells, effects, fall, dispersion_of(problem, again.models[-1].fitted))
        if kept:
            return problem.during(kept), again
    return problem, named


def _spells(
    problem: Problem, named: Named, ordinary: Comparison, progress: Callable[[str], None]
) -> Iterator[dict[str, Spell]]:
    """Parts of the drive to try, each where the one before did not hold: of names whose size changes, of what changes
    within the drive, and of what explains most where an answer is open.
    """
    first, last = named.models[0], named.models[-1]
    of_names = spells_of(problem, last.fitted, progress)
    if of_names:
        yield of_names
    begun = begun_in_drive(first.scan, problem.blocked.windows, first.tests, ordinary.unnamed)
    if begun and begun != of_names:
        yield begun
    if not (of_names or begun or named.complete):
        found = _of_scan(problem, named)
        if found:
            yield found


def _of_scan(problem: Problem, named: Named) -> dict[str, Spell]:
    first, last = named.models[0], named.models[-1]
    scan, dispersion = first.scan, dispersion_of(problem, first.fitted)
    explained = (first.fitted.cost - last.fitted.cost) / dispersion
    candidates = [(item.candidate, [scan.keys.index(key) for key in item.keys]) for item in scan.compared]
    return best_spells(scan.products, candidates, problem.blocked.windows, dispersion, explained)
