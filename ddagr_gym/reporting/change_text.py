"""What changed, as text."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ddagr_gym.diagnosis.answer.amounts import number
from ddagr_gym.diagnosis.answer.change import BEFORE
from ddagr_gym.diagnosis.result.near_miss import by_distance, few_drives_in_words
from ddagr_gym.diagnosis.result.sentences import certificate_in_words
from ddagr_gym.diagnosis.wording import CHANNEL_NAMES, title
from ddagr_gym.physics.effects.slope import Slope
from ddagr_gym.reporting.diagnosis_text import AgainstGate, finding_rows
from ddagr_gym.reporting.parameter_units import unit_in_words
from ddagr_gym.reporting.text_table import format_table

if TYPE_CHECKING:
    from ddagr_gym.diagnosis.answer.change import Change, EffectShift, SizeShift
    from ddagr_gym.diagnosis.answer.verdict import Diagnosis, Finding

CHANGED_HEADER = ("effect", "size", "90 % interval", "unit", "distance", "limit", "could also be")
"""Columns of :func:`changed_rows`; distance and limit in standard deviations of what makes ordinary drives differ."""

SHIFT_HEADER = ("effect", "size", "before", "shift", "deviation", "unit", "distance", "limit", "would be found from")
"""Columns of :func:`shift_rows`; distance and limit in standard deviations."""

PARAMETER_HEADER = ("parameter", "without effects", "with what changed", "ordinary drives", "unit")
"""Columns of :func:`parameter_rows`."""

CHANNEL_HEADER = ("readings", "before", "without effects", "with what changed", "limit")
"""Columns of :func:`channel_rows`; root mean squares of the model's error, in units of its weight."""

SHOWN = 8
"""Effects in the text, the most conspicuous (ours); the page has all of them."""

FIRST_ESTIMATE = (
    "A first estimate of each effect as if it were the only one{fitted}.\n"
    "Distance: how far its sizes are from those of {drives}, in standard deviations of what makes these differ.\n"
    "Limit: the distance that an ordinary drive exceeds, for any effect, in {level} % of the cases."
)
"""Above the table of all effects."""


def change_text(diagnosis: Diagnosis) -> str:
    """Answer, findings, and the most conspicuous effects."""
    change = _of(diagnosis)
    parts = [diagnosis.sentence]
    if diagnosis.findings:
        parts.append(format_table(CHANGED_HEADER, changed_rows(diagnosis)))
    parts += [line for line in (certified(diagnosis), slope_before(change), few_drives_in_words(change)) if line]
    rows = [row for item in by_distance(change)[:SHOWN] for row in _rows(item)]
    parts.append(f"{first_estimate(diagnosis)}\n\n{format_table(SHIFT_HEADER, rows)}")
    further = len(change.shifts) - SHOWN
    if further > 0:
        parts.append(f"{further} effects more are less conspicuous; the page and diagnosis.json have all of them.")
    parts.append("\n".join(["Not looked for:", *(f"  {line}" for line in not_compared(change))]))
    return "\n\n".join(parts)


def first_estimate(diagnosis: Diagnosis) -> str:
    """What the table of all effects shows, and what its distances and limits are."""
    change = _of(diagnosis)
    fitted = "; the answer above fits together what is named" if diagnosis.findings else ""
    drives = "the drives before" if change.against == BEFORE else "ordinary drives"
    return FIRST_ESTIMATE.format(fitted=fitted, drives=drives, level=f"{100.0 * change.level:g}")


def changed_rows(diagnosis: Diagnosis) -> list[tuple[str, ...]]:
    """One row per size of what is named, under :data:`CHANGED_HEADER`."""
    return finding_rows(diagnosis, _distance_and_limit)


def _distance_and_limit(finding: Finding) -> AgainstGate:
    """Gain and gate are half the squares of them; what is seen in the values has no gate, and no distance."""
    return (math.sqrt(2.0 * finding.gain), math.sqrt(2.0 * finding.gate)) if finding.gate > 0.0 else None


def shift_rows(diagnosis: Diagnosis) -> list[tuple[str, ...]]:
    """One row per size of every effect, under :data:`SHIFT_HEADER`."""
    return [row for item in by_distance(_of(diagnosis)) for row in _rows(item)]


def parameter_rows(diagnosis: Diagnosis) -> list[tuple[str, ...]]:
    """Changes of the parameters from their calibrated values, under :data:`PARAMETER_HEADER`."""
    return [
        (
            item.name.replace("_", " "),
            number(item.change),
            number(item.with_effects),
            f"± {number(item.expected_deviation)}",
            unit_in_words(item.name, item.unit),
        )
        for item in _of(diagnosis).parameters
    ]


def channel_rows(diagnosis: Diagnosis) -> list[tuple[str, ...]]:
    """Error of the model in each channel, under :data:`CHANNEL_HEADER`."""
    return [
        (
            CHANNEL_NAMES[item.channel],
            *(number(math.sqrt(value)) for value in (item.before, item.without_effects, item.with_effects, item.limit)),
        )
        for item in _of(diagnosis).channels
    ]


def not_compared(change: Change) -> list[str]:
    """Effects that were not looked for, with the reason, and those of which no size would have been found."""
    lines = [f"{title(name)}: {reason}." for name, reason in change.not_compared.items()]
    return [*lines, *(f"{title(name)}: such a drive would show no size of it." for name in change.hidden)]


def slope_before(change: Change) -> str:
    """What the known ground slopes by; "" where that is less than matters, or not known."""
    found = change.slope
    if found is None or found.angle < Slope.parameter("angle").metadata["least"]:
        return ""
    angle, direction, deviation = (math.degrees(value) for value in (found.angle, found.direction, found.deviation))
    known, asked = ("drives before", "the drives after") if change.against == BEFORE else ("ordinary drives", "these")
    return (
        f"The ground of the {known} slopes by {angle:.1f} degrees, rising towards {direction:.0f} degrees from "
        f"the x axis; it is taken to slope so in {asked} too (to {deviation:.1f} degrees)."
    )


def certified(diagnosis: Diagnosis) -> str:
    """How well left-out windows are forecast; "" where that is not known."""
    change = _of(diagnosis)
    if change.certificate is None:
        return ""
    return certificate_in_words(change.certificate, change.against, bool(diagnosis.findings))


def _of(diagnosis: Diagnosis) -> Change:
    if diagnosis.change is None:
        raise ValueError("the diagnosis was made without a calibration")
    return diagnosis.change


def _rows(item: EffectShift) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for place, (name, size) in enumerate(item.sizes.items()):
        first = place == 0
        whole = (f"{item.distance:.1f}", f"{item.limit:.1f}") if first else ("", "")
        label = title(item.effect) if first else ""
        unit = size.unit if size.unit != "-" else ""
        values = (number(value) for value in (size.before, size.value, size.deviation))
        rows.append((label, name.replace("_", " "), *values, unit, *whole, least(size)))
    return rows


def least(size: SizeShift) -> str:
    """Least detectable change in words."""
    return "no size" if size.least_detectable is None else number(size.least_detectable)
