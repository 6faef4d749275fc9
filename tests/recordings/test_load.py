"""The door for all kinds of files, and every shared recording through it."""

from __future__ import annotations

import json

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.checks.run import check_recording
from ddagr_gym.recordings.files import Limits, sha256_of
from ddagr_gym.recordings.load import load_recording, preset_geometry
from ddagr_gym.recordings.storage import load_parquet, save_parquet


def robot_of(path):
    return path.name.split("_", 1)[0]


def import_and_check(path, robot, tmp_path):
    """Import, save, load, check; every step without an exception or a doubt about structure."""
    recording = load_recording(path, robot=robot)
    saved = tmp_path / "run.parquet"
    save_parquet(recording, saved)
    loaded = load_parquet(saved)
    assert loaded.meta == recording.meta
    report = check_recording(loaded, np.random.default_rng(0))
    json.dumps(report.to_json(), allow_nan=False)
    assert loaded.meta.source_sha256 == sha256_of(path)
    assert any(f.status == "pass" for f in report.findings)
    return loaded, report


def test_preset_robots_give_their_geometry():
    geometry = preset_geometry("warthog")
    assert (geometry.wheel_radius, geometry.half_track) == (pytest.approx(0.30), pytest.approx(0.54))
    with pytest.raises(InputError, match="warthog"):
        preset_geometry("wart_hog")


def test_what_is_wrong_inside_a_file_is_said_with_its_name(tmp_path):
    path = tmp_path / "monday.csv"
    path.write_text("t,yaw_rate\n0,0.1\n2,0.1\n1,0.1\n")
    column_map = tmp_path / "map.yaml"
    column_map.write_text("time: {column: t}\nchannels: {yaw_rate: {column: yaw_rate}}\n")
    with pytest.raises(InputError, match=r"monday\.csv: time goes back from 2 s to 1 s"):
        load_recording(path, str(column_map))


def test_steps_layout_of_a_real_drive(recordings_dir):
    recording = load_recording(recordings_dir / "open" / "warthog_sand.csv.gz", robot="warthog")
    assert recording.meta.column_map == "drive_steps"
    assert len(recording.meta.spans) == 100
    assert len(recording.meta.segments) == 300
    start, stop = recording.meta.spans[7]
    assert recording.t[stop - 1] - recording.t[start] == pytest.approx(5.95 + 2 * 0.05)
    rates = recording.rates()
    assert rates["yaw_rate"] == pytest.approx(20, rel=0.01)
    assert rates["encoder_right"] == pytest.approx(4, rel=0.01)
    # Every new encoder sample differs from the one before or is a zero at standstill.
    values = recording["encoder_right"][slice(*recording.meta.spans[7])]
    values = values[np.isfinite(values)]
    assert np.all((np.diff(values) != 0) | (values[1:] == 0))


def test_continuous_layout_of_a_real_drive(recordings_dir):
    path = recordings_dir / "open" / "warthog_grass.csv.gz"
    recording = load_recording(path, robot="warthog")
    assert recording.meta.column_map == "drive_continuous"
    assert len(recording.meta.spans) == 1
    assert 0.3 < recording.command_valid.mean() < 0.5
    assert np.isnan(recording["command_right"][~recording.command_valid]).all()
    assert recording.rates()["pose_x"] == pytest.approx(6.67, rel=0.01)
    with pytest.raises(InputError, match="--robot"):
        load_recording(path)


@pytest.mark.parametrize("name", ["open/warthog_asphalt", "concealed/husky_2", "concealed/warthog_7"])
def test_real_drives_import_and_check(recordings_dir, tmp_path, name):
    path = recordings_dir / f"{name}.csv.gz"
    import_and_check(path, robot_of(path), tmp_path)


@pytest.mark.parametrize("case", ["case_01/run_1", "case_17/run_2", "case_30/run_3"])
def test_concealed_cases_import_and_check(shared_dir, tmp_path, case):
    recording, _ = import_and_check(shared_dir / "concealed" / f"{case}.csv.gz", None, tmp_path)
    assert recording.meta.column_map == "concealed"
    assert recording.meta.robot == "ddagr"


@pytest.mark.slow
def test_every_real_drive_imports_and_checks(recordings_dir, tmp_path):
    paths = sorted(recordings_dir.glob("*/*.csv.gz"))
    assert len(paths) >= 12
    for path in paths:
        import_and_check(path, robot_of(path), tmp_path)


@pytest.mark.slow
def test_every_concealed_case_imports_and_checks(shared_dir, tmp_path):
    paths = sorted((shared_dir / "concealed").glob("case_*/run_*.csv.gz"))
    assert len(paths) == 90
    for path in paths:
        import_and_check(path, None, tmp_path)


def test_a_foreign_parquet_table_goes_through_a_map(tmp_path):
    import pyarrow as pa
    from pyarrow import parquet

    path = tmp_path / "table.parquet"
    columns = ("t", "cmd_right", "cmd_left", "enc_right", "enc_left", "imu_ax", "imu_ay", "imu_gz")
    parquet.write_table(pa.table({name: np.arange(10.0) for name in columns}), path)
    recording = load_recording(path)
    assert recording.meta.column_map == "concealed"
    np.testing.assert_array_equal(recording["yaw_rate"], np.arange(10.0))


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("run.csv", b"alpha,beta\n1,2\n", "fit none of the shipped maps"),
        ("run.csv", b"", "is empty"),
        ("run.h5", b"\x89HDF\r\n\x1a\n", "HDF5"),
        ("run.txt", b"\x00\x01\x02\x03", "unprintable|UTF-8"),
        ("run.parquet", b"PAR1garbagePAR1", "damaged Parquet"),
        ("run.mcap", b"\x89MCAP0\r\n", "damaged or truncated"),
        ("run.bag", b"#ROSBAG V2.0\n", "damaged or not a bag"),
        ("run.db3", b"SQLite format 3\0", "damaged or not a bag"),
    ],
)
def test_every_kind_of_broken_file_gets_one_sentence(tmp_path, name, data, words):
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(InputError, match=words) as caught:
        load_recording(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("limits", [{"rows": 0}, {"bytes": -1}, {"rows": 1.5}])
def test_limits_are_whole_numbers(limits):
    with pytest.raises(InputError, match="limit"):
        Limits(**limits)
