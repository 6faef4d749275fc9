"""The answer on many drives in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ddagr_gym.diagnosis.answer.amounts import amount_of, number, rounded, unit_in_words
from ddagr_gym.diagnosis.answer.drive_series import (
    BY_TIME,
    LAST,
    PARAMETER,
    PASSES,
    SINGLE,
    STAYS,
    DriveRow,
    DriveSeries,
    MovedSize,
    SeriesEvent,
)
from ddagr_gym.diagnosis.answer.verdict import NONE
from ddagr_gym.diagnosis.wording import in_sentence

MOST_NAMES = 2
"""Effects in a sentence on an event (ours); the page has all of them."""

MOST_OWN_NAMES = 3
"""Effects that a sentence lists where drives have different names (ours)."""

MOST_LISTED = 10
"""Numbers of drives in a row (ours)."""

MOST_SINGLE = 3
"""Odd drives that the sentence says (ours)."""


def series_sentence(series: DriveSeries) -> str:
    """The first drive at which something changed and what, later ones, odd drives, and what was refused."""
    answered = [row for row in series.rows if not row.refused]
    if not answered:
        return f"None of the {len(series.rows)} drives could be compared."
    steps = [event for event in series.events if event.kind != SINGLE]
    odd = [event for event in series.events if event.kind == SINGLE]
    parts = [event_sentence(event, series) for event in steps] or [_nothing(len(answered), series, bool(odd))]
    parts += [event_sentence(event, series) for event in odd[:MOST_SINGLE]]
    if len(odd) > MOST_SINGLE:
        parts.append(f"{len(odd) - MOST_SINGLE} more drives are odd by themselves.")
    parts += [*_named_alone(series), *_refused(series.rows)]
    return " ".join(parts)


def event_sentence(event: SeriesEvent, series: DriveSeries) -> str:
    """Where something changed, and what."""
    where = drive_in_words(event.drive, series)
    what = _what(event, series)
    if event.kind == LAST:
        return f"The last drive, {where}, is out of the ordinary: {what}; whether it stays a further drive will tell."
    if event.kind == SINGLE:
        return f"Drive {where} alone shows something that the drives after it do not: {what}."
    doubt = event.earliest != event.latest
    began = f" (it may have begun at any from {event.earliest + 1} to {event.latest + 1})" if doubt else ""
    small = (
        ". It is less than what single ordinary drives differ by: another ground, load or wear looks alike"
        if event.small
        else ""
    )
    if event.kind == PASSES:
        until = drive_in_words(event.last, series)
        return f"From drive {where} to {until}{began} something was different, and is over: {what}{small}."
    again = any(item.kind == STAYS and item.drive < event.drive for item in series.events)
    return f"From drive {where} on{began} something {'else ' if again else ''}changed, and stays: {what}{small}."


def drive_in_words(row: int, series: DriveSeries) -> str:
    """Number of a drive, its file, and its date where that is known."""
    item = series.rows[row]
    date = f", {item.started[:10]}" if item.started is not None and series.order == BY_TIME else ""
    return f"{row + 1} of {len(series.rows)} ({item.drive}{date})"


def moved_in_words(item: MovedSize) -> str:
    """A size and its shift."""
    of = in_sentence(item.effect) if item.effect != PARAMETER else "the fitted parameter"
    unit = "" if item.unit == "-" else f" {item.unit}"
    sign = "+" if item.shift > 0.0 else ""
    return f"{of} ({item.size} {sign}{number(item.shift)}{unit})"


def _what(event: SeriesEvent, series: DriveSeries) -> str:
    """Names that most of the drives have; else the drives' own names, or the size that moved most."""
    common = [name for name, count in event.names.items() if 2 * count > event.drives][:MOST_NAMES]
    rows = _concerned(event, series)
    if not common:
        return _without_common_name(event, series, rows)
    first, *others = common
    said = f"{in_sentence(first)}{_size_in_words(first, rows)}"
    if event.drives > 1:
        said += f", named in {event.names[first]} of {event.drives} drives"
    return said + (f", or {in_sentence(others[0])}" if others else "")


