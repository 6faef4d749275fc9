"""Which part of a recording a fit may see, and which part judges it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.recordings.schema import Recording
from ddagr_gym.replay.windows import WindowSet

Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]

MANY_SPANS = 8
"""From so many spans on, spans alternate; with fewer, blocks of time do."""
LONGEST_BLOCK = 40.0
SHORTEST_BLOCK = 3.0
BLOCKS = 4
"""A continuous drive falls into this many blocks at least, of at most LONGEST_BLOCK seconds (a 30 s horizon fits)."""
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
    block = np.zeros(len(recording), dtype=np.int64)
    if len(spans) >= MANY_SPANS:
        for number, span in enumerate(spans):
            block[span] = number + swapped
        return Split(block, f"{len(spans)} spans alternate: {order}, and so on")
    total = sum(float(recording.t[s.stop - 1] - recording.t[s.start]) for s in spans)
    length = min(max(total / BLOCKS, SHORTEST_BLOCK), LONGEST_BLOCK)
    first = int(swapped)
    for span in spans:
        number = ((recording.t[span] - recording.t[span.start]) / length).astype(np.int64)
        block[span] = first + number
        first = int(block[span.stop - 1]) + 1
    return Split(block, f"blocks of {length:.3g} s alternate: {order}, and so on")


def window_blocks(windows: WindowSet, splits: Sequence[Split]) -> Integers:
    """(W,) block of each window, -1 where it lies in two.

    Args:
        windows: cut from the recordings that were split.
        splits: one per recording.
    """
    pairs = zip(windows.recording, windows.start, strict=True)
    first, last = zip(*((splits[r].block[s], splits[r].block[s + windows.samples]) for r, s in pairs), strict=True)
    return np.where(np.equal(first, last), first, -1).astype(np.int64)


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
