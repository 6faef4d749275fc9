from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from pyarrow import parquet

from ddagr_gym.config import dump_config
from ddagr_gym.errors import InputError
from ddagr_gym.presets import get_robot
from ddagr_gym.recordings.files import Limits
from ddagr_gym.recordings.load import load_recording
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.recordings.storage import META_KEY, is_recording, load_parquet, save_drive, save_parquet

VALUES = hnp.arrays(np.float64, 12, elements=st.floats(-1e6, 1e6) | st.just(np.nan))


def assert_equal(a: Recording, b: Recording):
    assert a.meta == b.meta
    assert list(a.columns()) == list(b.columns())
    for name, values in a.columns().items():
        np.testing.assert_array_equal(values, b.columns()[name])
    np.testing.assert_array_equal(a.command_valid, b.command_valid)


@given(yaw_rate=VALUES, truth=VALUES, valid=hnp.arrays(np.bool_, 12), start=st.floats(0, 1e9))
def test_what_is_saved_is_what_is_loaded(tmp_path_factory, warthog, yaw_rate, truth, valid, start):
    columns = {"t": start + np.arange(12.0), "yaw_rate": yaw_rate, "true_x": truth}
    recording = Recording.from_columns(columns, warthog, command_valid=valid, spans=((0, 5), (5, 12)), notes=["a", "b"])
    recording = recording.with_meta(held={"yaw_rate": 0.25}, source_sha256="ab", column_map="m", duplicates_dropped=3)
    path = tmp_path_factory.mktemp("run") / "run.parquet"
    save_parquet(recording, path)
    assert_equal(recording, load_parquet(path))


def test_a_simulated_drive_goes_through_the_same_file(tmp_path):
    from ddagr_gym.presets import get_robot, get_soil
    from ddagr_gym.simulator import simulate

    robot = get_robot("ddagr")
    columns = simulate(robot, get_soil("thesis_a1"), np.full((50, 2), 0.5))
    recording = Recording.from_columns(columns, robot)
    path = tmp_path / "simulated.parquet"
    save_parquet(recording, path)
    loaded = load_recording(path)
    assert_equal(recording, loaded)
    assert loaded.meta.robot == "ddagr"
    assert set(loaded.channels) >= {"command_right", "encoder_left", "specific_force_x", "yaw_rate"}
    assert all(name.startswith("true_") for name in loaded.extras)


def test_other_tools_can_read_the_columns_and_the_meta_data(tmp_path, make_drive):
    path = tmp_path / "run.parquet"
    save_parquet(make_drive(seconds=20), path)
    table = parquet.read_table(path)
    assert table.column("yaw_rate").type == pa.float64()
    meta = json.loads(table.schema.metadata[META_KEY])
    assert meta["schema_version"] == 1
    assert meta["rates"]["pose_x"] == pytest.approx(5.0)


def rewrite(path, change):
    table = parquet.read_table(path)
    meta = json.loads(table.schema.metadata[META_KEY])
    change(meta)
    parquet.write_table(table.replace_schema_metadata({META_KEY: json.dumps(meta).encode()}), path)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda m: m.update(schema_version=99), "schema version 99"),
        (lambda m: m.pop("schema_version"), "do not parse"),
        (lambda m: m.pop("segments"), "incomplete"),
        (lambda m: m.update(segments=[[0, 10**9]]), "segments"),
        (lambda m: m.update(spans=[[1]]), "incomplete"),
        (lambda m: m.update(geometry={"name": "x"}), "incomplete"),
        (lambda m: m.update(held=[1]), "incomplete"),
    ],
)
def test_meta_data_that_lie_are_refused(tmp_path, make_drive, change, words):
    path = tmp_path / "run.parquet"
    save_parquet(make_drive(seconds=10), path)
    rewrite(path, change)
    with pytest.raises(InputError, match=words):
        load_parquet(path)


def test_a_foreign_table_is_not_a_recording(tmp_path):
    path = tmp_path / "foreign.parquet"
    parquet.write_table(pa.table({"t": [0.0]}), path)
    assert not is_recording(path)
    with pytest.raises(InputError, match="import it"):
        load_parquet(path)


def test_columns_of_another_type_are_refused(tmp_path, make_drive):
    path = tmp_path / "run.parquet"
    save_parquet(make_drive(seconds=10), path)
    table = parquet.read_table(path)
    text = table.set_column(0, "t", pa.array(["a"] * table.num_rows))
    parquet.write_table(text, path)
    with pytest.raises(InputError, match="column of the schema"):
        load_parquet(path)


def test_a_recording_larger_than_allowed_is_refused(tmp_path, make_drive):
    path = tmp_path / "run.parquet"
    save_parquet(make_drive(seconds=10), path)
    with pytest.raises(InputError, match="--maximum-rows"):
        load_recording(path, limits=Limits(rows=10))


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path, make_drive, monkeypatch):
    path = tmp_path / "run.parquet"
    save_parquet(make_drive(seconds=10), path)
    before = path.read_bytes()

    def full_disk(_table, where, **_options):
        where.write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(parquet, "write_table", full_disk)
    with pytest.raises(InputError, match="No space left"):
        save_parquet(make_drive(seconds=20), path)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["run.parquet"]


@pytest.mark.parametrize("target", ["taken/run.parquet", "."])
def test_places_that_cannot_be_written(tmp_path, make_drive, target):
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(InputError, match="folder"):
        save_parquet(make_drive(seconds=10), tmp_path / target)


@pytest.mark.parametrize("name", ["run.parquet", "run.csv"])
def test_the_home_folder_and_new_folders_are_written_to(tmp_path, make_drive, monkeypatch, name):
    monkeypatch.setenv("HOME", str(tmp_path))
    drive = make_drive(seconds=10)
    save_drive(Path("~/new/drives") / name, drive.columns(), get_robot("warthog"))
    assert len(load_recording(tmp_path / "new" / "drives" / name, robot="warthog")) == len(drive)


def test_another_robot_than_the_imported_one_is_refused(tmp_path, make_drive):
    path = tmp_path / "run.parquet"
    save_parquet(make_drive(seconds=10), path)
    with pytest.raises(InputError, match="imported for the robot 'warthog'"):
        load_recording(path, robot="husky")


def test_a_recording_and_a_file_of_its_robot_agree_by_the_robots_name(tmp_path, make_drive):
    path, own = tmp_path / "run.parquet", tmp_path / "own.yaml"
    save_parquet(make_drive(seconds=10), path)
    own.write_text(dump_config(replace(get_robot("warthog"), half_track=0.6)))
    recording = load_recording(path, robot=str(own))
    assert recording.meta.robot == "warthog"
    assert recording.meta.geometry.half_track == 0.6
    own.write_text(dump_config(replace(get_robot("warthog"), name="mine")))
    with pytest.raises(InputError, match="imported for the robot 'warthog', not 'mine'"):
        load_recording(path, robot=str(own))
