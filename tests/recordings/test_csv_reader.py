from __future__ import annotations

import gzip
import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.column_map import ColumnMap, ColumnSource, Pieces, TimeSource, ValidCommands
from ddagr_gym.recordings.csv_head import csv_head
from ddagr_gym.recordings.csv_reader import read_csv
from ddagr_gym.recordings.files import Limits, kind_of
from ddagr_gym.recordings.load import load_recording

MAP = ColumnMap(TimeSource("t"), {"yaw_rate": ColumnSource("gz")}, name="small")
GOOD = "t,gz,other\n0,1.5,a\n0.1,,b\n0.2,nan,c\n0.3,-2e-3,d\n"


def write(tmp_path, data, name="run.csv"):
    path = tmp_path / name
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    return path


def test_numbers_come_through_and_empty_fields_are_nan(tmp_path):
    table = read_csv(write(tmp_path, GOOD), MAP)
    np.testing.assert_array_equal(table.numbers["t"], [0, 0.1, 0.2, 0.3])
    np.testing.assert_array_equal(table.numbers["gz"], [1.5, np.nan, np.nan, -2e-3])
    assert set(table.numbers) == {"t", "gz"}


@pytest.mark.parametrize(
    "data",
    [
        gzip.compress(GOOD.encode(), mtime=0),
        b"\xef\xbb\xbf" + GOOD.encode(),
        GOOD.replace("\n", "\r\n").encode(),
        GOOD.rstrip("\n").encode(),
    ],
    ids=["gzip", "byte order mark", "windows lines", "no last line end"],
)
def test_other_spellings_of_the_same_file(tmp_path, data):
    path = write(tmp_path, data)
    assert csv_head(path).names == ("t", "gz", "other")
    np.testing.assert_array_equal(read_csv(path, MAP).numbers["gz"], [1.5, np.nan, np.nan, -2e-3])


def test_labels_are_coded_by_their_text(tmp_path):
    column_map = ColumnMap(
        TimeSource("t"), MAP.channels, pieces=Pieces(("run",)), command_valid=ValidCommands("state", ("on",))
    )
    table = read_csv(write(tmp_path, "t,gz,run,state\n0,1,7,\n1,1,7,on\n2,1,8,on\n"), column_map)
    assert [table.label_values["run"][c] for c in table.labels["run"]] == ["7", "7", "8"]
    assert [table.label_values["state"][c] for c in table.labels["state"]] == ["", "on", "on"]


@pytest.mark.parametrize(
    "data",
    [
        "t;gz\n0;4\n0.5;-1.5\n",
        "t\tgz\n0\t4\n0.5\t-1.5\n",
        "t;gz;place\n0;4;here\n0,5;-1,5;there\n",
        "gz;t\n4;0\n-1,5;0,5\n",
        't,gz\n"0","4"\n"0,5","-1,5"\n',
        't,gz,pair\n0,4,"1,2"\n0.5,-1.5,"3,4"\n',
        't,gz,"state (off;idle;run;stop)"\n0,4,off\n0.5,-1.5,run\n',
        "t;gz;firmware\n0;4;1.2\n0,5;-1,5;1.2\n",
        't;gz;"a;b"\r\n\r\n0;4;1\r\n0,5;-1,5;2\r\n',
    ],
    ids=[
        "semicolon", "tab", "decimal comma", "another order", "quoted decimal comma", "commas in text",
        "semicolons in a name", "a point in another column", "quotes and an empty first row",
    ],
)  # fmt: skip
def test_delimiters_and_decimal_commas_are_found(tmp_path, data):
    table = read_csv(write(tmp_path, data), MAP)
    np.testing.assert_array_equal(table.numbers["t"], [0.0, 0.5])
    np.testing.assert_array_equal(table.numbers["gz"], [4.0, -1.5])


def test_the_decimal_sign_is_told_by_what_is_read_at_first(tmp_path):
    """The first 64 KB hold whole numbers, and are cut inside the last of them; behind semicolons a comma is likely."""
    whole = "".join(f"{i};{i}\n" for i in range(9000))
    assert len(whole) + 5 > (2**16)
    table = read_csv(write(tmp_path, "t;gz\n" + whole + "9000,5;-1,5\n"), MAP)
    assert (table.numbers["t"][-1], table.numbers["gz"][-1]) == (9000.5, -1.5)
    commas = whole.replace(";", ",")
    table = read_csv(write(tmp_path, "t,gz\n" + commas + "9000.5,-1.5\n"), MAP)
    assert (table.numbers["t"][-1], table.numbers["gz"][-1]) == (9000.5, -1.5)


