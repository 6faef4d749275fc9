"""Stamps and readings that no log of a robot holds end in one sentence, and at once."""

from __future__ import annotations

import time

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.channels import CHANNELS
from ddagr_gym.recordings.column_map import load_column_map
from ddagr_gym.recordings.load import load_recording
from ddagr_gym.recordings.plausible import IMPOSSIBLE, check_magnitude, likely_unit, pauses, slow_rows
from ddagr_gym.recordings.schema import Recording

T = np.arange(200) * 0.05
NAMES = (
    "command_right", "command_left", "encoder_right", "encoder_left", "specific_force_x", "specific_force_y", "yaw_rate"
)  # fmt: skip


def write(folder, t, unit="s", parquet=False, yaw_rate=None):
    """A table of a drive and its map."""
    columns = {"t": t} | {name: np.sin(T + k) for k, name in enumerate(NAMES)}
    if yaw_rate is not None:
        columns["yaw_rate"] = yaw_rate
    lines = [f"time: {{column: t, unit: {unit}}}", "channels:", *(f"  {name}: {{column: {name}}}" for name in NAMES)]
    (folder / "map.yaml").write_text("description: test\n" + "\n".join(lines) + "\n")
    path = folder / ("drive.parquet" if parquet else "drive.csv")
    if parquet:
        import pyarrow as pa
        import pyarrow.parquet as pq

        pq.write_table(pa.table(columns), path)
    else:
        rows = np.column_stack(list(columns.values()))
        np.savetxt(path, rows, delimiter=",", fmt="%.17g", header=",".join(columns), comments="")
    return path, str(folder / "map.yaml")


@pytest.mark.parametrize("parquet", [False, True])
@pytest.mark.parametrize(("scale", "unit"), [(1e9, "ns"), (1e6, "us")])
def test_stamps_in_another_unit_are_named_and_the_remedy_works(tmp_path, parquet, scale, unit):
    began = time.process_time()
    with pytest.raises(InputError, match=f"look like {unit}, not seconds; say unit: {unit}"):
        load_recording(*write(tmp_path, 1.7e9 * scale + T * scale, parquet=parquet))
    assert time.process_time() - began < 10.0
    recording = load_recording(*write(tmp_path, 1.7e9 * scale + T * scale, unit, parquet=parquet))
    assert recording.period == pytest.approx(0.05, rel=1e-3)


@pytest.mark.parametrize("parquet", [False, True])
@pytest.mark.parametrize("gap", [1e300, 1e8])
def test_a_gap_of_years_is_named_with_its_rows(tmp_path, parquet, gap):
    with pytest.raises(InputError, match="between rows 100 and 101 lie"):
        load_recording(*write(tmp_path, np.where(np.arange(T.size) < 100, T, T + gap), parquet=parquet))


@pytest.mark.parametrize("parquet", [False, True])
@pytest.mark.parametrize(("first", "last", "row"), [(-1e308, 1e308, 1), (0.0, 1e308, 200), (-1e306, 9.95, 1)])
def test_stamps_that_no_clock_counts_are_named_with_their_row(tmp_path, parquet, first, last, row):
    t = np.concatenate([[first], T[1:-1], [last]])
    with pytest.raises(InputError, match=rf": row {row} has the time {(first, last)[row > 1]:g} s".replace("+", r"\+")):
        load_recording(*write(tmp_path, t, parquet=parquet))
    with pytest.raises(InputError, match=f"^row {row} has the time"):
        Recording.from_columns({"t": t})


def test_milliseconds_are_doubted(tmp_path):
    doubts = load_recording(*write(tmp_path, 1e3 * T)).validate()
    assert any("rows come every 50 s" in sentence and "(ms?)" in sentence for sentence in doubts)


def test_seconds_taken_for_nanoseconds_are_refused(tmp_path):
    with pytest.raises(InputError, match="no log of a robot is that fast"):
        load_recording(*write(tmp_path, 1e-9 * T))


def test_a_reading_that_no_sensor_gives_is_named(tmp_path):
    with pytest.raises(InputError, match=r"yaw_rate is 1e\+160 rad/s in row 8"):
        load_recording(*write(tmp_path, T, yaw_rate=np.where(np.arange(T.size) == 7, 1e160, 0.1)))
    with pytest.raises(InputError, match="row 2"):
        Recording.from_columns({"t": T[:3], "yaw_rate": [0.0, -1e13, 0.0]})


@pytest.mark.parametrize(
    ("period", "unit"),
    [(0.02, ""), (1.0, ""), (1.2, ""), (2.0, "ms"), (5.0, "ms"), (20.0, "ms"), (2e4, "us"), (2e7, "ns"), (1e12, "")],
)
def test_the_unit_of_a_period(period, unit):
    assert likely_unit(period) == unit
    assert bool(list(slow_rows(period))) == (period > 1.5)


def test_two_drives_in_one_file_are_doubted_and_two_spans_are_not(tmp_path):
    t = np.where(np.arange(T.size) < 100, T, T + 9e5)
    doubts = load_recording(*write(tmp_path, t)).validate()
    assert [sentence for sentence in doubts if "no rows come for 9e+05 s after row 100" in sentence]
    assert list(pauses(t, [slice(0, 100), slice(100, 200), slice(0, 0)])) == []
    assert list(pauses(np.where(np.arange(T.size) < 100, T, T + 500.0), [slice(0, 200)])) == []


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("name", CHANNELS)
def test_one_impossible_reading_of_any_channel_is_refused_with_its_time(name, sign):
    values = np.full(T.size, 0.1)
    values[7] = sign * 9e11
    with pytest.raises(InputError, match=rf"^{name} is -?9e\+11 .* in row 8 at t = 0.35 s, .*: correct it"):
        Recording.from_columns({"t": 100.0 + T, name: values})


@pytest.mark.parametrize("name", CHANNELS)
def test_missing_and_large_readings_pass(name):
    unit, limit = CHANNELS[name].unit, CHANNELS[name].limit
    # What a doubt is for, a channel in thousandths of its unit, is not refused.
    check_magnitude(name, np.array([np.nan, 1e3 * limit, -1e3 * limit]), unit, T[:3])
    check_magnitude(name, np.array([np.nan, IMPOSSIBLE[unit]]), unit, T[:2])


def test_the_shipped_maps_still_load():
    assert load_column_map("drive_steps").time.unit == "s"
