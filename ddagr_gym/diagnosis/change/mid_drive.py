"""What changed in mid-drive: names once more with an effect in a part of the drives."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from ddagr_gym.diagnosis.change.contrasts import begun_in_drive
from ddagr_gym.diagnosis.change.model import Model
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
            return problem.during(kept), _compared_all_along(again, named)
    return problem, named


def _compared_all_along(again: Named, first: Named) -> Named:
    """Names in a part of the drive, with the shifts of every effect all along it from ordinary drives."""
    usual = replace(again.models[0], scan=first.models[0].scan, shifts=first.models[0].shifts)
    return replace(again, models=(usual, *again.models[1:]))


def _spells(
    problem: Problem, named: Named, ordinary: Comparison, progress: Callable[[str], None]
) -> Iterator[dict[str, Spell]]:
    """Parts of the drive to try: of names whose size changes, of what differs within the drive, without names or beside
    them, and where neither is there and an answer is open, of what explains most.
    """
    of_names = spells_of(problem, named.models[-1].fitted, progress)
    if of_names:
        yield of_names
    first_and_last = named.models[:: max(len(named.models) - 1, 1)]
    begun = next((spells for model in first_and_last if (spells := _begun(model, ordinary))), {})
    if begun.keys() - of_names.keys():
        yield begun
    if not (of_names or begun or named.complete):
        most = _of_scan(problem, named)
        if most:
            yield most


def _begun(model: Model, ordinary: Comparison) -> dict[str, Spell]:
    names = {shift.compared.name for shift in model.shifts} - ordinary.unnamed.keys()
    return begun_in_drive(model.scan, model.problem.blocked.windows, model.tests, names)


def _of_scan(problem: Problem, named: Named) -> dict[str, Spell]:
    first, last = named.models[0], named.models[-1]
    scan, dispersion = first.scan, dispersion_of(problem, first.fitted)
    explained = (first.fitted.cost - last.fitted.cost) / dispersion
    candidates = [(item.candidate, [scan.keys.index(key) for key in item.keys]) for item in scan.compared]
    return best_spells(scan.products, candidates, problem.blocked.windows, dispersion, explained)
