"""The body of a CSV file, read in pieces of whole lines and parsed one after the other."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.csv_head import CsvHead
from ddagr_gym.recordings.files import BoundedStream, damaged

if TYPE_CHECKING:
    import pyarrow as pa

PIECE = 2**20
"""Bytes that are read at once; no line may be as long (ours): about ten thousand rows."""


class PieceParser:
    """Parses a CSV file piece by piece, counting its rows below the header from 1 and without empty lines.

    pyarrow is given bytes, never the Python stream: its reading thread would hold that beyond an error.

    Args:
        path: of the file, for messages.
        head: of the file.
        numbers: columns to parse as numbers.
        texts: columns to parse as text, also where they are among the numbers.
    """

    def __init__(self, path: Path, head: CsvHead, numbers: Sequence[str], texts: Iterable[str]) -> None:
        import pyarrow as pa
        from pyarrow import csv as arrow_csv

        self._path = path
        self._names = head.names
        self._rows = 0
        self._extra_row = head.delimiter.join("0" * len(head.names)).encode()
        self._parse = arrow_csv.ParseOptions(delimiter=head.delimiter)
        self._decimal = head.decimal_sign(numbers)
        kinds = {**dict.fromkeys(numbers, pa.float64()), **dict.fromkeys(texts, pa.string())}
        self._convert = arrow_csv.ConvertOptions(
            include_columns=list(kinds),
            column_types=kinds,
            strings_can_be_null=False,
            decimal_point=self._decimal,
        )

    def batches(self, stream: BoundedStream) -> Iterator[pa.RecordBatch]:
        """Record batches of all rows below the header.

        Args:
            stream: at the beginning of the file.

        Raises:
            InputError: a row that does not parse, a line of :data:`PIECE` bytes, or a quoted field without an end.
        """
        rest = _below_header(stream)
        while block := stream.read(PIECE - len(rest)):
            rest += block
            line = rest.rfind(b"\n") + 1
            end = max(rest.rfind(b"\r", line) + 1, line)
            yield from self._parsed(rest[:end])
            rest = rest[end:]
            if len(rest) == PIECE:
                raise self._unsound(f"the line after {self._row(0)} has {PIECE:,} bytes or more")
        yield from self._parsed(rest)

    def _parsed(self, piece: bytes) -> Iterator[pa.RecordBatch]:
        """Record batches of some whole lines."""
        import pyarrow as pa

        piece = piece.lstrip(b"\r\n")
        if not piece:
            return
        try:
            table = self._table(piece)
            if self._is_open(piece, table.num_rows):
                raise self._unsound(f"the quoted field in {self._row(table.num_rows)} does not end with its line")
        except pa.ArrowException as error:
            reason = re.sub(r"Row #(\d+)", lambda found: self._row(int(found[1])), str(error))
            raise (self._no_number(reason) if "conversion error" in reason else self._unsound(reason)) from None
        self._rows += table.num_rows
        yield from table.to_batches()

    def _is_open(self, piece: bytes, rows: int) -> bool:
        """Whether a quoted field would swallow a row behind the piece.

        Quotes inside unquoted fields are plain text, so an odd number of them alone proves nothing.
        """
        odd = b'"' in piece and piece.count(b'"') % 2 == 1  # to find none is ten times faster than to count
        return odd and self._table(piece + b"\n" + self._extra_row).num_rows == rows

    def _table(self, piece: bytes) -> pa.Table:
        import pyarrow as pa
        from pyarrow import csv as arrow_csv

        options = arrow_csv.ReadOptions(column_names=self._names, block_size=len(piece), use_threads=False)
        return arrow_csv.read_csv(pa.BufferReader(piece), options, self._parse, self._convert)

    def _row(self, later: int) -> str:
        """Place of a row that is ``later`` rows below those that were parsed."""
        row = self._rows + later
        return f"row {row} below the header" if row else "the header"

    def _no_number(self, reason: str) -> InputError:
        sign = {".": "point", ",": "comma"}[self._decimal]
        return damaged(
            self._path, ValueError(reason), "holds something else where a number belongs",
            f"correct it; numbers have a decimal {sign} here, and times may be dates such as 2026-05-04T10:00:00.05",
        )  # fmt: skip

    def _unsound(self, reason: str) -> InputError:
        return damaged(self._path, ValueError(reason), "is not a sound CSV file", "correct or delete that place")


def _below_header(stream: BoundedStream) -> bytes:
    """First bytes below the header line; nothing where the header is all there is."""
    head = b""
    while b"\n" not in head and (block := stream.read(PIECE - len(head))):
        head += block
    return head.partition(b"\n")[2]
