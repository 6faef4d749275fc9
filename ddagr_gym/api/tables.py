"""Recordings from tables (pandas, pyarrow, mappings of columns) and back.

Neither library is imported to look at a value: one that is not loaded has made no table.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.channels import CHANNELS
from ddagr_gym.recordings.schema import Recording

VALID = "command_valid"
"""Column that says where the commands are what the robot received."""


def is_table(given: Any) -> bool:
    """Whether this is a pandas.DataFrame, a pyarrow.Table or a mapping of columns."""
    return isinstance(given, Mapping) or _is(given, "pandas", "DataFrame") or _is(given, "pyarrow", "Table")


def _is(given: Any, library: str, name: str) -> bool:
    loaded = sys.modules.get(library)
    return loaded is not None and isinstance(given, getattr(loaded, name))


def recording_of_table(table: Any, source: str) -> Recording:
    """Recording from a table whose columns have the schema's names, units and signs.

    Args:
        table: pandas.DataFrame, pyarrow.Table, or a mapping of columns. ``t`` [s] is a column: an index is not taken
            for the time. NaN and missing values mean that a channel has no new sample. Columns outside the schema are
            kept beside the channels where they are numbers.
        source: name in the meta data, where the table carries none of its own.

    Raises:
        InputError: no ``t``, no channel of the schema, a column that holds no numbers, a time that does not increase.
    """
    from ddagr_gym.recordings.storage import is_recording_table, recording_of_arrow

    if _is(table, "pyarrow", "Table") and is_recording_table(table):
        return recording_of_arrow(table, source)
    names = _names(table)
    if "t" not in names:
        raise InputError(
            f"{source} has no column 't' (time in seconds), only {', '.join(names) or 'none'}: add it; an index is "
            "not taken for the time."
        )
    if not set(names) & set(CHANNELS):
        raise InputError(f"{source} has no column of the schema, such as {', '.join(CHANNELS)}: rename its columns.")
    columns, left_out = _columns(table, source)
    valid = columns.pop(VALID, None)
    notes = [f"the columns {', '.join(left_out)} hold no numbers and are left out."] if left_out else []
    return Recording.from_columns(
        columns, source=source, command_valid=None if valid is None else np.nan_to_num(valid) != 0.0, notes=notes
    )


def _keys(table: Any) -> list[Any]:
    """Names of the columns as the table has them, which need not be texts."""
    return list(table) if isinstance(table, Mapping) else list(getattr(table, "column_names", table.columns))


def _names(table: Any) -> list[str]:
    names = [str(key) for key in _keys(table)]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(f"the table has the column {twice[0]!r} twice: leave one out.")
    return names


def _columns(table: Any, source: str) -> tuple[dict[str, NDArray[np.float64]], list[str]]:
    """Columns as floats, and the names of those outside the schema that hold no numbers."""
    found: dict[str, NDArray[np.float64]] = {}
    left_out: list[str] = []
    for key in _keys(table):
        name = str(key)
        try:
            found[name] = _numbers(table[key])
        except (TypeError, ValueError):
            if name in ("t", VALID, *CHANNELS):
                unit = "s" if name == "t" else CHANNELS[name].unit if name in CHANNELS else "true or false"
                raise InputError(f"the column {name!r} of {source} holds no numbers: give it in {unit}.") from None
            left_out.append(name)
    return found, left_out


def _numbers(column: Any) -> NDArray[np.float64]:
    """(n,) floats; missing values are NaN. Times of day and texts raise TypeError or ValueError."""
    kind = column.dtype.kind if hasattr(column, "dtype") else np.asarray(column).dtype.kind
    if kind not in "fiubO":
        raise TypeError(f"a column of kind {kind!r}")
    values = column.to_numpy(dtype=object, na_value=np.nan) if _is(column, "pandas", "Series") else np.asarray(column)
    if values.dtype.kind == "O":
        if any(isinstance(value, str) for value in values):
            raise TypeError("a column of texts")
        values = np.array([np.nan if value is None else value for value in values])
    return np.asarray(values, dtype=np.float64)


def pandas_of(columns: Mapping[str, NDArray[np.float64]]) -> Any:
    """Columns as a pandas.DataFrame.

    Raises:
        ModuleNotFoundError: pandas is not installed.
    """
    import pandas

    return pandas.DataFrame(dict(columns))
