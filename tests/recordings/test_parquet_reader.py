from __future__ import annotations

import datetime

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.column_map import ColumnMap, ColumnSource, Pieces, TimeSource
from ddagr_gym.recordings.files import Limits
from ddagr_gym.recordings.load import load_recording
from ddagr_gym.recordings.parquet_reader import parquet_columns, read_parquet

MAP = ColumnMap(TimeSource("t"), {"yaw_rate": ColumnSource("gz")}, name="small")


def write(tmp_path, columns, **options):
    path = tmp_path / "foreign.parquet"
    parquet.write_table(pa.table(columns), path, **options)
    return path


def test_numbers_of_every_type_become_floats(tmp_path):
    path = write(tmp_path, {"t": pa.array([0, 1, 2], pa.int16()), "gz": pa.array([1.5, None, -2], pa.float32())})
    table = read_parquet(path, MAP)
    np.testing.assert_array_equal(table.numbers["t"], [0, 1, 2])
    np.testing.assert_array_equal(table.numbers["gz"], [1.5, np.nan, -2])
    assert parquet_columns(path) == ("t", "gz")


def test_time_stamps_become_seconds(tmp_path):
    start = datetime.datetime(2026, 5, 1, tzinfo=datetime.UTC)
    stamps = [start + datetime.timedelta(milliseconds=20 * i) for i in range(3)]
    table = read_parquet(write(tmp_path, {"t": pa.array(stamps), "gz": [0.0, 0.0, 0.0]}), MAP)
    np.testing.assert_allclose(np.diff(table.numbers["t"]), 0.02, atol=1e-6)


def test_time_stamps_have_a_unit_of_their_own(tmp_path):
    start = datetime.datetime(2026, 5, 1, tzinfo=datetime.UTC)
    stamps = [start + datetime.timedelta(milliseconds=20 * i) for i in range(3)]
    nanoseconds = ColumnMap(TimeSource("t", "ns"), {"yaw_rate": ColumnSource("gz")}, name="small")
    with pytest.raises(InputError, match="leave unit out"):
        read_parquet(write(tmp_path, {"t": pa.array(stamps), "gz": [0.0, 0.0, 0.0]}), nanoseconds)
    path = write(tmp_path, {"t": pa.array([0, 20_000_000], pa.int64()), "gz": [0.0, 0.0]})
    assert read_parquet(path, nanoseconds).numbers["t"].size == 2


@pytest.mark.parametrize("unit", ["s", "ms", "us", "ns"])
def test_durations_become_seconds(tmp_path, unit):
    steps = {"s": 1, "ms": 20, "us": 20_000, "ns": 20_000_000}[unit]
    durations = pa.array([0, steps, None], pa.duration(unit))
    path = write(tmp_path, {"t": durations, "gz": [0.0, 0.0, 0.0]})
    np.testing.assert_allclose(read_parquet(path, MAP).numbers["t"], [0.0, 1.0 if unit == "s" else 0.02, np.nan])
    milliseconds = ColumnMap(TimeSource("t", "ms"), MAP.channels, name="small")
    with pytest.raises(InputError, match=r"holds dates or durations, .* leave unit out"):
        read_parquet(path, milliseconds)


def test_labels_may_be_numbers_or_text(tmp_path):
    path = write(tmp_path, {"t": [0.0, 1.0, 0.0], "gz": [0.0, 0.0, 0.0], "run": [4, 4, 5]})
    table = read_parquet(path, ColumnMap(TimeSource("t"), MAP.channels, pieces=Pieces(("run",))))
    np.testing.assert_array_equal(table.labels["run"], [0, 0, 1])


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({"t": [0.0], "other": [1.0]}, "gz"),
        ({"t": [0.0], "gz": ["fast"]}, "does not hold numbers"),
        ({"t": [0.0], "gz": [[1.0, 2.0]]}, "does not hold numbers"),
    ],
)
def test_tables_that_do_not_fit_get_one_sentence(tmp_path, columns, words):
    with pytest.raises(InputError, match=words):
        read_parquet(write(tmp_path, columns), MAP)


def test_limits_are_read_from_the_footer_before_any_data(tmp_path):
    path = write(tmp_path, {"t": np.arange(1000.0), "gz": np.zeros(1000)})
    with pytest.raises(InputError, match="--maximum-rows"):
        read_parquet(path, MAP, Limits(rows=999))
    with pytest.raises(InputError, match="--maximum-bytes"):
        read_parquet(path, MAP, Limits(bytes=1000))


def test_fuzzed_and_truncated_files_never_end_in_another_error(tmp_path):
    path = write(tmp_path, {"t": np.arange(200.0), "gz": np.random.default_rng(0).normal(size=200)})
    source = path.read_bytes()
    own = tmp_path / "own.yaml"
    own.write_text("time: {column: t}\nchannels: {yaw_rate: {column: gz}}\n")
    rng = np.random.default_rng(2)
    refused = 0
    for _ in range(200):
        data = bytearray(source)
        for place in rng.integers(4, len(data), rng.integers(1, 6)):
            data[place] = rng.integers(0, 256)
        path.write_bytes(bytes(data[: len(data) if rng.random() < 0.7 else rng.integers(4, len(data))]))
        try:
            load_recording(path, str(own))
        except InputError as error:
            refused += 1
            assert "\n" not in str(error)  # noqa: PT017
    assert refused > 50
