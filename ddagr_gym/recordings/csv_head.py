"""Head of a CSV file: its columns, and how its fields, numbers and times are written."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.files import DEFAULT_LIMITS, Limits, open_text

DELIMITERS = (",", ";", "\t")
"""Between fields; the one that a header line has most of, outside of quotes, is the file's."""

_READ = 64 * 1024
"""Bytes of a file that say how it is written (ours); a header line beyond them names no columns."""

_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
_DECIMAL_POINT = re.compile(r"[+-]?\d*\.\d+([eE][+-]?\d+)?")
_TIME_STAMP = re.compile(r"\d{4}-\d\d-\d\d[Tt ]\d\d:\d\d(:\d\d([.,]\d+)?)?\s*(?P<zone>[Zz]|UTC|GMT|[+-]\d\d(:?\d\d)?)?")


@dataclass(frozen=True)
class CsvHead:
    """What the first lines of a CSV file say.

    Attributes:
        names: of the columns.
        delimiter: between fields.
        rows: fields of the first rows.
    """

    names: tuple[str, ...]
    delimiter: str
    rows: tuple[tuple[str, ...], ...]

    def decimal_sign(self, columns: Iterable[str]) -> str:
        """Point or comma in the numbers of some columns; behind semicolons a comma where no number has either."""
        fields = [field for name in columns for field in self._fields(name)]
        if any(map(_DECIMAL_POINT.fullmatch, fields)):
            return "."
        return "," if self.delimiter == ";" or any(map(_DECIMAL_COMMA.fullmatch, fields)) else "."

    def time_zones(self, columns: Iterable[str]) -> dict[str, bool]:
        """Whether they say their time zone, of those columns that begin with a date and a time of day (ISO 8601)."""
        first = ((name, next((field for field in self._fields(name) if field), "")) for name in columns)
        found = ((name, _TIME_STAMP.fullmatch(field)) for name, field in first)
        return {name: stamp["zone"] is not None for name, stamp in found if stamp}

    def _fields(self, name: str) -> Iterator[str]:
        if name in self.names:
            place = self.names.index(name)
            yield from (row[place].strip() for row in self.rows if place < len(row))


def csv_head(path: Path, limits: Limits = DEFAULT_LIMITS, delimiter: str = "") -> CsvHead:
    """Read the head of a CSV file.

    Args:
        path: plain or gzip CSV with a header line.
        limits: on rows and bytes.
        delimiter: between fields; "" for that of :data:`DELIMITERS` which the header has most of.

    Raises:
        InputError: no text, no header, or a name that occurs twice.
    """
    header, lines = _first_lines(path, limits)
    chosen = delimiter or max(DELIMITERS, key=re.sub('"[^"]*"', "", header).count)
    names = tuple(name.strip() for name in next(csv.reader([header], delimiter=chosen), []))
    _check_names(path, names)
    rows = tuple(tuple(row) for row in csv.reader(lines, delimiter=chosen) if row)
    return CsvHead(names, chosen, rows)


def _first_lines(path: Path, limits: Limits) -> tuple[str, list[str]]:
    """Header, and the whole lines that are read with it; InputError where they are no text."""
    with open_text(path, limits) as stream:
        head = b""
        while len(head) < _READ and (block := stream.read(_READ - len(head))):
            head += block
    line, end, body = head.partition(b"\n")
    if not end and len(head) >= _READ:
        raise InputError(f"{path.name} has no header line with column names: add one.")
    try:
        header = line.decode("utf-8-sig").rstrip("\r")
    except UnicodeDecodeError:
        raise InputError(f"{path.name} is not a text file in UTF-8: give CSV, Parquet, MCAP or a bag.") from None
    if not header.isprintable() and not header.replace("\t", "").isprintable():
        raise InputError(f"{path.name} has unprintable characters in its header: give CSV, Parquet, MCAP or a bag.")
    lines = re.split(r"\r\n|\n|\r", body.decode("utf-8", errors="replace"))
    return header, lines if len(head) < _READ else lines[:-1]


def _check_names(path: Path, names: tuple[str, ...]) -> None:
    if not any(names):
        raise InputError(f"{path.name} has no header line with column names: add one.")
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{path.name} has the column {name!r} twice: rename one.")
