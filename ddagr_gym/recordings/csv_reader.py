"""CSV files, plain or gzip, read in pieces of a megabyte with a bound on rows and bytes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.recordings.column_map import ColumnMap
from ddagr_gym.recordings.conversion import RawTable
from ddagr_gym.recordings.csv_head import csv_head
from ddagr_gym.recordings.csv_pieces import PieceParser
from ddagr_gym.recordings.files import DEFAULT_LIMITS, Limits, damaged, open_text
from ddagr_gym.recordings.schema import FloatArray

if TYPE_CHECKING:
    import pyarrow as pa

_DATE_SPELLINGS = (
    (r"^\s+|\s+$", ""),
    ("t", "T"),
    (r"\s*(z|UTC|GMT)$", "Z"),
    (r"\s+([+-][0-9:]+)$", r"\1"),
    (r"[,.]([0-9]{1,9})[0-9]*", r".\1"),
)
"""Patterns in dates with a time of day, and what a parser of ISO 8601 takes in their place."""

_MOST_LABELS = 100_000  # different values of a column that numbers spans (ours): more are readings, not labels


def read_csv(path: Path, column_map: ColumnMap, limits: Limits = DEFAULT_LIMITS) -> RawTable:
    """Columns of a CSV file that a map asks for.

    Args:
        path: plain or gzip CSV with a header line.
        column_map: which columns to read.
        limits: on rows and bytes.

    Raises:
        InputError: missing columns, text where numbers belong, damage, or too large a file.
    """
    head = csv_head(path, limits, column_map.delimiter)
    numbers, labels = wanted_columns(path, column_map, head.names)
    zones = head.time_zones(time_columns(column_map))
    check_unit_of_dates(path, column_map, zones)
    collector = Collector(numbers, labels, limits, path, zones)
    # A column may serve both as a number and as a label; text converts to either.
    parser = PieceParser(path, head, numbers, (*labels, *(name for name in zones if name in numbers)))
    with open_text(path, limits) as stream:
        for batch in parser.batches(stream):
            collector.add(batch)
    return collector.table()


def wanted_columns(
    path: Path, column_map: ColumnMap, names: tuple[str, ...]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Number and label columns of a map that a file has; a lacking column that is not optional is an error."""
    for column in column_map.needed_columns():
        if column not in names and not (column == column_map.time.column and _absolute(column_map, names)):
            error = unknown_name("column", column, names)
            raise InputError(
                f"{path.name} does not fit the map {column_map.name}: {error.args[0].rstrip('.')} in the file; "
                "correct the map or choose another."
            )
    numbers = [c for c in column_map.number_columns() if c in names]
    if _absolute(column_map, names):
        numbers.append(str(column_map.time.absolute_column))
    return tuple(dict.fromkeys(numbers)), tuple(c for c in column_map.label_columns() if c in names)


def time_columns(column_map: ColumnMap) -> tuple[str, ...]:
    """Columns that a map takes time from."""
    time = column_map.time
    return (time.column,) if time.absolute_column is None else (time.column, time.absolute_column)


def check_unit_of_dates(path: Path, column_map: ColumnMap, names: Iterable[str]) -> None:
    """Refuse a unit of time for columns that hold dates or durations, which say their own; InputError."""
    for name in names:
        if column_map.time.unit != "s":
            raise InputError(
                f"column {name!r} of {path.name} holds dates or durations, whose unit is their own, and the column map "
                f"says unit: {column_map.time.unit}: leave unit out under time in the map."
            )


def _absolute(column_map: ColumnMap, names: tuple[str, ...]) -> bool:
    return column_map.time.absolute_column in names


class Collector:
    """Gathers record batches into float arrays and coded labels under the limits.

    Args:
        numbers: columns that become float arrays.
        labels: columns that become codes.
        limits: on rows.
        path: of the file, for messages.
        zones: columns of text that holds dates with a time of day, and whether it says the time zone.
    """

    def __init__(
        self,
        numbers: tuple[str, ...],
        labels: tuple[str, ...],
        limits: Limits,
        path: Path,
        zones: Mapping[str, bool] | None = None,
    ) -> None:
        self._zones = zones or {}
        self._numbers: dict[str, list[FloatArray]] = {name: [] for name in numbers}
        self._labels: dict[str, list[npt.NDArray[np.int64]]] = {name: [] for name in labels}
        self._codes: dict[str, dict[str, int]] = {name: {} for name in labels}
        self._limits = limits
        self._path = path
        self._rows = 0

    def add(self, batch: pa.RecordBatch) -> None:
        """Take the columns of one batch."""
        self._rows += batch.num_rows
        self._limits.check_rows(self._rows, self._path)
        for name, parts in self._numbers.items():
            parts.append(self._floats(name, batch.column(name)))
        for name, codes in self._labels.items():
            codes.append(self._coded(name, batch.column(name)))

    def table(self) -> RawTable:
        """All that was gathered."""
        empty_float, empty_int = np.empty(0), np.empty(0, dtype=np.int64)
        return RawTable(
            {name: np.concatenate(parts or [empty_float]) for name, parts in self._numbers.items()},
            {name: np.concatenate(parts or [empty_int]) for name, parts in self._labels.items()},
            {name: tuple(codes) for name, codes in self._codes.items()},
        )

    def _floats(self, name: str, column: Any) -> FloatArray:
        import pyarrow as pa

        try:
            if name in self._zones:
                column = as_dates(column, zoned=self._zones[name])
            if pa.types.is_temporal(column.type):
                # Time stamps and durations count in the unit of their own type; the map's unit is then seconds.
                kind = pa.duration("ns") if pa.types.is_duration(column.type) else pa.timestamp("ns")
                column = column.cast(kind).cast(pa.int64())
                values = column.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False) * 1e-9
            else:
                column = column.cast(pa.float64(), safe=False)
                values = column.to_numpy(zero_copy_only=False)
        except pa.ArrowException as error:
            raise damaged(self._path, error, f", column {name}, does not hold numbers", "correct it") from None
        return np.array(values, dtype=np.float64)

    def _coded(self, name: str, column: Any) -> npt.NDArray[np.int64]:
        import pyarrow as pa

        known = self._codes[name]
        encoded = column.cast(pa.string()).fill_null("").dictionary_encode()
        local = [known.setdefault(str(text), len(known)) for text in encoded.dictionary.to_pylist()]
        if len(known) > _MOST_LABELS:
            raise InputError(
                f"{self._path.name}, column {name}, has more than {_MOST_LABELS} different values: it cannot number "
                "pieces or states; correct the map."
            )
        codes = np.asarray(encoded.indices.to_numpy(zero_copy_only=False), dtype=np.int64)
        return np.asarray(local, dtype=np.int64)[codes] if local else codes


def as_dates(column: pa.StringArray, *, zoned: bool) -> pa.TimestampArray:
    """Text with dates and times of day as times; empty where the text is.

    Args:
        column: as ISO 8601, also with a decimal comma, more than nine digits, small letters or a name of the zone.
        zoned: whether it says the time zone.
    """
    import pyarrow as pa
    from pyarrow import compute

    for pattern, replacement in _DATE_SPELLINGS:
        column = compute.replace_substring_regex(column, pattern=pattern, replacement=replacement)
    column = compute.if_else(compute.equal(column, ""), None, column)
    return column.cast(pa.timestamp("ns", "UTC" if zoned else None))
