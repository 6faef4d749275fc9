"""Reference tables: columns of a CSV as arrays, each mistake in the file one sentence."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.files import read_named_text

LARGEST = 500_000_000
"""Size of a table that is read, at most [bytes] (ours)."""

_OTHER = "it is not the reference table expected here"


def read_columns(
    path: str | Path, numbers: Sequence[str], texts: Sequence[str] = ()
) -> tuple[dict[str, NDArray[np.float64]], dict[str, list[str]]]:
    """Columns of a CSV with a header.

    Args:
        path: the file.
        numbers: names of the columns to read as float64, (rows,) each.
        texts: names of the columns to read as text.

    Raises:
        InputError: the file is missing, no ordinary file or empty, lacks a column, or holds something that is no
            number.
    """
    file = Path(path)
    reader = csv.DictReader(io.StringIO(read_named_text(file, LARGEST, "give the folder of the reference data")))
    try:
        missing = [name for name in (*numbers, *texts) if name not in (reader.fieldnames or ())]
        rows = [] if missing else list(reader)
    except csv.Error as error:
        raise InputError(f"{file} is not a CSV file ({error}): {_OTHER}.") from None
    if missing:
        raise InputError(f"{file} has no column {missing[0]!r}: {_OTHER}.")
    if not rows:
        raise InputError(f"{file} has no rows: {_OTHER}.")
    values = {name: np.array([_number(file, i, name, row[name]) for i, row in enumerate(rows)]) for name in numbers}
    return values, {name: [row[name] for row in rows] for name in texts}


def _number(file: Path, index: int, name: str, text: str | None) -> float:
    try:
        return float(text or "")
    except ValueError:
        raise InputError(f"{file} holds {text!r} in row {index + 1}, column {name}: give a number.") from None


def root_mean_square(values: NDArray[np.float64]) -> float:
    """Root of the mean square, NaN for none."""
    return float(np.sqrt(np.mean(values**2))) if values.size else float("nan")
