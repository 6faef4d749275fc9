"""What speaks against a verdict: uneven sizes, sizes at their bounds, worse predictions elsewhere, dead channels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from ddagr_gym.diagnosis.answer.certificate import Certificate
from ddagr_gym.diagnosis.answer.location import EffectLocation, Localisation
from ddagr_gym.diagnosis.answer.verdict import NONE, UNKNOWN, DataDoubt, Diagnosis, IncompleteFor
from ddagr_gym.diagnosis.certification.certificate import worse_on_unseen
from ddagr_gym.diagnosis.localisation.operating_condition_words import uneven_phrase
from ddagr_gym.diagnosis.preprocessing.data_checks import dead_channels, suspects_of
from ddagr_gym.diagnosis.result.sentences import (
    dead_in_words,
    headline,
    pushed_in_words,
    suspects_in_words,
    worse_in_words,
)
from ddagr_gym.diagnosis.result.size_bounds import pushed_to_bounds
from ddagr_gym.diagnosis.wording import in_sentence

WHOLE = 0.8
"""Share of the mismatch that complete findings explain at least (ours: in two opened sealed sets all complete and right
ones explain 0.99 or more, a patch in place of a disturbed compass 0.3)."""


def review(
    diagnosis: Diagnosis,
    located: Localisation,
    repeats: EffectLocation | None = None,
    fit: Certificate | None = None,
    checks: Sequence[DataDoubt] = (),
) -> Diagnosis:
    """Findings with their places, and the headline with what speaks against them.

    The verdict is not the whole truth where a size is not the same everywhere or at the bound of what exists, where
    much of the mismatch is left, where drives that nothing was fitted to are certainly predicted worse with it, or
    where a channel is dead. Where nothing has a name, the sentence has the effects that the checks of the recordings
    suspect.

    Args:
        diagnosis: the verdict and its findings.
        located: where the mismatch is.
        repeats: where readings repeat; None where none does.
        fit: of the certification; None where nothing was certified.
        checks: of the recordings.
    """
    places = {**located.findings, **({} if repeats is None else {"sensor_hold": repeats})}
    findings = tuple(replace(f, where=places.get(f.name)) for f in diagnosis.findings)
    nameless = diagnosis.verdict in ((NONE,), (UNKNOWN,))
    dead = dead_channels(checks)
    of_names = [] if nameless else _doubts_of_names(replace(diagnosis, findings=findings), places, fit)
    doubts = [*of_names, dead_in_words(dead)] if dead else of_names
    # what was seen in the values is mended in all models: its share is not known
    share = located.explained if any(f.gate > 0.0 for f in findings) else None
    whole = diagnosis.complete and (share is None or share >= WHOLE)
    suspects = suspects_of(checks) if nameless else ()
    remarks = [suspects_in_words(suspects)] if suspects else []
    reasons = _reasons(whole, bool(of_names), bool(dead))
    sentence = headline(diagnosis.verdict, whole, findings, share, [*doubts, *remarks], silent=not of_names)
    return replace(diagnosis, findings=findings, complete=not reasons, sentence=sentence, incomplete_for=reasons)


def _reasons(whole: bool, doubtful: bool, dead: bool) -> tuple[IncompleteFor, ...]:
    """Why an answer is not complete, what is left first; empty where it is."""
    left: tuple[IncompleteFor, ...] = () if whole else ("left",)
    names: tuple[IncompleteFor, ...] = ("names",) if doubtful else ()
    return (*left, *names, "dead") if dead else (*left, *names)


def with_dead_channels(diagnosis: Diagnosis, checks: Sequence[DataDoubt]) -> Diagnosis:
    """An answer that also says which channels never change; it is not the whole truth then.

    Args:
        diagnosis: the answer.
        checks: of the recordings.
    """
    dead = dead_channels(checks)
    if not dead:
        return diagnosis
    said = dead_in_words(dead)
    sentence = f"{diagnosis.sentence} {said[0].upper()}{said[1:]}: the answer is that of the other channels."
    return diagnosis.doubted("dead", sentence)


def _doubts_of_names(diagnosis: Diagnosis, places: Mapping[str, EffectLocation], fit: Certificate | None) -> list[str]:
    """Sentences on findings that are uneven, at a bound, or predict unseen drives worse."""
    named = [finding.name for finding in diagnosis.findings]
    uneven = {name: places[name].uneven for name in named if name in places}
    doubts = [
        uneven_phrase(where, f"the size of {in_sentence(name)}") for name, where in uneven.items() if where is not None
    ]
    doubts += [pushed_in_words(**vars(pushed)) for pushed in pushed_to_bounds(diagnosis.findings)]
    worse = worse_on_unseen(fit) if named else None
    return doubts if worse is None else [*doubts, worse_in_words(**vars(worse))]
