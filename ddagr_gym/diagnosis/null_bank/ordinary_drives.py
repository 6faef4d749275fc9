"""Null drives from real ones in which nothing is wrong: pieces of them, and longer runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ddagr_gym.diagnosis.preprocessing.input_requirements import content_hash
from ddagr_gym.recordings.schema import Recording

_VALID = 0.5
"""Share of a piece's intended length in which the commands must be known (ours)."""


def pieces_of(recording: Recording, length: float) -> list[Recording]:
    """An ordinary drive cut into pieces with about ``length`` [s] of commands, each a null run.

    It is cut at the joints of its segments, a drive of one long segment inside it. Only time in which the commands are
    what the robot received counts; a piece with less than half of it is left out.
    """
    known = np.concatenate([[0.0], np.cumsum(recording.command_valid) * recording.period])
    ends = [end for _, end in recording.meta.segments]
    if len(ends) == 1:
        # half a period early, or sums that round down lie a row late and leave the next piece too short to be cut off
        joints = np.arange(length, known[-1], length) - 0.5 * recording.period
        ends = [*np.searchsorted(known, joints).tolist(), ends[0]]
    pieces, first = [], recording.meta.segments[0][0]
    for end in ends:
        if known[end] - known[first] >= length - recording.period or end == ends[-1]:
            if known[end] - known[first] > _VALID * length:
                pieces.append(cut(recording, first, end))
            first = end
    return pieces


def longer_runs(recording: Recording, length: float) -> list[Recording]:
    """Pieces of an ordinary drive of twice ``length`` [s] and the drive as a whole, where they are not pieces of it.

    Soil and robot are fitted to every run by itself and explain more of a short one: what is left in long ones shows
    how gains grow with the length. They are no further evidence of how often a gate is passed, for they share their
    time with the pieces.
    """
    double = pieces_of(recording, 2.0 * length)
    known = {content_hash(piece) for piece in pieces_of(recording, length)}
    return [run for run in (*double, *([recording] if len(double) > 1 else [])) if content_hash(run) not in known]


def cut(recording: Recording, first: int, last: int) -> Recording:
    """Rows ``first`` to ``last`` (exclusive) of a recording, with time from 0 on."""

    def inside(ranges: Sequence[tuple[int, int]]) -> tuple[tuple[int, int], ...]:
        kept = ((max(a, first) - first, min(b, last) - first) for a, b in ranges)
        return tuple((a, b) for a, b in kept if b > a)

    meta = replace(
        recording.meta,
        start_time=recording.meta.start_time + float(recording.t[first]),
        segments=inside(recording.meta.segments),
        spans=inside(recording.meta.spans),
    )
    rows = slice(first, last)
    return replace(
        recording,
        t=recording.t[rows] - recording.t[first],
        channels={name: values[rows] for name, values in recording.channels.items()},
        command_valid=recording.command_valid[rows],
        meta=meta,
        extras={name: values[rows] for name, values in recording.extras.items()},
    )