def _without_common_name(event: SeriesEvent, series: DriveSeries, rows: Sequence[DriveRow]) -> str:
    """What single drives name where no effect is named in most of them, and the size that moved most where few do."""
    own = _own_names(series, rows)
    if 2 * sum(bool(row.findings) for row in rows) > event.drives:
        return f"its drives have different names, {own}"
    named = "no effect is named in most of these drives" if event.drives > 1 else "no effect is named in it"
    effects = [item for item in event.moved if item.effect != PARAMETER]
    moved = f"{named}; most moves {moved_in_words((effects or event.moved)[0])}"
    return f"{moved}; named is {own}" if own else moved


def _own_names(series: DriveSeries, rows: Sequence[DriveRow]) -> str:
    """Effects that drives name, each with its drives and its size in these; "" where none does."""
    names = dict.fromkeys(finding.name for row in rows for finding in row.findings)
    said = []
    for name in list(names)[:MOST_OWN_NAMES]:
        having = [row for row in rows if any(finding.name == name for finding in row.findings)]
        numbers = [next(k for k, row in enumerate(series.rows, 1) if row is item) for item in having]
        listed = ", ".join(map(str, numbers[:MOST_LISTED])) + (", ..." if len(numbers) > MOST_LISTED else "")
        drives = "drives" if len(numbers) > 1 else "drive"
        said.append(f"{in_sentence(name)}{_size_in_words(name, having)} in {drives} {listed}")
    return " and ".join([", ".join(said[:-1]), said[-1]] if len(said) > 1 else said)


def _concerned(event: SeriesEvent, series: DriveSeries) -> list[DriveRow]:
    rows = [row for row in series.rows[event.drive :] if not row.refused]
    return rows[: event.drives]


def _size_in_words(name: str, rows: Sequence[DriveRow]) -> str:
    """Median of the first size of an effect over the drives that name it."""
    found = [finding for row in rows for finding in row.findings if finding.name == name]
    fields = Counter(field for finding in found for field, item in finding.parameters.items() if item.interval)
    if not fields:
        return ""
    # sizes that all drives have come first; of these the one that is stated first
    most = max(fields.values())
    field = next(field for field in fields if fields[field] == most)
    items = [amount_of(finding.parameters[field]) for finding in found if field in finding.parameters]
    middle = sorted(items, key=lambda item: item.value)[len(items) // 2]
    value = replace(middle, value=float(np.median([item.value for item in items])))
    return f" ({field.replace('_', ' ')} {rounded(value)} {unit_in_words(middle.unit)}".rstrip() + ")"


def _nothing(answered: int, series: DriveSeries, odd: bool) -> str:
    drives = f"{answered} drives" if answered > 1 else "the drive"
    return f"Nothing changed over {drives} {'but in single ones' if odd else 'that they could show'}."


def _named_alone(series: DriveSeries) -> list[str]:
    """Verdicts that no event backs, beside how many ordinary drives would have by chance."""
    concerned: set[int] = set()
    for event in series.events:
        answered = [k for k, row in enumerate(series.rows) if not row.refused and k >= event.drive]
        concerned |= set(answered[: event.drives])
    answered_all = [k for k, row in enumerate(series.rows) if not row.refused]
    alone = [k for k in answered_all if k not in concerned and series.rows[k].verdict != (NONE,)]
    if not alone:
        return []
    expected = series.level * (len(answered_all) - len(concerned))
    listed = ", ".join(str(k + 1) for k in alone[:MOST_LISTED]) + (", ..." if len(alone) > MOST_LISTED else "")
    one = len(alone) == 1
    said = (
        f"Drive {listed} is out of the ordinary by its" if one else f"Drives {listed} are out of the ordinary by their"
    )
    return [f"{said} own answer, which is no event of the series; by chance {number(expected)} of so many would be."]


def _refused(rows: Sequence[DriveRow]) -> list[str]:
    count = sum(row.refused for row in rows)
    if not count:
        return []
    return [f"{count} of {len(rows)} {'drives were' if count > 1 else 'was'} refused; the table says why."]
