"""CSV files that span several pieces: the same rows as in one, numbers of rows, and an end to every error."""

from __future__ import annotations

import gzip
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.column_map import ColumnMap, ColumnSource, TimeSource
from ddagr_gym.recordings.conversion import RawTable
from ddagr_gym.recordings.csv_pieces import PIECE
from ddagr_gym.recordings.csv_reader import read_csv

MAP = ColumnMap(TimeSource("t"), {"yaw_rate": ColumnSource("gz")}, name="small")
HEADER = "t,gz,other\n"
ROWS = 200_000
BODY = "".join(f"{i},{i % 7},left" + "\n" for i in range(ROWS))
assert len(BODY) > 2 * PIECE


def read(tmp_path: Path, data: str | bytes) -> RawTable:
    path = tmp_path / "run.csv"
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    return read_csv(path, MAP)


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r", "\n\n", "\r\n\r\n"])
@pytest.mark.parametrize("start", ["", "\ufeff"])
def test_rows_of_many_pieces_come_in_order_whatever_ends_a_line(tmp_path, start, end):
    table = read(tmp_path, (start + HEADER + BODY.replace("\n", end)).removesuffix(end))
    np.testing.assert_array_equal(table.numbers["t"], np.arange(ROWS))
    np.testing.assert_array_equal(table.numbers["gz"], np.arange(ROWS) % 7)


@pytest.mark.parametrize("body", ["", "\n", "\r\n\n", "\n" * (2 * PIECE)])
@pytest.mark.parametrize("header", ["t,gz,other\n", "\ufefft,gz,other\r\n"])
def test_a_header_without_rows_gives_no_rows(tmp_path, header, body):
    assert read(tmp_path, header + body).numbers["t"].size == 0


def test_a_header_without_a_line_end_gives_no_rows(tmp_path):
    assert read(tmp_path, "t,gz,other").numbers["t"].size == 0


@pytest.mark.parametrize("before", [0, 10, ROWS])
@pytest.mark.parametrize(
    ("line", "words"), [("5,6", "Expected 3 columns, got 2"), ("5,fast,x", "invalid value 'fast'")]
)
def test_errors_name_the_row_below_the_header(tmp_path, before, line, words):
    good = "".join(BODY.splitlines(keepends=True)[:before])
    with pytest.raises(InputError, match=rf"row {before + 1} below the header: .*{words}"):
        read(tmp_path, f"{HEADER}{good}{line}\n{BODY}")


@pytest.mark.parametrize(("before", "end"), [("", "\n"), (BODY, ""), (BODY, "\n" + BODY)])
def test_a_line_without_end_is_named_by_the_row_before(tmp_path, before, end):
    row = f"row {before.count(chr(10))} below the header" if before else "the header"
    with pytest.raises(InputError, match=rf"is not a sound CSV file \(the line after {row} has 1,048,576 bytes"):
        read(tmp_path, HEADER + before + "x" * PIECE + end)


def test_a_line_that_fills_most_of_a_piece_is_read(tmp_path):
    table = read(tmp_path, f"{HEADER}{BODY}{ROWS},1,{'x' * (PIECE - 100)}\n{ROWS + 1},2,y")
    np.testing.assert_array_equal(table.numbers["t"], np.arange(ROWS + 2))


def test_a_quoted_field_may_hold_a_line_end_inside_a_piece(tmp_path):
    table = read(tmp_path, f'{HEADER}0,1,"a\nb"\n1,2,"say ""no"""\n2,3,19" wheel\n')
    np.testing.assert_array_equal(table.numbers["gz"], [1, 2, 3])


@pytest.mark.parametrize("end", ['"x\n', '"x', '"x\n' + "0,1,y\n" * 5])
def test_a_quote_that_is_not_closed_swallows_no_rows(tmp_path, end):
    with pytest.raises(InputError, match="the quoted field in row 2 below the header does not end with its line"):
        read(tmp_path, f"{HEADER}0,1,19 inch\n1,2,{end}")


def test_a_quoted_line_end_between_two_pieces_is_refused(tmp_path):
    filler = "0,1," + "x" * (PIECE - len("0,1,\n") - 20) + "\n"
    with pytest.raises(InputError, match="the quoted field in row 2 below the header does not end with its line"):
        read(tmp_path, f'{HEADER}{filler}1,2,"a\n{"b" * 40}"\n2,3,c\n')


GOOD = "0,1,left\n1,2,left\n"
DAMAGED = {"endless line": GOOD + "x" * (24 * PIECE), "wrong number of fields": f"{GOOD}5,6\n{BODY * 8}"}
"""Damage near the beginning of much text, so that a thread which reads ahead would still be reading."""


@pytest.mark.parametrize("damage", DAMAGED)
def test_damage_in_a_packed_file_never_aborts_the_program(tmp_path, damage):
    path, column_map = tmp_path / "run.csv.gz", tmp_path / "own.yaml"
    path.write_bytes(gzip.compress((HEADER + DAMAGED[damage]).encode(), 1))
    column_map.write_text("time: {column: t}\nchannels: {yaw_rate: {column: gz}}\n")
    words = [sys.executable, "-m", "ddagr_gym", "check", str(path), "--map", str(column_map)]
    for _ in range(3):  # an abort depends on which thread ends first
        done = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
        assert done.returncode == 2, done.stderr
        assert done.stderr.count("\n") == 1
        assert "is not a sound CSV file" in done.stderr
