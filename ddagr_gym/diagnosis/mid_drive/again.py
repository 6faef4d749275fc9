"""A second search where the size of a name changes in mid-drive."""

from __future__ import annotations

from collections.abc import Mapping

from ddagr_gym.diagnosis.answer.onset import Onset
from ddagr_gym.diagnosis.mid_drive.onsets import onsets_of, spells_of
from ddagr_gym.diagnosis.mid_drive.search_in_time import spells_that_hold
from ddagr_gym.diagnosis.preprocessing.session import DiagnosisSession
from ddagr_gym.diagnosis.search.scanned_model import SearchResult
from ddagr_gym.diagnosis.search.starting_models import StartingModels
from ddagr_gym.diagnosis.search.stepwise import search
from ddagr_gym.identification.misfit import dispersion_of
from ddagr_gym.identification.spells import Spell

Timed = tuple[Mapping[str, Spell], SearchResult]
"""Parts of the drives in which effects are present, and the search with them."""


def search_in_parts(session: DiagnosisSession, start: StartingModels, found: SearchResult) -> Timed:
    """The search once more with an effect in a part of the drives, where that explains more than the first one.

    Args:
        session: of the diagnosis.
        start: its nominal models.
        found: by the first search.
    """
    problem = session.problem
    spells = spells_of(problem, found.chosen.fitted, session.progress)
    if not spells:
        return {}, found
    session.progress(f"searching once more, {' and '.join(spells)} in a part of the drive")
    first = found.steps[0] if found.steps else ()
    known = {rival.name: rival for rival in first if rival.name not in spells}
    again = search(session.during(spells), start, known=known)
    fall = found.chosen.fitted.cost - again.chosen.fitted.cost
    kept = spells_that_hold(spells, again.chosen.names, fall, dispersion_of(problem, again.chosen.fitted))
    return (kept, again) if kept else ({}, found)


def onsets_of_names(session: DiagnosisSession, found: SearchResult) -> dict[str, Onset]:
    """How the size of every name of a search goes with time.

    Args:
        session: of the diagnosis, with the parts of the drives in which effects are present.
        found: names that were accepted.
    """
    return onsets_of(session.problem, found.chosen.fitted)
