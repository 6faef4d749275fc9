"""What callers give: paths, folders, tables, mappings, simulated drives, robots and soils."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import ddagr_gym
from ddagr_gym.api.inputs import recording_from, recordings_from, sources_in
from ddagr_gym.api.nominal import OWN, nominal_from, thresholds_from
from ddagr_gym.config import dump_config
from ddagr_gym.diagnosis.gates.threshold_files import default_thresholds, save_thresholds
from ddagr_gym.errors import InputError, InputWarning
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.channels import CHANNELS
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.recordings.storage import arrow_table, save_parquet

pandas = pytest.importorskip("pandas")
pyarrow = pytest.importorskip("pyarrow")

COLUMNS = {
    "t": [0.0, 0.1, 0.2, 0.3],
    "command_right": [1.0, 1.0, 2.0, 2.0],
    "command_left": [1.0, 1.0, 0.0, 0.0],
    "yaw_rate": [0.0, np.nan, 0.2, 0.3],
}


def assert_is_the_table(recording: Recording) -> None:
    for name, values in COLUMNS.items():
        np.testing.assert_array_equal(recording.t if name == "t" else recording[name], values)


def test_a_table_of_any_kind_is_the_same_recording():
    frame = pandas.DataFrame(COLUMNS)
    missing = frame.astype("Float64")  # pandas's own missing values
    missing.loc[1, "yaw_rate"] = pandas.NA
    table = pyarrow.table({**COLUMNS, "yaw_rate": [0.0, None, 0.2, 0.3]})
    for given in (COLUMNS, frame, missing, table, frame.convert_dtypes()):
        assert_is_the_table(recording_from(given))


def test_a_table_has_the_given_robot_and_numbers_for_names():
    frame = pandas.DataFrame(COLUMNS)
    first, second = recordings_from([frame, frame], "husky")
    assert (first.meta.robot, first.meta.source, second.meta.source) == ("husky", "table 1", "table 2")
    assert first.meta.geometry is not None
    assert first.meta.geometry.wheel_radius == get_robot("husky").outer_radius


def test_validity_of_commands_and_columns_of_ones_own_are_kept():
    frame = pandas.DataFrame({**COLUMNS, "command_valid": [True, True, False, True], "moisture": 0.3, "state": "run"})
    recording = recording_from(frame)
    assert recording.command_valid.tolist() == [True, True, False, True]
    assert recording.extras["moisture"].tolist() == [0.3] * 4
    assert recording.meta.notes == ("the columns state hold no numbers and are left out.",)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"t": None}, "has no column 't' (time in seconds)"),
        ({"yaw_rate": ["fast"] * 4}, "the column 'yaw_rate' of table 1 holds no numbers: give it in rad/s"),
        ({"t": pandas.date_range("2026-01-01", periods=4)}, "the column 't' of table 1 holds no numbers"),
        ({"t": [0.0, 0.1, 0.1, 0.2]}, "does not increase at row 2"),
        ({name: None for name in COLUMNS if name != "t"}, "has no column of the schema"),
    ],
)
def test_a_table_that_is_no_drive_is_one_sentence(changes, message):
    columns = {name: values for name, values in {**COLUMNS, **changes}.items() if values is not None}
    with pytest.raises(InputError) as caught:
        recordings_from(pandas.DataFrame(columns))
    assert message in str(caught.value)


def test_columns_whose_names_are_no_texts_are_kept_under_their_texts():
    recording = recording_from(pandas.DataFrame({**COLUMNS, 5: 1.5}))
    assert recording.extras["5"].tolist() == [1.5] * 4


def test_an_index_of_time_is_not_guessed():
    frame = pandas.DataFrame(COLUMNS).set_index("t")
    with pytest.raises(InputError, match="an index is not taken for the time"):
        recordings_from(frame)


def test_a_column_twice_is_refused():
    frame = pandas.DataFrame(COLUMNS)
    twice = pandas.concat([frame, frame[["yaw_rate"]]], axis=1)
    with pytest.raises(InputError, match="'yaw_rate' twice"):
        recordings_from(twice)


def test_an_arrow_table_keeps_its_recordings_meta_data(drive):
    recording = recording_from(arrow_table(drive.recording))
    assert recording.meta == drive.recording.meta
    for name, values in drive.recording.columns().items():
        np.testing.assert_array_equal(recording.columns()[name], values)


def test_a_simulated_drive_goes_out_as_a_table_and_comes_back(drive):
    back = recording_from(drive.to_pandas(), "ddagr")
    for name in CHANNELS:
        np.testing.assert_array_equal(back[name], drive.recording[name])
    np.testing.assert_array_equal(back.extras["true_x"], drive.truth["x"])


def test_files_folders_and_recordings_may_stand_side_by_side(drive, tmp_path):
    folder = tmp_path / "drives"
    folder.mkdir()
    for name in ("a", "b"):
        save_parquet(drive.recording.with_meta(source=f"{name}.sim"), folder / f"{name}.parquet")
    (folder / "notes.txt").write_text("windy")
    drive.save(tmp_path / "c.parquet")
    found = recordings_from([str(folder), tmp_path / "c.parquet", drive.recording, drive])
    assert [recording.meta.source for recording in found] == [
        "a.parquet",
        "b.parquet",
        "c.parquet",
        *["simulation"] * 2,
    ]
    assert len({len(recording) for recording in found}) == 1


def test_bags_that_are_folders_count_among_the_drives_of_a_folder(tmp_path):
    for name in ("b_bag", "c_bag", "notes"):
        (tmp_path / name).mkdir()
    (tmp_path / "b_bag" / "metadata.yaml").touch()
    (tmp_path / "c_bag" / "c_bag_0.db3").touch()
    (tmp_path / "a.csv.gz").touch()
    assert [path.name for path in sources_in(tmp_path)] == ["a.csv.gz", "b_bag", "c_bag"]
    assert sources_in(tmp_path / "b_bag") == [tmp_path / "b_bag"]


def test_paths_in_the_home_folder_are_written_out(drive, tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    (tmp_path / "drives").mkdir()
    drive.save(tmp_path / "drives" / "run.parquet")
    for given in ("~/drives", Path("~/drives"), ["~/drives/run.parquet"]):
        assert sources_in(given) == [tmp_path / "drives" / "run.parquet"]
        assert len(recordings_from(given)) == 1
    with pytest.raises(InputError, match="names the home folder of no user"):
        recordings_from("~nobody-of-this-name/drives")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ([], "no recording is given"),
        (3, "a recording is given as int"),
        ("absent.parquet", "absent.parquet"),
    ],
)
def test_what_is_no_recording_is_refused(given, message):
    with pytest.raises(InputError, match=message):
        recordings_from(given)


def test_an_empty_folder_is_refused(tmp_path):
    with pytest.raises(InputError, match="holds no recording"):
        recordings_from(tmp_path)


def test_a_drive_of_another_robot_is_refused(drive):
    with pytest.raises(InputError, match="'ddagr', not 'husky'"):
        recordings_from(drive, "husky")


def test_load_recording_reads_with_a_robot_of_ones_own(drive, tmp_path):
    drive.save(tmp_path / "run.parquet")
    wide = replace(get_robot("ddagr"), half_track=0.7)
    geometry = ddagr_gym.load_recording(tmp_path / "run.parquet", robot=wide).meta.geometry
    assert geometry is not None
    assert geometry.half_track == 0.7


def test_load_recording_keeps_to_its_limits(drive, tmp_path):
    drive.save(tmp_path / "run.parquet")
    with pytest.raises(InputError, match="more than 10 rows"):
        ddagr_gym.load_recording(tmp_path / "run.parquet", maximum_rows=10)


def test_robots_and_soils_come_by_name_path_and_object(tmp_path):
    robot, soil = get_robot("husky"), get_soil("firm_ground")
    softer = replace(soil, cohesion=100.0)
    (tmp_path / "husky.yaml").write_text(dump_config(robot))
    (tmp_path / "softer.yaml").write_text(dump_config(softer))
    by_name = nominal_from("husky", "firm_ground")
    assert (by_name.robot, by_name.soil, by_name.robot_file, by_name.soil_name) == (robot, soil, "", "firm_ground")
    assert nominal_from(robot, soil) == by_name
    by_path = nominal_from(tmp_path / "husky.yaml", str(tmp_path / "softer.yaml"))
    assert (by_path.robot, by_path.soil) == (robot, softer)
    assert (by_path.robot_file, by_path.soil_name) == (str(tmp_path / "husky.yaml"), str(tmp_path / "softer.yaml"))
    own = nominal_from(replace(robot, mass=80.0), softer)
    assert (own.robot.mass, own.robot_file, own.soil_name) == (80.0, OWN, OWN)
    with pytest.raises(InputError, match="firm_ground"):
        nominal_from("husky", "firm_grund")


def test_thresholds_come_with_the_robot_from_a_file_or_as_they_are(tmp_path):
    shipped = default_thresholds("ddagr")
    save_thresholds(shipped, tmp_path / "gates.json")
    robot = get_robot("ddagr")
    for given in (None, tmp_path / "gates.json", str(tmp_path / "gates.json"), shipped):
        assert thresholds_from(given, robot, "thesis_a1") == shipped
    assert thresholds_from(None, get_robot("husky"), "thesis_a1") is None


def test_thresholds_of_another_soil_are_warned_of():
    with pytest.warns(InputWarning, match="made for soil thesis_a1 instead of loose_sand"):
        thresholds_from(None, get_robot("ddagr"), "loose_sand")


def test_paths_are_not_changed_by_reading(drive, tmp_path):
    path = Path(tmp_path / "run.parquet")
    drive.save(path)
    before = path.read_bytes()
    recordings_from(path, "ddagr")
    assert path.read_bytes() == before
