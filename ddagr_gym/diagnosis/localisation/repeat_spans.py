"""When readings repeat: stretches of the recordings in which a sensor gives the same reading again and again."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ddagr_gym.diagnosis.answer.location import EffectLocation, Span
from ddagr_gym.diagnosis.preprocessing.repeated_readings import (
    LEAST_SHARE,
    SENSORS,
    Flags,
    RepeatedReadings,
    channel_groups,
    repeat_runs,
    repeated_rows,
)
from ddagr_gym.diagnosis.wording import EVERYWHERE
from ddagr_gym.recordings.schema import Recording

_LOOK = 1.0
"""Time over which the share of repeats is taken [s] (ours), or four holds where these are longer."""

_ALL = 0.95
"""Share of the time from which a sensor is said to repeat its readings everywhere (ours)."""


def where_readings_repeat(
    recordings: Sequence[Recording], repeated: Sequence[RepeatedReadings], left_out: Sequence[RepeatedReadings] = ()
) -> EffectLocation | None:
    """Stretches in which sensors repeat their readings; None where none does.

    Args:
        recordings: as they were read, repeats included.
        repeated: from :func:`ddagr_gym.diagnosis.preprocessing.repeated_readings.find_repeated_readings`.
        left_out: sensors whose repeats the column map left out: they repeat everywhere.
    """
    if left_out:
        sensors = " and ".join(dict.fromkeys(item.sensor for item in (*repeated, *left_out)))
        return EffectLocation((), 1.0, (), (), None, f"{sensors}: {EVERYWHERE}")
    if not repeated:
        return None
    found = [
        span
        for number, recording in enumerate(recordings)
        for item in repeated
        if recording.has(*SENSORS[item.sensor])
        for span in _spans(number, recording, item)
    ]
    repeats = max(sum(repeats for repeats, _ in found), 1)
    spans = tuple(
        Span(s.recording, s.start, s.end, repeats_ / repeats, s.size, s.deviation)
        for repeats_, s in sorted(found, key=lambda pair: (pair[1].recording, pair[1].start))
    )
    covered = _covered(spans) / max(sum(float(r.t[-1] - r.t[0]) for r in recordings), 1e-12)
    sensors = " and ".join(item.sensor for item in repeated)
    count = "one stretch" if len(spans) == 1 else f"{len(spans)} stretches"
    when = EVERYWHERE if covered >= _ALL else f"in {count}, {100.0 * covered:.0f} % of the time"
    return EffectLocation(spans, min(covered, 1.0), (), (), None, f"{sensors}: {when}")


def _spans(number: int, recording: Recording, item: RepeatedReadings) -> list[tuple[int, Span]]:
    """Stretches of one sensor in one recording with the number of repeats in each, whose shares come later."""
    # channels that are read in turn are repeated alike: the first stands for both
    rows, repeat = repeated_rows(recording, channel_groups(recording, item.sensor)[0])
    if len(rows) < 2:
        return []
    time = recording.t[rows]
    inside = _dense(repeat, float(np.median(np.diff(time))), item.duration)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(int)))
    found = []
    for first, stop in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        hits = first + np.flatnonzero(repeat[first:stop])
        if not len(hits):
            continue
        fresh, last = repeat_runs(repeat[first:stop])
        holds = time[first + last] - time[first + fresh]
        deviation = float(holds.std() / np.sqrt(len(holds))) / item.duration
        start, end = float(time[max(hits[0] - 1, 0)]), float(time[hits[-1]])
        found.append((len(hits), Span(number, start, end, 0.0, float(holds.mean()) / item.duration, deviation)))
    return found


def _dense(repeat: Flags, period: float, duration: float) -> Flags:
    """Samples around which more than :data:`ddagr_gym.diagnosis.preprocessing.repeated_readings.LEAST_SHARE` repeat."""
    length = min(max(round(max(_LOOK, 4.0 * duration) / period), 3), len(repeat))
    window = np.ones(length)
    share = np.convolve(repeat, window, "same") / np.convolve(np.ones(len(repeat)), window, "same")
    return np.asarray(share > LEAST_SHARE)


def _covered(spans: Sequence[Span]) -> float:
    """Seconds that spans cover, overlaps of sensors counted once."""
    total, recording, until = 0.0, -1, 0.0
    for span in spans:
        if span.recording != recording:
            recording, until = span.recording, -np.inf
        total += max(span.end - max(span.start, until), 0.0)
        until = max(until, span.end)
    return total
