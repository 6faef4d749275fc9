"""Many drives of one robot over time, as text and as a table for spreadsheets."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING

from ddagr_gym.diagnosis.answer.amounts import amount_of, number, with_interval
from ddagr_gym.diagnosis.answer.drive_series import LAST, PARAMETER, PASSES, STAYS
from ddagr_gym.diagnosis.series.sentences import drive_in_words, event_sentence
from ddagr_gym.diagnosis.wording import in_sentence, title
from ddagr_gym.reporting.text_table import format_table

if TYPE_CHECKING:
    from ddagr_gym.diagnosis.answer.drive_series import DriveRow, DriveSeries, MovedSize, SeriesEvent, SizeChart
    from ddagr_gym.diagnosis.answer.verdict import Finding

DRIVE_HEADER = ("no.", "drive", "date (UTC)", "minutes", "answer", "sizes (90 % interval)", "complete")
"""Columns of :func:`drive_rows`."""

EVENT_HEADER = ("from drive", "what", "size", "shift", "± deviation", "unit", "distance")
"""Columns of :func:`event_rows`."""

CSV_HEADER = (
    "number", "drive", "sha256", "started", "minutes", "refused", "verdict", "complete", "probability", "effect",
    "size", "value", "low", "high", "unit", "sentence",
)  # fmt: skip
"""Columns of drives.csv: a line per size of every finding, one for a drive without any."""

SHOWN_SIZES = 3
"""Of an event in the text (ours), the most certain first; drives.json has all of them."""


def series_text(series: DriveSeries) -> str:
    """Answer, events, and one line per drive."""
    parts = [series.sentence, format_table(DRIVE_HEADER, drive_rows(series))]
    if series.events:
        parts.append(format_table(EVENT_HEADER, event_rows(series)))
    parts += [f"{row.drive}: {row.sentence}" for row in series.rows if row.refused]
    parts.append("\n".join(notes(series)))
    return "\n\n".join(parts)


def drive_rows(series: DriveSeries) -> list[tuple[str, ...]]:
    """One row per drive, under :data:`DRIVE_HEADER`."""
    return [
        (
            str(place),
            row.drive + (" (ordinary)" if row.left_out else ""),
            date(row),
            "–" if row.minutes is None else f"{row.minutes:.1f}",
            answer(row),
            "; ".join(sizes_in_words(item) for item in row.findings),
            "–" if row.complete is None else "yes" if row.complete else "no",
        )
        for place, row in enumerate(series.rows, 1)
    ]


def date(row: DriveRow) -> str:
    """Date and time to the minute; a dash where they are not known."""
    return "–" if row.started is None else row.started[:16].replace("T", " ")


def answer(row: DriveRow) -> str:
    """Verdict in words, with what may be meant instead."""
    if row.refused:
        return "refused"
    if not row.findings:
        return ", ".join(row.verdict)
    return ", ".join(_named(item) for item in row.findings)


def _named(finding: Finding) -> str:
    rivals = [in_sentence(name) for name in finding.equivalence_set if name != finding.name]
    return in_sentence(finding.name) + (f" (or {', '.join(rivals)})" if rivals else "")


def sizes_in_words(finding: Finding) -> str:
    """Sizes of a finding with their intervals; what was not fitted is left out."""
    known = {name: item for name, item in finding.parameters.items() if item.interval is not None}
    return ", ".join(
        f"{name.replace('_', ' ')} {with_interval(amount_of(item))}" for name, item in (known or {}).items()
    )


def event_rows(series: DriveSeries) -> list[tuple[str, ...]]:
    """One row per size that an event moved, under :data:`EVENT_HEADER`; the most certain ones."""
    return [row for event in series.events for row in _event_rows(event, series)]


def _event_rows(event: SeriesEvent, series: DriveSeries) -> list[tuple[str, ...]]:
    kinds = {STAYS: "stays from here on", LAST: "the last drive", PASSES: f"is over after drive {event.last + 1}"}
    first = (drive_in_words(event.drive, series), kinds.get(event.kind, "this drive alone"))
    rows = []
    for place, item in enumerate(event.moved[:SHOWN_SIZES]):
        unit = item.unit if item.unit != "-" else ""
        values = (number(item.shift), number(item.deviation), unit, f"{item.distance:.1f}")
        rows.append((*(first if place == 0 else ("", "")), moved_label(item), *values))
    return [(row[0], row[1], *row[2:]) for row in rows]


def moved_label(item: MovedSize | SizeChart) -> str:
    """Effect and size; a parameter of robot or ground as itself."""
    if item.effect == PARAMETER:
        return f"{item.size[:1].upper()}{item.size[1:]}, fitted"
    whole = title(item.effect)
    return whole if item.size.lower() in whole.lower() else f"{whole}, {item.size}"


def event_sentences(series: DriveSeries) -> list[str]:
    """One sentence per event."""
    return [event_sentence(event, series) for event in series.events]


def notes(series: DriveSeries) -> list[str]:
    """How the drives were ordered, and how many false alarms to expect."""
    answered = sum(not row.refused for row in series.rows)
    percent = f"{100.0 * series.level:g} %"
    order = (
        "Drives are in the order of the time of their first row."
        if series.order == "time"
        else "Drives are in the order of their files' names, since not all of them have a clock that gives a date."
    )
    expected = f"{number(series.level * answered)} of {answered}"
    alone = f"An answer on one drive is a false alarm in {percent} of ordinary drives: {expected}."
    tests = f"{len(series.charts)} sizes and {answered} drives"
    whole = f"Events take {tests} into account, and limits of the charts likewise: {percent} of such folders in which "
    whole += "nothing changed have any."
    ordinary = sum(row.left_out for row in series.rows)
    known = [f"{ordinary} drives marked ordinary are those of the calibration: each is compared with the others."]
    return [order, alone, whole, *(known if ordinary else [])]


def drives_csv(series: DriveSeries) -> str:
    """The table for spreadsheets, under :data:`CSV_HEADER`."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(CSV_HEADER)
    for place, row in enumerate(series.rows, 1):
        start = [place, row.drive, row.sha256, row.started or "", _plain(row.minutes), int(row.refused)]
        start += [" ".join(row.verdict), "" if row.complete is None else int(row.complete), _plain(row.probability)]
        sizes = [(item.name, name, size) for item in row.findings for name, size in item.parameters.items()]
        for effect, name, size in sizes:
            low, high = size.interval or (None, None)
            writer.writerow([*start, effect, name, size.value, _plain(low), _plain(high), size.unit, row.sentence])
        if not sizes:
            writer.writerow([*start, "", "", "", "", "", "", row.sentence])
    return stream.getvalue()


def _plain(value: float | None) -> str:
    return "" if value is None else f"{value:.6g}"