@pytest.mark.parametrize("filler", range(8))
def test_a_number_that_the_end_of_the_head_cuts_says_nothing(tmp_path, filler):
    """Half of "1.25,x" would be "1", or the text "1,2" of the last column a decimal comma."""
    row = '1.25,7,"1,25"\n'
    rows = "x" * filler + "\n" + row * (2**16 // len(row) + 3)
    table = read_csv(write(tmp_path, "t,gz,x" + rows), MAP)
    assert set(table.numbers["t"]) == {1.25}


def test_a_delimiter_of_the_map_is_kept(tmp_path):
    column_map = ColumnMap(TimeSource("t"), {"yaw_rate": ColumnSource("gz;x")}, delimiter=",")
    np.testing.assert_array_equal(
        read_csv(write(tmp_path, "t,gz;x;y;z,gz;x\n0,9,4\n"), column_map).numbers["gz;x"], [4]
    )


@pytest.mark.parametrize("zone", ["", "Z", "z", " UTC", "+02:00", " +0200"])
@pytest.mark.parametrize(
    "stamp", ["2026-05-04T10:00:00.{}", "2026-05-04 10:00:00,{}00", "2026-05-04t10:00:00.{}0000000000"]
)
def test_dates_with_a_time_of_day_are_seconds(tmp_path, zone, stamp):
    """A row without its time has none, also where it is the first."""
    rows = ";1\n" + "".join(f"{stamp.format(k)}{zone};{k}\n" for k in range(3)) + ";3\n"
    table = read_csv(write(tmp_path, "t;gz\n" + rows), MAP)
    np.testing.assert_allclose(np.diff(table.numbers["t"]), [np.nan, 0.1, 0.1, np.nan], atol=1e-6)
    hours = 8 if "+" in zone else 10
    assert table.numbers["t"][1] == np.datetime64(f"2026-05-04T{hours:02}", "s").astype(np.int64)


def test_dates_have_a_unit_of_their_own(tmp_path):
    path = write(tmp_path, "t,gz\n2026-05-04T10:00:00,1\n2026-05-04T10:00:01,1\n")
    with pytest.raises(InputError, match=r"column 't' of run\.csv holds dates or durations, .* unit: ms"):
        read_csv(path, replace(MAP, time=TimeSource("t", "ms")))


def test_a_file_without_a_number_is_refused(tmp_path):
    with pytest.raises(InputError, match="no channel of the map own holds a number: correct the map"):
        load_recording(write(tmp_path, "t,gz\n0,\n1,nan\n"), own_map(tmp_path))


def test_many_blocks_are_joined_in_order(tmp_path):
    rows = 300_000
    text = "t,gz\n" + "\n".join(f"{i},{i % 97}" for i in range(rows))
    assert len(text) > 2 * 2**20
    table = read_csv(write(tmp_path, text), MAP)
    np.testing.assert_array_equal(table.numbers["t"], np.arange(rows))
    np.testing.assert_array_equal(table.numbers["gz"], np.arange(rows) % 97)


def own_map(tmp_path):
    path = tmp_path / "own.yaml"
    path.write_text("time: {column: t}\nchannels: {yaw_rate: {column: gz}}\n")
    return str(path)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "empty"),
        (b"\n\n", "no header"),
        (b"t,t,gz\n0,0,0\n", "twice"),
        (b"t,other\n0,0\n", "gz"),
        (b"t,gz\n0,fast\n", "fast"),
        (b"t,gz\n0,1\n1,2,3\n", "Expected 2 columns"),
        (b"t,gz\n0,\0\n", "where a number belongs"),
        (b"t,g\0z\n0,1\n", "unprintable"),
        (b"t,gz\r0,1\n0.1,1\n", "unprintable"),
        (b"t;gz\n0;1\n0.5;1,5\n", "invalid value '1,5'.*decimal point"),
        (b"t;gz\n0;1\n0,5;1.5\n", "invalid value '0,5'.*decimal point"),
        (b"t,gz\n4 May 10:00,1\n", "times may be dates such as 2026-05-04T10:00:00.05"),
        (b"t,gz\n0,2026-05-04T10:00:00\n", "where a number belongs"),
        (b"\xff\xfe\x00\x01,,\n", "UTF-8"),
        (b"t,gz\n0,\xff\n", "where a number belongs"),
        (b"x" * 100_000, "no header"),
        (b"PK\x03\x04zip", "zip archive"),
        (gzip.compress(GOOD.encode(), mtime=0)[:-12], "damaged or truncated"),
        (b"\x1f\x8b\x08\x00garbage", "damaged or truncated"),
    ],
)
def test_broken_files_get_one_sentence(tmp_path, data, words):
    path = write(tmp_path, data)
    with pytest.raises(InputError, match=words) as caught:
        read_csv_by_kind(path)
    assert "\n" not in str(caught.value)


