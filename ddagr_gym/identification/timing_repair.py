"""Recordings made even before they are cut: joins bridged by empty rows, late poses moved to their own time."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.recordings.schema import FloatArray, Ranges, Recording

LONGEST_BRIDGE = 0.25
"""Longest time without rows inside a span that is bridged [s]; a robot hardly changes its motion meanwhile (ours)."""

POSE_CHANNELS = ("pose_x", "pose_y", "pose_yaw")


def bridged(recording: Recording, longest: float = LONGEST_BRIDGE) -> Recording:
    """Recording whose segments run on over short joins inside a span, on rows without samples.

    Rows are added at the recording's period between segments of one span that are at most ``longest`` apart. They hold
    NaN in every channel; commands count there where they count on both sides, so that they stay in force. Nothing is
    interpolated, and spans are never joined.

    Args:
        recording: any.
        longest: time between the last row of a segment and the first of the next [s].
    """
    segments = list(recording.meta.segments)
    starts = [a for a, _ in recording.meta.spans]
    span_of = [bisect_right(starts, s[0]) - 1 for s in segments]
    rows: list[NDArray[np.float64]] = []
    times: list[FloatArray] = []
    joined: list[tuple[int, int]] = []
    count, period = 0, recording.period
    for k, (start, stop) in enumerate(segments):
        gap = recording.t[start] - recording.t[segments[k - 1][1] - 1] if k and span_of[k] == span_of[k - 1] else np.inf
        missing = round(gap / period) - 1 if gap <= longest + 0.5 * period else 0
        if missing > 0:
            rows.append(np.full(missing, np.nan))
            times.append(recording.t[start] - period * np.arange(missing, 0, -1.0))
            count += missing
        first = joined.pop()[0] if missing > 0 else count
        rows.append(np.arange(start, stop, dtype=np.float64))
        times.append(recording.t[start:stop])
        count += stop - start
        joined.append((first, count))
    if count == len(recording):
        return recording
    return _with_rows(recording, np.concatenate(rows), np.concatenate(times), tuple(joined))


def _with_rows(recording: Recording, rows: FloatArray, t: FloatArray, segments: Ranges) -> Recording:
    """Recording of chosen rows; NaN stands for a new one."""
    known = np.isfinite(rows)
    source = np.where(known, rows, 0).astype(np.int64)
    channels = {name: np.where(known, values[source], np.nan) for name, values in recording.channels.items()}
    extras = {name: np.where(known, values[source], np.nan) for name, values in recording.extras.items()}
    forward = np.maximum.accumulate(np.where(known, np.arange(len(rows)), 0))
    backward = np.minimum.accumulate(np.where(known, np.arange(len(rows)), len(rows) - 1)[::-1])[::-1]
    valid = recording.command_valid[source[forward]] & recording.command_valid[source[backward]]
    edges = np.searchsorted(source[known], [[a, b - 1] for a, b in recording.meta.spans])
    spans = tuple((int(np.flatnonzero(known)[a]), int(np.flatnonzero(known)[b]) + 1) for a, b in edges)
    note = f"{np.count_nonzero(~known)} rows without samples were put into joins of segments."
    meta = replace(recording.meta, segments=segments, spans=spans, notes=(*recording.meta.notes, note))
    return Recording(t, channels, valid, meta, extras)


def aligned_poses(recording: Recording, lateness: float) -> Recording:
    """Recording whose poses stand at the rows at which they were true.

    Args:
        recording: any.
        lateness: time by which poses come late [s], the same throughout; poses from before a span are lost.
    """
    present = [name for name in POSE_CHANNELS if name in recording.channels]
    if lateness == 0.0 or not present:
        return recording
    moved = {name: np.full(len(recording), np.nan) for name in present}
    has_pose = np.any([np.isfinite(recording[name]) for name in present], axis=0)
    for span in recording.spans():
        rows = span.start + np.flatnonzero(has_pose[span])
        at = recording.t[rows] - lateness
        target = span.start + np.searchsorted(recording.t[span], at - 0.5 * recording.period)
        inside = (target < span.stop) & (at >= recording.t[span.start] - 0.5 * recording.period)
        for name in present:
            moved[name][target[inside]] = recording[name][rows[inside]]
    note = f"poses were moved to {lateness:.3g} s earlier rows."
    meta = replace(recording.meta, notes=(*recording.meta.notes, note))
    return replace(recording, channels={**recording.channels, **moved}, meta=meta)
