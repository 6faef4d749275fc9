"""The answer of a diagnosis in one sentence."""

from __future__ import annotations

from collections.abc import Sequence

from ddagr_gym.diagnosis.answer.change import BEFORE, Change, ChangeCertificate
from ddagr_gym.diagnosis.answer.onset import BEGINS, CONSTANT, ENDS, Onset
from ddagr_gym.diagnosis.answer.verdict import NONE, UNKNOWN, Finding
from ddagr_gym.diagnosis.result.near_miss import nearest_in_words
from ddagr_gym.diagnosis.result.soil_words import finding_in_words
from ddagr_gym.diagnosis.wording import CHANNEL_NAMES, in_sentence

MOST_CHANNELS = 3
"""Channels that a sentence lists (ours); the answer has all."""

RIVAL_WEIGHT = 0.2
"""Weight in the equivalence set below which the headline says that a rival is less likely (ours)."""


def headline(
    verdict: Sequence[str],
    complete: bool,
    findings: Sequence[Finding],
    misfit_share: float | None = None,
    doubts: Sequence[str] = (),
    silent: bool = False,
) -> str:
    """What is missing, how big, how much of the mismatch that is, and whether more is left.

    Args:
        verdict: names of the table, or ("none",) or ("unknown",).
        complete: whether nothing more is left than in drives with nothing missing.
        findings: one per name.
        misfit_share: share of the mismatch above the noise that the findings explain (0 to 1), None where unknown.
        doubts: what speaks against it or is not of one size everywhere, in words.
        silent: whether that is only of channels that say nothing, and nothing speaks against the names.
    """
    if tuple(verdict) == (NONE,):
        return "; ".join(["Nothing is missing that these recordings can show", *doubts]) + "."
    if tuple(verdict) == (UNKNOWN,):
        return "; ".join(["Something is missing that no effect of the library explains", *doubts]) + "."
    found = _joined([finding_in_words(item) + when(item) + _rivals(item) for item in findings])
    share = "" if misfit_share is None else f"; {share_in_words(misfit_share)} of the mismatch"
    return "; ".join([f"{found[:1].upper()}{found[1:]}{share}", *doubts, _rest(complete, bool(doubts), silent)]) + "."


def drivetrain_headline(parts: Sequence[str], findings: Sequence[Finding], explained: float, complete: bool) -> str:
    """That the drivetrain is missing, what else is, and how much of the wheel speeds' error that is.

    Args:
        parts: of the drivetrain that are named, in words; at least one.
        findings: beside them.
        explained: share of the squared error of the wheel speeds on what was left out of the fit [-].
        complete: whether nothing more is left than in drives with nothing missing.
    """
    lacks = f"the simulator lacks the robot's drivetrain ({_joined_names(parts)})"
    others = [finding_in_words(item) + when(item) + _rivals(item) for item in findings]
    found = _joined([lacks, *others])
    share = share_in_words(max(explained, 0.0))
    worth = f"on stretches that were left out of the fit this explains {share} of the squared error of the wheel speeds"
    return f"{found[:1].upper()}{found[1:]}; {worth}; {_rest(complete)}."


def _rest(complete: bool, doubtful: bool = False, silent: bool = False) -> str:
    """Whether more is left, or, where nothing is, what is doubted nevertheless.

    Args:
        complete: whether nothing is left.
        doubtful: whether there are doubts.
        silent: whether these are only of channels that say nothing.
    """
    if not complete:
        return "something more is left that has no name here"
    if doubtful and not silent:
        return "nothing else was found, but what is named is doubtful"
    return f"nothing else above what {'the other channels' if doubtful else 'these data'} can show"


def change_headline(verdict: Sequence[str], complete: bool, findings: Sequence[Finding], change: Change) -> str:
    """What changed against ordinary drives, how much, and what could not have been told.

    Args:
        verdict: names, or ("none",) or ("unknown",).
        complete: whether nothing else is out of the ordinary.
        findings: one per name.
        change: shifts of all effects.
    """
    drives = _reference(change)
    hidden = [in_sentence(name) for name in change.hidden]
    blind = f"; of {_joined_names(hidden)} no size would have been told" if hidden else ""
    ground = _soil_unnamed(change)
    if tuple(verdict) == (NONE,):
        power = f"{100.0 * change.power:.0f} times in 100"
        shown = f"the table says of each effect which change would have been found {power}"
        return (
            f"No change shows against {drives}.{nearest_in_words(change)} Smaller changes may be there: "
            f"{shown}{blind}{ground}."
        )
    if tuple(verdict) == (UNKNOWN,):
        nearest = _joined_names([in_sentence(item.effect) for item in change.shifts[:3]])
        seen = rougher_in_words(change) or f", nearest are {nearest}"
        return f"Something changed against {drives} that no effect of the library explains{seen}{blind}{ground}."
    found = _joined([finding_in_words(item) + when(item) + _rivals(item) for item in findings])
    rest = "nothing else is out of the ordinary" if complete else "something else is out of the ordinary"
    return f"Against {drives}: {found}; {rest}{rougher_in_words(change)}{ground}."


def rougher_in_words(change: Change) -> str:
    """Channels that the model fits worse than in ordinary drives, the worst first; "" where there is none."""
    found = sorted((item for item in change.channels if item.rougher), key=lambda item: -item.times)
    if not found:
        return ""
    shown = [f"{CHANNEL_NAMES[item.channel]} ({item.times:.1f} times)" for item in found[:MOST_CHANNELS]]
    return f": the model's error is larger than before in {_joined_names(shown)}"