def read_csv_by_kind(path):
    kind_of(path)
    return read_csv(path, MAP)


def test_a_line_longer_than_a_block_is_refused(tmp_path):
    data = b"t,gz,other\n0,1," + b"x" * (3 * 2**20) + b"\n"
    with pytest.raises(InputError, match="not a sound CSV"):
        read_csv(write(tmp_path, data), MAP)


def test_a_decompression_bomb_stops_at_the_limit(tmp_path):
    bomb = gzip.compress(b"t,gz\n" + b"0,1\n" * 4_000_000)
    assert len(bomb) < 100_000
    with pytest.raises(InputError, match="--maximum-bytes"):
        read_csv(write(tmp_path, bomb, "bomb.csv.gz"), MAP, Limits(bytes=2**20))


def test_more_rows_than_allowed_are_refused(tmp_path):
    with pytest.raises(InputError, match="--maximum-rows"):
        read_csv(write(tmp_path, GOOD), MAP, Limits(rows=3))


def test_memory_stays_bounded_on_a_file_that_is_refused(tmp_path):
    bomb = write(tmp_path, gzip.compress(b"t,gz\n" + b"0,1\n" * 60_000_000, 1), "bomb.csv.gz")
    small = write(tmp_path, GOOD, "small.csv")
    program = (
        "import resource, sys\n"
        "from ddagr_gym.errors import InputError\n"
        "from ddagr_gym.recordings.load import load_recording\n"
        "try:\n    load_recording(sys.argv[1], sys.argv[2])\n"
        "except InputError as error:\n    assert '--maximum' in str(error)\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)\n"
    )
    peak = [
        int(
            subprocess.run(
                [sys.executable, "-c", program, path, own_map(tmp_path)], capture_output=True, check=True
            ).stdout
        )
        for path in (small, bomb)
    ]
    # The bomb unpacks to 240 MB; two million rows of two columns are 32 MB. ru_maxrss counts kilobytes on Linux.
    assert peak[1] - peak[0] < 130_000


def test_fuzzed_bytes_never_end_in_another_error(tmp_path):
    rng = np.random.default_rng(1)
    plain = (GOOD * 1).encode() + b"".join(f"{i},{i / 7:.4f},z\n".encode() for i in range(1, 60))
    for source in (plain, gzip.compress(plain)):
        for _ in range(150):
            data = bytearray(source)
            for place in rng.integers(0, len(data), rng.integers(1, 12)):
                data[place] = rng.integers(0, 256)
            path = write(tmp_path, bytes(data[: rng.integers(1, len(data) + 1)]))
            try:
                load_recording(path, "concealed" if rng.random() < 0.1 else own_map(tmp_path))
            except InputError as error:
                assert "\n" not in str(error)  # noqa: PT017


@pytest.mark.parametrize("name", ["absent.csv", "a\0b.csv"])
def test_paths_that_cannot_be_read(tmp_path, name):
    with pytest.raises(InputError):
        load_recording(f"{tmp_path}/{name}")


def test_a_pipe_is_not_opened(tmp_path):
    path = tmp_path / "pipe"
    os.mkfifo(path)
    with pytest.raises(InputError, match="not a regular file"):
        load_recording(path)


def test_rows_are_counted_below_the_header_in_every_message(tmp_path):
    own = tmp_path / "own.yaml"
    own.write_text("time: {column: t}\nchannels: {yaw_rate: {column: gz}}\n")
    for third, words in (("2,fast", "row 3 below the header"), (",1", "row 3 has no valid time")):
        path = write(tmp_path, f"t,gz\n0,1\n1,1\n{third}\n3,1\n")
        with pytest.raises(InputError, match=words):
            load_recording(path, str(own))
