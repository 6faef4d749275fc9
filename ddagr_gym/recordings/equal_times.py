"""Rows of a table with one time stamp: those of several sensors are one row, those that say nothing new are none."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from ddagr_gym.recordings.schema import FloatArray

BoolArray = npt.NDArray[np.bool_]


def joined_rows(numbers: Mapping[str, FloatArray], repeated: BoolArray) -> tuple[dict[str, FloatArray], BoolArray]:
    """Columns with one row for each time.

    Args:
        numbers: columns (n,), NaN where a field is empty.
        repeated: (n,) rows with the time of the row before.

    Returns:
        Columns (m,): of every time the first value that is not empty; and (n,) repeated rows that hold such a value.
    """
    starts = np.flatnonzero(~repeated)
    joined, adding = {}, np.zeros(repeated.size, dtype=bool)
    for name, column in numbers.items():
        rows = np.where(np.isfinite(column), np.arange(column.size), column.size)
        first = np.minimum.reduceat(rows, starts) if column.size else rows
        found = first < column.size
        joined[name] = np.where(found, column[np.minimum(first, column.size - 1)], column[starts])
        adding[first[found]] = True
    return joined, adding & repeated
