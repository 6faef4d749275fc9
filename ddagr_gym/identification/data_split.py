"""Which part of a recording a fit may see, and which part judges it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.windows import WindowSet
from ddagr_gym.recordings.schema import Recording

Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]

MANY_SPANS = 8
"""From so many spans on, spans alternate; with fewer, blocks of time do."""
LONGEST_BLOCK = 40.0
"""Of time, at most [s] (ours: a horizon of 30 s fits, and a long drive has blocks of both parts all along it)."""

SHORTEST_BLOCK = 3.0
"""Of time, at least [s] (ours: a window of 2 s fits)."""

BLOCKS = 4
"""A continuous drive falls into this many blocks at least, of at most LONGEST_BLOCK seconds (a 30 s horizon fits)."""
LEAST_SHARE = 0.2
"""Share of the commanded time that each part must have, else commanded stretches are cut by themselves (ours)."""
CLUSTER = 10.0
"""Time within which errors count as dependent when intervals are resampled [s] (ours)."""


@dataclass(frozen=True, eq=False)
class Split:
    """Blocks of one recording: even ones train, odd ones judge.

    Attributes:
        block: (n,) block of every row.
        rule: in words.
    """

    block: Integers
    rule: str


def split_recording(recording: Recording, swapped: bool = False) -> Split:
    """Alternate spans, or blocks of time where there are few spans; neighbours in time go to different parts.

    Args:
        recording: any.
        swapped: let the parts change their roles, for cross-validation.
    """
    order = "the first judges, the second trains" if swapped else "the first trains, the second judges"
    spans = list(recording.spans())
    if len(spans) >= MANY_SPANS:
        block = np.zeros(len(recording), dtype=np.int64)
        for number, span in enumerate(spans):
            block[span] = number
        return Split(block + swapped, f"{len(spans)} spans alternate: {order}, and so on")
    block, length = _time_blocks(recording, spans)
    rule = f"blocks of {length:.3g} s alternate: {order}, and so on"
    if _lopsided(recording, block):
        commanded = recording.command_valid
        pieces = [slice(a, b) for span in spans for a, b in _stretches(commanded, span)]
        driven, length = _time_blocks(recording, [piece for piece in pieces if commanded[piece.start]])
        block = np.where(commanded, driven + 2 * (int(block.max()) // 2 + 1), block)
        rule += f"; where commands are known, blocks of {length:.3g} s"
    return Split(block + swapped, rule)


def _time_blocks(recording: Recording, pieces: Sequence[slice]) -> tuple[Integers, float]:
    """Blocks (n,) numbered through the pieces, 0 outside them, and their length [s]."""
    block = np.zeros(len(recording), dtype=np.int64)
    total = sum(float(recording.t[s.stop - 1] - recording.t[s.start]) for s in pieces)
    length = min(max(total / BLOCKS, SHORTEST_BLOCK), LONGEST_BLOCK)
    first = 0
    for piece in pieces:
        # the last row ends a block: it does not start one of its own
        time = recording.t[piece] - recording.t[piece.start] - 0.5 * recording.period
        block[piece] = first + np.maximum(time / length, 0.0).astype(np.int64)
        first = int(block[piece.stop - 1]) + 1
    return block, length


def _lopsided(recording: Recording, block: Integers) -> bool:
    """Whether commands are known in a part of the drive only, nearly all of it in one of the two parts."""
    commanded = recording.command_valid
    if commanded.all() or not commanded.any():
        return False
    share = float(np.mean(block[commanded] % 2))
    return not LEAST_SHARE <= share <= 1.0 - LEAST_SHARE


def _stretches(commanded: Booleans, span: slice) -> list[tuple[int, int]]:
    """Rows of a span between which the commands become known or unknown."""
    edges = span.start + 1 + np.flatnonzero(np.diff(commanded[span].astype(np.int8)))
    bounds = [span.start, *edges.tolist(), span.stop]
    return list(pairwise(bounds))


def window_blocks(windows: WindowSet, splits: Sequence[Split]) -> Integers:
    """(W,) block of each window, -1 where it lies in two.

    Args:
        windows: cut from the recordings that were split.
        splits: one per recording.
    """
    rows = [splits[r].block[s : s + windows.samples + 1] for r, s in zip(windows.recording, windows.start, strict=True)]
    return np.array([row[0] if row[0] == row[-1] and not np.ptp(row) else -1 for row in rows], dtype=np.int64)


def training(windows: WindowSet, splits: Sequence[Split]) -> Booleans:
    """(W,) windows that a fit may see."""
    block = window_blocks(windows, splits)
    return np.asarray((block >= 0) & (block % 2 == 0))


def held_out(windows: WindowSet, splits: Sequence[Split]) -> Booleans:
    """(W,) windows that judge."""
    block = window_blocks(windows, splits)
    return np.asarray((block >= 0) & (block % 2 == 1))


def clusters(windows: WindowSet, splits: Sequence[Split]) -> Integers:
    """(W,) windows that lie close together in time share a number: they are resampled together."""
    length = max(CLUSTER, windows.duration)
    pieces = np.floor(windows.time / length).astype(np.int64)
    keys = np.stack([windows.recording, window_blocks(windows, splits), pieces], axis=1)
    return np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1).astype(np.int64)


def evenly(count: int, most: int) -> Integers:
    """Indices of at most ``most`` of ``count`` items, evenly spread."""
    if not count:
        return np.zeros(0, dtype=np.int64)
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))


def parts_of_time(time: NDArray[np.float64], whole: NDArray[np.float64], count: int) -> Integers:
    """Which of so many equally long parts of a whole each time is in.

    Args:
        time: (N,) [s].
        whole: times from the first to the last of which the parts go [s].
        count: of the parts.
    """
    ends = np.linspace(whole.min(), whole.max(), count + 1)[1:-1]
    return np.asarray(np.searchsorted(ends, time), dtype=np.int64)