def _reference(change: Change) -> str:
    """What drives were compared with, in words."""
    count = len(change.ordinary)
    if change.against == BEFORE:
        return f"the {count} drives before" if count > 1 else "the drive before"
    return f"{count} ordinary drives"


def _soil_unnamed(change: Change) -> str:
    """That another ground hides what changes in the soil; "" where the ground is known."""
    return "" if change.ground else "; the ground may be another one, so that no change of the soil has a name"


def certificate_in_words(certificate: ChangeCertificate, against: str, named: bool) -> str:
    """How many windows are forecast as well as those of ordinary drives.

    Args:
        certificate: of the drives.
        against: what they were compared with.
        named: whether anything changed that has a name.
    """
    percent = f"{100.0 * certificate.expected:.0f} %"
    whose = "drives before" if against == BEFORE else "ordinary drives"
    count = f"{certificate.as_well} of {certificate.windows} left-out windows are forecast"
    if not named:
        return f"{count} as well as {percent} of those of the {whose}."
    without = f"(without it {certificate.as_well_without})"
    return f"With what changed {count} as well as {percent} of those of the {whose} {without}."


def _joined_names(names: Sequence[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]]) if len(names) > 1 else "".join(names)


def when(finding: Finding) -> str:
    """When a finding began, ended or changed, to stand behind its sizes; "" for what is constant."""
    return "" if finding.onset is None else onset_in_words(finding.onset)


def onset_in_words(onset: Onset) -> str:
    """How a size goes with time, to stand behind it; "" for one that is constant."""
    if onset.kind == CONSTANT:
        return ""
    before, after = (f"{size:.1f}".replace("-", "−") for size in (onset.before, onset.after))
    if onset.value is None or onset.interval is None:
        return f", drifting from {before} to {after} times that in the course of {_of_drive(onset)}"
    low, high = onset.interval
    time = f"{onset.value:.0f} s ({low:.0f} to {high:.0f} s) of {_of_drive(onset)}"
    if onset.kind == BEGINS:
        return f", from {time} on"
    if onset.kind == ENDS:
        return f", until {time}"
    return f", {before} times that before {time} and {after} times after it"


def _of_drive(onset: Onset) -> str:
    return f"drive {onset.recording + 1}" if onset.recording else "the drive"


def _rivals(finding: Finding) -> str:
    """Names that the same windows may mean, in brackets, the less likely ones last; "" where there are none."""
    weights = {name: weight for name, weight in finding.equivalence_set.items() if name != finding.name}
    close = " or ".join(in_sentence(name) for name, weight in weights.items() if weight >= RIVAL_WEIGHT)
    others = " or ".join(in_sentence(name) for name, weight in weights.items() if weight < RIVAL_WEIGHT)
    phrases = [f"or {close}: these drives do not tell them apart"] if close else []
    phrases += [f"less likely {others}"] if others else []
    return f" ({'; '.join(phrases)})" if phrases else ""


def share_in_words(share: float) -> str:
    """A share as percent, between "less than 1 %" and "all"."""
    percent = 100.0 * share
    if percent < 1.0:
        return "less than 1 %"
    return "all" if percent >= 99.5 else f"{percent:.0f} %"


def worse_in_words(horizon: float, value: float, interval: Sequence[float]) -> str:
    """That drives which nothing was fitted to are predicted worse.

    Args:
        horizon: of the predictions [s].
        value: change of their error over that of the nominal model, negative.
        interval: of it.
    """
    span = f"{-100.0 * interval[1]:.0f} to {-100.0 * interval[0]:.0f} %"
    return (
        f"drives that it was not fitted to are predicted worse with it, by {-100.0 * value:.0f} % ({span}) after "
        f"{horizon:g} s, which makes the name doubtful"
    )


def pushed_in_words(name: str, field: str, bound: float, unit: str) -> str:
    """That a size is at the bound of what exists.

    Args:
        name: of the effect.
        field: the size.
        bound: in unit.
        unit: SI.
    """
    amount = f"{bound:g}" if unit == "-" else f"{bound:g} {unit}"
    return (
        f"the {field.replace('_', ' ')} of {in_sentence(name)} reaches {amount}, the bound of what exists, which makes "
        "its form doubtful"
    )


def dead_in_words(channels: Sequence[str]) -> str:
    """That channels never change and so say nothing.

    Args:
        channels: at least one, by name.
    """
    names = _joined_names([name.replace("_", " ") for name in channels])
    verb, pronoun = ("never change", "they say") if len(channels) > 1 else ("never changes", "it says")
    return f"{names} {verb} while the robot drives, so that {pronoun} nothing"


def suspects_in_words(names: Sequence[str]) -> str:
    """What the recordings' own checks suspect where no effect has a name.

    Args:
        names: of effects, at least one.
    """
    others = " or ".join(in_sentence(name) for name in names)
    return f"the recordings themselves look wrong in a way that {others} would explain (see their checks)"


def _joined(parts: Sequence[str]) -> str:
    if len(parts) < 2:
        return "".join(parts)
    return f"{'; '.join(parts[:-1])}; and {parts[-1]}" if len(parts) > 2 else f"{parts[0]}, and {parts[1]}"
