"""Stretches of a drive in which the sensors of motion report: no check joins what lies on both sides of a silence.

Across a silence of seconds nobody knows how far the wheels rolled or the robot turned. A line drawn through it would be
taken for a reading, and made sound sensors suspicious.
"""

from __future__ import annotations

from collections.abc import Iterator
from weakref import WeakKeyDictionary

import numpy as np

from ddagr_gym.recordings.schema import BoolArray, FloatArray, Ranges, Recording

MOTION = ("yaw_rate", "encoder_right", "encoder_left", "specific_force_x", "specific_force_y")
"""Channels that are integrated, carried forward or smoothed."""

LONGEST_WAIT = 2.0
"""Longest wait for a sample that is no silence [s]; 1.25 s while driving on the open recordings."""

_LONGEST_WAIT_IN_PERIODS = 12.0
"""The same in median waits of the channel, where that is longer (ours)."""

_MOST = 0.5
"""Share of the driving time in silences above which a channel has none: it reports changes only (ours; a Husky whose
wheels turn steadily, at a speed of few digits, has 0.92)."""

_KNOWN: WeakKeyDictionary[Recording, Ranges] = WeakKeyDictionary()


def longest_wait(median: float) -> float:
    """Longest wait for a sample that is no silence [s].

    Args:
        median: wait of the channel [s].
    """
    return max(LONGEST_WAIT, _LONGEST_WAIT_IN_PERIODS * median)


def heard_spans(recording: Recording) -> Iterator[slice]:
    """Spans cut at silences of the channels of :data:`MOTION`: rows in order, those of a silence in none.

    Before a channel's first sample of a span and after its last one nothing is cut. Encoders may report changes only:
    nothing is cut where the robot is commanded to stand, nor of a channel that is silent for most of the driving time.

    Args:
        recording: any.
    """
    if recording not in _KNOWN:
        _KNOWN[recording] = tuple(_heard(recording))
    return (slice(first, stop) for first, stop in _KNOWN[recording])


def heard_rows(recording: Recording) -> BoolArray:
    """Rows that are in a heard span (n,)."""
    heard = np.zeros(len(recording), dtype=bool)
    for span in heard_spans(recording):
        heard[span] = True
    return heard


def _heard(recording: Recording) -> Iterator[tuple[int, int]]:
    silent, driven = np.zeros(len(recording), dtype=bool), _driven(recording)
    for name in MOTION:
        for last, following in _silences(recording, recording[name], driven):
            silent[last + 1 : following] = True
    for span in recording.spans():
        edges = np.flatnonzero(np.diff(np.concatenate([[True], silent[span], [True]]))) + span.start
        yield from zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)


def _driven(recording: Recording) -> FloatArray:
    """Time until each row that is not commanded standstill (n,) [s]; only differences inside spans count."""
    right, left = recording.held_commands()
    driving = ~((right == 0.0) & (left == 0.0))
    return np.concatenate([[0.0], np.cumsum(np.diff(recording.t) * driving[1:])])


def _silences(recording: Recording, values: FloatArray, driven: FloatArray) -> Iterator[tuple[int, int]]:
    """Rows of the last sample before a silence and of the first one after it, in one span."""
    rows = [span.start + np.flatnonzero(np.isfinite(values[span])) for span in recording.spans()]
    waits = np.concatenate([np.empty(0), *(np.diff(recording.t[known]) for known in rows)])
    longest = longest_wait(float(np.median(waits))) if waits.size else np.inf
    between = [np.diff(driven[known]) for known in rows]
    every = np.concatenate([np.empty(0), *between])
    if every[every > longest].sum() > _MOST * every.sum():
        return
    for known, wait in zip(rows, between, strict=True):
        yield from ((int(known[k]), int(known[k + 1])) for k in np.flatnonzero(wait > longest))
