"""What the arbitration of the checks says against a proposal, as changes of the map."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from ddagr_gym.recordings.checks.arbitration import Arbitration
from ddagr_gym.recordings.checks.imu_findings import mounting_takes
from ddagr_gym.recordings.checks.map_lines import Takes
from ddagr_gym.recordings.checks.motion_windows import ENCODERS
from ddagr_gym.recordings.checks.wheels import wheel_takes, wheels_followed, wheels_of
from ddagr_gym.recordings.guess.candidates import Candidate, as_wheels
from ddagr_gym.recordings.guess.choose import Choice
from ddagr_gym.recordings.guess.trials import Trials


@dataclass(frozen=True)
class Correction:
    """A proposal after the checks.

    Attributes:
        choices: by role, with exchanged banks or another reading of the IMU.
        signs: of the map.
        sentences: what was changed and why.
    """

    choices: Mapping[str, Choice]
    signs: Mapping[str, int]
    sentences: tuple[str, ...]


def corrected(trials: Trials, choices: Mapping[str, Choice]) -> Correction:
    """Exchange banks and set signs where the checks are certain that a channel is wrong.

    Args:
        trials: with the robot's geometry; without it nothing is corrected, since slip and scale cannot be told.
        choices: by role.
    """
    correction = Correction(choices, {}, ())
    if trials.geometry is None:
        return correction
    for correct in (_wheels_corrected, _imu_corrected):
        found = _arbitration(trials, correction)
        correction = correct(trials, correction, found) if found else correction
    return correction


def _arbitration(trials: Trials, correction: Correction) -> Arbitration | None:
    candidates = {role: choice.candidate for role, choice in correction.choices.items()}
    return trials.arbitration(candidates, correction.signs)


def _wheels_corrected(trials: Trials, before: Correction, found: Arbitration) -> Correction:
    wheels, choice = wheels_of(found.wheels[ENCODERS]), before.choices["wheels"]
    if wheels is None and found.accused(ENCODERS):
        wheels = wheels_followed(found.followed)
    takes = wheel_takes(ENCODERS, wheels) if wheels else {}
    if not takes or choice.candidate is None or choice.banks is None or wheels is None:
        return before
    sentences = [f"the channel of the {bank} wheels moves as {moved}" for bank, moved in _moved(wheels)]
    if any(name != source for name, (source, _) in takes.items()):
        banks = choice.banks.exchanged()
        joints = next(c for c in trials.contents.of("wheels") if c.topic == choice.candidate.topic)
        choice = replace(choice, candidate=as_wheels(joints, banks.right, banks.left), banks=banks)
        sentences = [f"{sentence}: right and left were exchanged" for sentence in sentences[:1]]
    signs = {**before.signs, **_signs(takes)}
    return Correction({**before.choices, "wheels": choice}, signs, (*before.sentences, *sentences))


def _moved(wheels: tuple[str, str]) -> list[tuple[str, str]]:
    return [(bank, moved) for bank, moved in zip(("right", "left"), wheels, strict=True) if bank != moved]


def _imu_corrected(trials: Trials, before: Correction, found: Arbitration) -> Correction:
    fit, choice = found.mounting, before.choices["imu"]
    if fit is None or not fit.decided or not fit.best.faults or choice.candidate is None:
        return before
    as_it_is = _unturned(trials, before) if choice.candidate.source.frame else None
    if as_it_is is not None:
        return as_it_is
    takes = mounting_takes(fit.best)
    if any(name != source for name, (source, _) in takes.items()):
        return before  # a topic map cannot exchange axes: the finding says what to do
    sentence = f"motion and gravity show {' and '.join(takes)} with the wrong sign"
    return replace(before, signs={**before.signs, **_signs(takes)}, sentences=(*before.sentences, sentence))


def _unturned(trials: Trials, before: Correction) -> Correction | None:
    """The IMU's readings as they are, where they fit better than turned by the transforms; None where they do not."""
    choice = before.choices["imu"]
    plain = next((c for c in trials.contents.of("imu") if _same_unturned(c, choice.candidate)), None)
    correction = replace(before, choices={**before.choices, "imu": replace(choice, candidate=plain)})
    found = _arbitration(trials, correction) if plain else None
    if found is None or found.mounting is None or not found.mounting.decided or found.mounting.best.faults:
        return None
    sentence = "the IMU's readings are in the robot's axes already: the transforms were left out"
    return replace(correction, sentences=(*before.sentences, sentence))


def _same_unturned(candidate: Candidate, chosen: Candidate | None) -> bool:
    return chosen is not None and candidate.topic == chosen.topic and not candidate.source.frame


def _signs(takes: Takes) -> dict[str, int]:
    return {name: -1 for name, (_, sign) in takes.items() if sign < 0}
