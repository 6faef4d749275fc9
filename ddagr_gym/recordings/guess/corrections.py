"""What the arbitration of the checks says against a proposal, as changes of the map."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

from ddagr_gym.recordings.checks.imu_findings import mounting_takes
from ddagr_gym.recordings.checks.map_lines import Takes
from ddagr_gym.recordings.checks.motion_windows import COMMANDS, ENCODERS
from ddagr_gym.recordings.checks.wheels import BACKWARDS, RIGHT_AND_LEFT, wheel_takes, wheels_followed, wheels_of
from ddagr_gym.recordings.guess.banks import Banks
from ddagr_gym.recordings.guess.candidates import Candidate, as_wheels
from ddagr_gym.recordings.guess.choose import Choice, choose_command, choose_imu, choose_pose
from ddagr_gym.recordings.guess.trials import Trials


@dataclass(frozen=True)
class Correction:
    """A proposal after the checks.

    Attributes:
        trials: with the signs of the map.
        choices: by role, with exchanged banks or another reading of the IMU.
        sentences: what was changed and why.
    """

    trials: Trials
    choices: Mapping[str, Choice]
    sentences: tuple[str, ...] = ()

    @property
    def candidates(self) -> dict[str, Candidate | None]:
        """By role."""
        return {role: choice.candidate for role, choice in self.choices.items()}


def corrected(trials: Trials, choices: Mapping[str, Choice]) -> Correction:
    """Exchange banks and set signs where the checks are certain that a channel is wrong.

    Args:
        trials: with the robot's geometry; without it nothing is corrected, since slip and scale cannot be told.
        choices: by role.
    """
    before = Correction(trials, choices)
    if trials.geometry is None:
        return before
    after = _imu_corrected(_wheels_corrected(before))
    return _chosen_again(after) if after.sentences else after


def _chosen_again(before: Correction) -> Correction:
    """What the wheels as they were may have misjudged, once more."""
    trials, choices = before.trials, dict(before.choices)
    imu = choose_imu(trials, choices["wheels"])
    chosen = choices["imu"].candidate
    if imu.candidate is not None and chosen is not None and imu.candidate.source == chosen.source:
        choices["imu"] = imu
    choices["command"] = choose_command(trials, choices["imu"], choices["wheels"])
    choices["pose"] = choose_pose(trials, choices["imu"], choices["wheels"])
    return replace(before, choices=choices)


def _wheels_corrected(before: Correction) -> Correction:
    wheels, choice = _wheels_by_motion(before), before.choices["wheels"]
    if wheels is None or choice.candidate is None or choice.banks is None:
        return before
    takes = wheel_takes(ENCODERS, wheels)
    exchanged = any(name != source for name, (source, _) in takes.items())
    if exchanged or choice.open_side:
        choice = _sides_by_motion(before.trials, choice, choice.banks.exchanged() if exchanged else choice.banks)
    after = replace(before, trials=_with_signs(before.trials, takes), choices={**before.choices, "wheels": choice})
    pairs = zip(RIGHT_AND_LEFT, wheels, strict=True)
    sentence = "; ".join(_moved(bank, moved) for bank, moved in pairs if bank != moved)
    return replace(after, sentences=(*before.sentences, sentence)) if takes else after


def _wheels_by_motion(before: Correction) -> tuple[str, str] | None:
    """What the right and the left wheels move as; None where that is not certain, or both move as one bank.

    That encoders and commands agree confirms no side without another source of turning.
    """
    found = before.trials.arbitration(before.candidates)
    if found is None:
        return None
    wheels = wheels_of(found.wheels[ENCODERS])
    if wheels is None and found.accused(ENCODERS):
        wheels = wheels_followed(found.followed)
    if wheels is None or len({moved.removesuffix(BACKWARDS) for moved in wheels}) < len(RIGHT_AND_LEFT):
        return None
    witnesses = set(found.turning.majority) - {ENCODERS, COMMANDS}
    return wheels if witnesses or wheel_takes(ENCODERS, wheels) else None


def _sides_by_motion(trials: Trials, choice: Choice, banks: Banks) -> Choice:
    """The wheels with the sides that their motion tells, which are open no more."""
    joints = next(c for c in trials.contents.of("wheels") if choice.candidate and c.topic == choice.candidate.topic)
    why = f"{' and '.join(banks.right)} right and {' and '.join(banks.left)} left by motion"
    candidate = as_wheels(joints, banks.right, banks.left)
    return replace(choice, candidate=candidate, banks=banks, why=why, open_side="")


def _moved(bank: str, moved: str) -> str:
    """What a bank's channel moves as, in words."""
    backwards = ", but counts backwards" if moved.endswith(BACKWARDS) else ""
    return f"what was taken for the {bank} wheels moves as the {moved.removesuffix(BACKWARDS)} ones{backwards}"


def _imu_corrected(before: Correction) -> Correction:
    found, choice = before.trials.arbitration(before.candidates), before.choices["imu"]
    fit = None if found is None else found.mounting
    if fit is None or not fit.decided or not fit.best.faults or choice.candidate is None:
        return before
    plain = _unturned(before, choice)
    if plain is not None:
        return plain
    takes = mounting_takes(fit.best)
    if any(name != source for name, (source, _) in takes.items()):
        return before  # a topic map cannot exchange axes: the finding says what to do
    sentence = f"imu: motion and gravity show {' and '.join(takes)} with the wrong sign"
    return replace(before, trials=_with_signs(before.trials, takes), sentences=(*before.sentences, sentence))


def _unturned(before: Correction, choice: Choice) -> Correction | None:
    """The IMU's readings as they are, where they fit better than turned by the transforms; None where they do not."""
    chosen = choice.candidate
    if chosen is None or not chosen.source.frame:
        return None
    others = (c for c in before.trials.contents.of("imu") if c.topic == chosen.topic and not c.source.frame)
    plain = replace(choice, candidate=next(others, None))
    after = replace(before, choices={**before.choices, "imu": plain})
    found = before.trials.arbitration(after.candidates)
    if found is None or found.mounting is None or not found.mounting.decided or found.mounting.best.faults:
        return None
    sentence = "imu: its readings are in the robot's axes already, the transforms were left out"
    return replace(after, sentences=(*before.sentences, sentence))


def _with_signs(trials: Trials, takes: Takes) -> Trials:
    signs: dict[str, Literal[1, -1]] = {name: -1 for name, (_, sign) in takes.items() if sign < 0}
    return replace(trials, signs={**trials.signs, **signs})
