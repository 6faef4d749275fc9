"""The answer on many drives: rows in their order, charts, events with names, and one sentence."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.answer.drive_series import (
    BY_NAME,
    BY_TIME,
    PARAMETER,
    STAYS,
    DriveAnswer,
    DriveRow,
    DriveSeries,
    MovedSize,
    SeriesEvent,
    SizeChart,
    SizePoint,
)
from ddagr_gym.diagnosis.answer.verdict import NONE, UNKNOWN
from ddagr_gym.diagnosis.change.ordinary import OrdinaryRobot
from ddagr_gym.diagnosis.change.shifts import LEVEL, distance_at, single_level
from ddagr_gym.diagnosis.result.sentences import RIVAL_WEIGHT
from ddagr_gym.diagnosis.series.change_points import Event, Sizes, change_points
from ddagr_gym.diagnosis.series.control_chart import CHARTS, WEIGHT, Key, control_chart, series_of
from ddagr_gym.diagnosis.series.sentences import series_sentence
from ddagr_gym.version import __version__

Array = NDArray[np.float64]

EARLIEST_CLOCK = 631152000.0
"""Seconds from 1970 to 1990: a smaller clock reading counts from the start of a computer and gives no date."""


def drive_row(drive: str, sha256: str, answer: DriveAnswer | str) -> DriveRow:
    """Row of one drive.

    Args:
        drive: name of its file.
        sha256: of it.
        answer: what was found, or the sentence why it was refused.
    """
    if isinstance(answer, str):
        return DriveRow(drive, sha256, None, None, True, (), None, None, (), answer)
    found = answer.diagnosis
    shifts = found.change.shifts if found.change is not None else ()
    return DriveRow(
        drive, sha256, _date(answer.started), answer.seconds / 60.0, False, found.verdict, found.complete,
        min((item.probability for item in shifts), default=None), found.findings, found.sentence, answer.left_out,
    )  # fmt: skip


def _date(started: float) -> str | None:
    """Date and time of a clock reading [s since 1970]; None where it is none, as after the year 9999."""
    if not started >= EARLIEST_CLOCK:
        return None
    try:
        date = datetime.fromtimestamp(started, UTC)
    except (ValueError, OverflowError, OSError):
        return None
    return date.isoformat(timespec="seconds").replace("+00:00", "Z")


def natural(name: str) -> list[tuple[int, int, str]]:
    """Key by which names sort with their numbers as numbers: drive 2 before drive 10."""
    parts = re.findall(r"\d+|\D+", name)
    return [(0, int(part), "") if part.isdecimal() else (1, 0, part.lower()) for part in parts]


def in_order(rows: Sequence[DriveRow]) -> tuple[str, list[int]]:
    """What drives are ordered by, and their numbers in that order; refused ones have no time and come last by it."""
    answered = [row for row in rows if not row.refused]
    numbers = sorted(range(len(rows)), key=lambda k: natural(rows[k].drive))
    if not answered or any(row.started is None for row in answered):
        return BY_NAME, numbers
    return BY_TIME, sorted(numbers, key=lambda k: rows[k].started or "9999")


def conclude_series(
    rows: Sequence[DriveRow], points: Sequence[Sequence[SizePoint]], order: str, ordinary: OrdinaryRobot, ground: str
) -> DriveSeries:
    """The answer on drives in their order.

    Args:
        rows: of all drives.
        points: of each drive's sizes; none of a refused one.
        order: what they are ordered by.
        ordinary: calibrated robot.
        ground: that all were taken to be on; "" where it was not known.
    """
    series = series_of({number: found for number, found in enumerate(points) if found})
    answered = [number for number, row in enumerate(rows) if not row.refused]
    events = _events(rows, answered, series)
    tests = CHARTS * max(len(answered), 1) * max(len(series), 1)
    charts = _sorted([control_chart(found, tests) for found in series.values()], events)
    made = DriveSeries(
        "", ordinary.robot.name, ordinary.source, ground, tuple(item.drive for item in ordinary.references), order,
        LEVEL, WEIGHT, tuple(rows), charts, events, __version__,
    )  # fmt: skip
    return replace(made, sentence=series_sentence(made))


def _sorted(charts: Sequence[SizeChart], events: Sequence[SeriesEvent]) -> tuple[SizeChart, ...]:
    """Charts of what events moved, in the order of these, then by how far any drive or mean comes towards its limit."""
    moved = [(item.effect, item.size) for event in events for item in event.moved]

    def place(chart: SizeChart) -> tuple[int, float]:
        key = (chart.effect, chart.size)
        farthest = max(max(abs(p.value) / p.limit, abs(p.average) / p.average_limit) for p in chart.points)
        return (moved.index(key) if key in moved else len(moved)), -farthest

    return tuple(sorted(charts, key=place))


def _events(
    rows: Sequence[DriveRow], answered: Sequence[int], series: Mapping[Key, Mapping[int, SizePoint]]
) -> tuple[SeriesEvent, ...]:
    if not series:
        return ()
    sizes = _sizes(answered, series)
    keys, found = list(series), change_points(sizes)
    return tuple(_series_event(event, found, rows, answered, _moved(event, keys, series), sizes) for event in found)


def _series_event(
    event: Event,
    events: Sequence[Event],
    rows: Sequence[DriveRow],
    answered: Sequence[int],
    moved: tuple[MovedSize, ...],
    sizes: Sizes,
) -> SeriesEvent:
    first, kind = event.place.first, event.place.kind(len(answered))
    later = [item.place.first for item in events if item.place.end == len(answered) and item.place.first > first]
    concerned = answered[first : min([event.place.end, *(later if kind == STAYS else [])])]
    return SeriesEvent(
        kind,
        answered[first],
        answered[event.place.end - 1],
        answered[event.earliest],
        answered[event.latest],
        float(event.probabilities.min()),
        _is_small(event, sizes),
        moved,
        len(concerned),
        _names([rows[k] for k in concerned]),
    )


def _sizes(answered: Sequence[int], series: Mapping[Key, Mapping[int, SizePoint]]) -> Sizes:
    shape = (len(answered), len(series))
    values, deviations = np.full(shape, np.nan), np.ones(shape)
    shared, degrees = np.zeros(len(series)), np.ones(len(series))
    for j, points in enumerate(series.values()):
        for k, drive in enumerate(answered):
            if drive in points:
                values[k, j], deviations[k, j] = points[drive].value, points[drive].deviation
        shared[j] = np.mean([point.mean_deviation for point in points.values()])
        degrees[j] = min(point.degrees for point in points.values())
    drawn = np.array([effect == PARAMETER for effect, _ in series])
    return Sizes(values, deviations, shared, degrees, drawn)


def _moved(event: Event, keys: Sequence[Key], series: Mapping[Key, Mapping[int, SizePoint]]) -> tuple[MovedSize, ...]:
    """Sizes that an event moves for sure, and in any case the one that it moves most."""
    distance = np.nan_to_num(np.abs(event.shifts) / event.deviations)
    listed = np.argsort(-distance)
    chosen = [j for place, j in enumerate(listed) if place == 0 or event.probabilities[j] < LEVEL]
    return tuple(_moved_size(event, int(j), next(iter(series[keys[j]].values()))) for j in chosen)


def _moved_size(event: Event, j: int, point: SizePoint) -> MovedSize:
    shift, deviation = float(event.shifts[j]), float(event.deviations[j])
    distance, probability = abs(shift) / deviation, float(event.probabilities[j])
    return MovedSize(point.effect, point.size, point.unit, shift, deviation, distance, probability)


def _usual(event: Event, sizes: Sizes) -> Array:
    """(q,) shifts that a single ordinary drive exceeds in any size in 5 % of the cases."""
    seen = slice(event.place.first, event.place.end)
    known = np.isfinite(sizes.values[seen])
    columns = zip(sizes.deviations[seen].T, known.T, strict=True)
    own = np.array([np.median(deviations[told]) if told.any() else np.inf for deviations, told in columns])
    level = single_level(sizes.values.shape[1])
    quantile = np.array([distance_at(level, 1, float(degrees)) for degrees in sizes.degrees])
    return np.asarray(quantile * np.hypot(own, sizes.mean_deviations))


def _is_small(event: Event, sizes: Sizes) -> bool:
    certain = event.probabilities < LEVEL
    return not bool((np.abs(event.shifts) > _usual(event, sizes))[certain].any())


def _names(rows: Sequence[DriveRow]) -> dict[str, int]:
    """In how many drives an effect is named, or likely what is named, the most frequent first."""
    counts: dict[str, float] = {}
    drives: dict[str, int] = {}
    for row in rows:
        likely: dict[str, float] = {}
        for finding in row.findings:
            for name, weight in {finding.name: 1.0, **finding.equivalence_set}.items():
                if weight >= RIVAL_WEIGHT or name == finding.name:
                    likely[name] = max(likely.get(name, 0.0), weight)
        for name, weight in likely.items():
            counts[name] = counts.get(name, 0.0) + weight
            drives[name] = drives.get(name, 0) + 1
    ordered = sorted(counts, key=lambda name: -counts[name])
    return {name: drives[name] for name in ordered if name not in (NONE, UNKNOWN)}
