"""What a comparison with ordinary drives came near to, and how far so few of them can see: the words beside `none`."""

from __future__ import annotations

from statistics import median

from ddagr_gym.diagnosis.answer.amounts import Amount, size
from ddagr_gym.diagnosis.answer.change import CALIBRATION, Change, EffectShift
from ddagr_gym.diagnosis.wording import in_sentence

NEAR = 0.5
"""Share of its limit from which the nearest effect is said (ours)."""

FEW_DRIVES = 5
"""Ordinary drives below which limits may be said to be wide (ours): with three they are up to twice those of many."""

FEW_DEGREES = 12.0
"""Degrees of freedom of most effects below which limits then are wide (ours): a sixth above those of 26 degrees."""


def by_distance(change: Change) -> list[EffectShift]:
    """Shifts of all effects, the largest distance over its limit first."""
    return sorted(change.shifts, key=over_limit, reverse=True)


def nearest(change: Change) -> EffectShift | None:
    """The effect that stands nearest below its limit; None where none is beyond :data:`NEAR` of it."""
    return next((item for item in by_distance(change) if NEAR < over_limit(item) < 1.0), None)


def over_limit(item: EffectShift) -> float:
    """Distance of an effect from ordinary drives, over its limit [-]."""
    return item.distance / item.limit


def nearest_in_words(change: Change) -> str:
    """Sentences on what stood out in a first step alone, and on the effect nearest to its limit; "" without any."""
    return _refuted_in_words(change) + _nearest_in_words(change)


def _refuted_in_words(change: Change) -> str:
    """What is there or not and passed its limit by a derivative, where a fit with it found nothing."""
    names = [in_sentence(item.effect) for item in by_distance(change) if over_limit(item) >= 1.0]
    if not names:
        return ""
    return f" By a first step alone it would be {' or '.join(names)}, but a fit with it explains nothing."


def _nearest_in_words(change: Change) -> str:
    found = nearest(change)
    if found is None:
        return ""
    further = (
        "further ordinary drives, or --before with the drives themselves, may tell"
        if change.against == CALIBRATION
        else "further drives from before may tell"
    )
    share = f"{100.0 * over_limit(found):.0f} % of its limit"
    return f" The nearest is {in_sentence(found.effect)}{_shift_in_words(found)}, at {share}: {further}."


def _shift_in_words(item: EffectShift) -> str:
    """The size of an effect that moved most for what is known of it, in brackets; "" where none has a shift."""
    known = {name: found for name, found in item.sizes.items() if abs(found.value) < float("inf")}
    if not known:
        return ""
    name = max(known, key=lambda key: abs(known[key].value) / known[key].deviation)
    found = known[name]
    plus = "+" if found.value > 0.0 else ""
    return f" ({name.replace('_', ' ')} {plus}{size(Amount(found.value, found.unit))})"


def few_drives_in_words(change: Change) -> str:
    """That limits are wide with so few ordinary drives, and what shows smaller changes; "" where they are not."""
    count = len(change.ordinary)
    narrow = bool(change.shifts) and median(item.degrees for item in change.shifts) >= FEW_DEGREES
    if change.against != CALIBRATION or count >= FEW_DRIVES or narrow:
        return ""
    return (
        f"Only {count} ordinary drive{'s say' if count > 1 else ' says'} what is usual, so that limits are wide: a "
        "comparison with the drives themselves (--before in place of --calibration) may show smaller changes."
    )
