"""Putting streams with clocks of their own onto one time base without inventing samples."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.channels import COMMANDS
from ddagr_gym.recordings.schema import FloatArray

IndexArray = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Stream:
    """Samples of one source.

    Attributes:
        t: time stamps [s], (n,), in any order.
        channels: arrays (n,) by schema name.
    """

    t: FloatArray
    channels: Mapping[str, FloatArray]

    def sorted(self) -> Stream:
        """Stream in the order of time with every stamp once (the first sample of equal stamps)."""
        order = np.argsort(self.t, kind="stable")
        keep = order[np.concatenate([[True], np.diff(self.t[order]) > 0])] if order.size else order
        return Stream(self.t[keep], {name: values[keep] for name, values in self.channels.items()})


def nearest_rows(base: FloatArray, t: FloatArray, tolerance: float) -> tuple[IndexArray, IndexArray]:
    """Match samples to rows: each sample to its nearest row, each row to its nearest sample.

    A sample that is further than ``tolerance`` from every row is lost, and so is one whose row has a nearer
    sample; no sample is used twice and none is interpolated.

    Args:
        base: times of the rows [s], increasing.
        t: times of the samples [s], increasing.
        tolerance: largest distance [s].

    Returns:
        rows and samples: equally long integer index arrays.
    """
    if not base.size or not t.size:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    right = np.clip(np.searchsorted(base, t), 1, max(len(base) - 1, 1))
    left = right - 1
    right = np.minimum(right, len(base) - 1)
    row = np.where(np.abs(base[right] - t) < np.abs(t - base[left]), right, left)
    distance = np.abs(base[row] - t)
    samples = np.flatnonzero(distance <= tolerance)
    # Nearest sample first within each row; then keep the first of every row.
    order = samples[np.lexsort((distance[samples], row[samples]))]
    first = np.concatenate([[True], np.diff(row[order]) > 0]) if order.size else np.empty(0, dtype=bool)
    return row[order[first]], order[first]


def _with_held(
    base: FloatArray, t: FloatArray, tolerance: float, rows: IndexArray, samples: IndexArray
) -> tuple[IndexArray, IndexArray]:
    """Matches with those of commands that are far from every row: the last one before a free row is held there."""
    far = np.setdiff1d(np.arange(len(t)), samples)
    later = np.searchsorted(base, t[far])
    inside = later < len(base)
    far, later = far[inside], later[inside]
    last = np.append(np.diff(later) > 0, True) if far.size else np.empty(0, dtype=bool)
    free = last & (base[later] - t[far] > tolerance) & ~np.isin(later, rows)
    return np.concatenate([rows, later[free]]), np.concatenate([samples, far[free]])


def regular_base(start: float, stop: float, rate: float, most_rows: int) -> FloatArray:
    """Rows at a fixed rate.

    Args:
        start: first row [s].
        stop: last row not after this [s].
        rate: rows per second [Hz].
        most_rows: limit.

    Raises:
        InputError: a rate that is not positive, or more rows than the limit.
    """
    if not rate > 0:
        raise InputError(f"the rate is {rate:g} Hz: give rows per second above 0.")
    count = (stop - start) * rate + 1
    if not count <= most_rows:
        raise InputError(
            f"{stop - start:.3g} s at {rate:g} Hz are {count:.3g} rows, above {most_rows:,}: lower the rate, cut the "
            "drive, or raise --maximum-rows."
        )
    return start + np.arange(int(count)) / rate


def align(
    base: FloatArray, streams: Mapping[str, Stream], tolerance: float
) -> tuple[dict[str, FloatArray], dict[str, int]]:
    """Channels of several streams on the rows of one time base.

    Args:
        base: times of the rows [s], (n,), increasing.
        streams: by role; a channel of a later stream does not overwrite one of an earlier stream.
        tolerance: largest distance between a sample and its row [s].

    Returns:
        channels (n,) by name, NaN where a stream has no sample near a row; and how many samples of each role
        found no row of their own. A command holds until the next one: with no row near it, it stands at the first
        one after it, unless a later command does.
    """
    channels: dict[str, FloatArray] = {}
    lost = {}
    for role, stream in streams.items():
        ordered = stream.sorted()
        rows, samples = nearest_rows(base, ordered.t, tolerance)
        if set(ordered.channels) <= set(COMMANDS):
            rows, samples = _with_held(base, ordered.t, tolerance, rows, samples)
        lost[role] = len(stream.t) - len(rows)
        for name, values in ordered.channels.items():
            if name not in channels:
                channels[name] = np.full(len(base), np.nan)
                channels[name][rows] = values[samples]
    return channels, lost
