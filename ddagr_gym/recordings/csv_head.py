"""Head of a CSV file: its columns, and how its fields and numbers are written."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.files import DEFAULT_LIMITS, Limits, open_text

DELIMITERS = (",", ";", "\t")
"""Between fields; the one that a header line has most of is the file's."""

_LONGEST_HEADER = 64 * 1024  # bytes (ours): beyond it a first line names no columns
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
_DECIMAL_POINT = re.compile(r"[+-]?\d*\.\d+([eE][+-]?\d+)?")
_TIME_STAMP = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:[\d:.]*(Z|[+-]\d\d(:?\d\d)?)?")


@dataclass(frozen=True)
class CsvHead:
    """What the first lines of a CSV file say.

    Attributes:
        names: of the columns.
        delimiter: between fields.
        decimal_point: of its numbers, "." or ",".
        time_stamps: whether they say their time zone, of columns that begin with a date and a time of day (ISO 8601).
    """

    names: tuple[str, ...]
    delimiter: str
    decimal_point: str
    time_stamps: Mapping[str, bool]


def csv_head(path: Path, limits: Limits = DEFAULT_LIMITS, delimiter: str = "") -> CsvHead:
    """Read the head of a CSV file.

    Args:
        path: plain or gzip CSV with a header line.
        limits: on rows and bytes.
        delimiter: between fields; "" for that of :data:`DELIMITERS` which the header has most of.

    Raises:
        InputError: no text, no header, or a name that occurs twice.
    """
    lines = _first_lines(path, limits)
    delimiter = delimiter or max(DELIMITERS, key=lines[0].count)
    names = tuple(name.strip() for name in next(csv.reader(lines[:1], delimiter=delimiter), []))
    _check_names(path, names)
    rows = [row for row in csv.reader(lines[1:], delimiter=delimiter) if row]
    first = [field.strip() for field in rows[0]] if rows else []
    stamps = {name: _TIME_STAMP.fullmatch(field) for name, field in zip(names, first, strict=False)}
    fields = [field.strip() for row in rows for field in row]
    comma = any(map(_DECIMAL_COMMA.fullmatch, fields)) and not any(map(_DECIMAL_POINT.fullmatch, fields))
    zoned = {name: stamp[1] is not None for name, stamp in stamps.items() if stamp}
    return CsvHead(names, delimiter, "," if comma else ".", zoned)


def _first_lines(path: Path, limits: Limits) -> list[str]:
    """Header and the whole lines that are read with it; InputError where they are no text."""
    with open_text(path, limits) as stream:
        head, ended = b"", False
        while not ended and (b"\n" not in head or len(head) < _LONGEST_HEADER):
            block = stream.read(_LONGEST_HEADER)
            head, ended = head + block, not block
            if b"\n" not in head and len(head) >= _LONGEST_HEADER:
                raise InputError(f"{path.name} has no header line with column names: add one.")
    header, *others = head.replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")
    try:
        text = header.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{path.name} is not a text file in UTF-8: give CSV, Parquet, MCAP or a bag.") from None
    if not text.isprintable() and not text.replace("\t", "").isprintable():
        raise InputError(f"{path.name} has unprintable characters in its header: give CSV, Parquet, MCAP or a bag.")
    whole = others if ended else others[:-1]
    return [text, *(line.decode("utf-8", errors="replace") for line in whole)]


def _check_names(path: Path, names: tuple[str, ...]) -> None:
    if not any(names):
        raise InputError(f"{path.name} has no header line with column names: add one.")
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{path.name} has the column {name!r} twice: rename one.")
