"""What a calibration refuses, each in one sentence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ddagr_gym
from benchmarks.simulated_robots import drive
from ddagr_gym.api.calibrate import _number, _numbers
from ddagr_gym.api.drive_names import names_apart
from ddagr_gym.calibration.input_requirements import (
    SHORTEST_DRIVE,
    DriveScale,
    check_drives,
    check_scales,
    drive_scale,
    grounds_of,
    with_gyro_forward,
)
from ddagr_gym.errors import InputError
from ddagr_gym.presets import get_robot, get_soil


def without(recording, *names):
    kept = {name: values for name, values in recording.channels.items() if name not in names}
    return replace(recording, channels=kept)


@pytest.fixture(scope="module")
def field_drive():
    return drive("field", 11, 90.0)


def test_no_drive_at_all_is_refused():
    with pytest.raises(InputError, match="no ordinary drive"):
        ddagr_gym.calibrate([], "ddagr")


def test_a_drive_of_another_robot_is_refused_by_its_name(field_drive):
    with pytest.raises(InputError, match="drive of the robot 'ddagr'"):
        check_drives([field_drive], get_robot("husky"))
    with pytest.raises(InputError, match=r"'rover': .* with --robot FILE\.yaml \(the file that describes it\)"):
        check_drives([field_drive.with_meta(robot="rover")], get_robot("husky"))


def test_a_drive_in_segments_of_one_row_is_refused(field_drive):
    single = tuple((row, row + 1) for row in range(len(field_drive)))
    with pytest.raises(InputError, match="no two are in one segment"):
        check_drives([field_drive.with_meta(segments=single)], get_robot("ddagr"))


def test_a_drive_without_encoders_is_refused(field_drive):
    with pytest.raises(InputError, match="no encoder_right, encoder_left"):
        check_drives([without(field_drive, "encoder_right", "encoder_left")], get_robot("ddagr"))


def test_a_drive_given_twice_is_refused(field_drive):
    with pytest.raises(InputError, match="hold the same values"):
        check_drives([field_drive, field_drive.with_meta(source="again.csv")], get_robot("ddagr"))


def test_a_short_drive_is_refused():
    with pytest.raises(InputError, match="give drives of 60 s at least"):
        check_drives([drive("field", 12, 20.0)], get_robot("ddagr"))


def test_a_drive_of_a_minute_is_long_enough_whatever_its_times_round_to():
    minute = drive("field", 13, SHORTEST_DRIVE)
    rounded = replace(minute, t=minute.t * (1.0 - 1e-12))
    assert len(rounded) * rounded.period < SHORTEST_DRIVE
    check_drives([rounded], get_robot("ddagr"))


def test_a_robot_that_stands_still_is_refused(field_drive):
    still = {name: np.zeros(len(field_drive)) for name in ("command_right", "command_left")}
    with pytest.raises(InputError, match="stand still 100 %"):
        check_drives([replace(field_drive, channels={**field_drive.channels, **still})], get_robot("ddagr"))


def test_wheels_of_another_size_are_refused_by_what_the_poses_travel(field_drive):
    """Poses travel the true radius times the encoders: half of it with wheels taken to be twice as large."""
    geometry = field_drive.meta.geometry
    doubled = field_drive.with_meta(geometry=replace(geometry, wheel_radius=2.0 * geometry.wheel_radius))
    scales = [drive_scale(r, np.random.default_rng(0)) for r in (field_drive, doubled)]
    assert scales[1].travel == pytest.approx(0.5 * scales[0].travel, rel=1e-6)
    with pytest.raises(InputError, match="are not of one robot"):
        check_scales(["a", "b"], scales, get_robot("ddagr"))
    with pytest.raises(InputError, match=r"b: the poses travel 0\.\d\d of what wheels"):
        check_scales(["b"], scales[1:], get_robot("ddagr"))
    check_scales(["a"], scales[:1], get_robot("ddagr"))


def test_a_robot_on_ice_is_not_refused_for_its_slip():
    """Wheels that spin on most of the drive roll with little slip on some of it; with a wrong radius none does."""
    ice = replace(get_soil("firm_ground"), cohesion=300.0, friction_angle=np.radians(5.0))
    held = np.random.default_rng(0).uniform(-5.0, 12.0, (24, 2))
    made = ddagr_gym.simulate(np.repeat(held, 100, axis=0), rate=20.0, robot="warthog", soil=ice, pose_rate=5.0)
    scale = drive_scale(made.recording, np.random.default_rng(0))
    assert scale.travel is not None
    assert scale.travel < 0.5
    assert scale.rolling == pytest.approx(0.95, abs=0.1)
    check_scales(["ice", "asphalt"], [scale, DriveScale(0.96, 1.04, 1.7, (1.6, 1.8))], get_robot("warthog"))
    wrong = replace(scale, rolling=0.5 * scale.rolling)
    with pytest.raises(InputError, match=r"travel 0\.4\d of what wheels of 0\.3 m roll where they slip least"):
        check_scales(["ice"], [wrong], get_robot("warthog"))


def test_a_track_below_the_geometric_one_is_refused():
    with pytest.raises(InputError, match=r"track were 0\.50 times"):
        check_scales(["a"], [DriveScale(0.95, 1.0, 0.5, (0.45, 0.55))], get_robot("ddagr"))


def test_a_track_that_may_be_right_is_not_refused():
    """Where a robot hardly turns the track is the inverse of a small number, and its interval says so."""
    check_scales(["a"], [DriveScale(0.95, 1.0, -18.0, (-629.0, 172.0))], get_robot("ddagr"))
    with pytest.raises(InputError, match=r"track were 9\.00 times"):
        check_scales(["a"], [DriveScale(0.95, 1.0, 9.0, (7.0, 12.0))], get_robot("ddagr"))


def test_a_straight_drive_says_nothing_of_the_track(field_drive):
    """Its commands are those of a drive with turns, the same for both banks; the gyro reads noise."""
    mean = 0.5 * (field_drive["command_right"] + field_drive["command_left"])
    straight = ddagr_gym.simulate(np.stack([mean, mean], axis=1), rate=1.0 / field_drive.period, pose_rate=5.0)
    scale = drive_scale(straight.recording, np.random.default_rng(0))
    assert scale.travel is not None
    assert scale.track is None
    check_scales(["straight"], [scale], get_robot("ddagr"))
    turned = drive_scale(field_drive, np.random.default_rng(0))
    assert turned.track is not None
    assert turned.track_interval[0] < turned.track < turned.track_interval[1]


def test_a_gyro_against_encoders_and_poses_is_turned(field_drive):
    reversed_gyro = replace(field_drive, channels={**field_drive.channels, "yaw_rate": -field_drive["yaw_rate"]})
    mended, said = with_gyro_forward(reversed_gyro, np.random.default_rng(0))
    np.testing.assert_array_equal(mended["yaw_rate"], field_drive["yaw_rate"])
    assert "its sign was turned" in said[0]
    assert with_gyro_forward(field_drive, np.random.default_rng(0)) == (field_drive, ())


def test_every_drive_has_one_ground():
    names = ("a", "b", "c")
    assert grounds_of(names, {}) == ("ground",) * 3
    assert grounds_of(names, {"sand": [0, 2], "grass": [1]}) == ("sand", "grass", "sand")
    with pytest.raises(InputError, match="b is on the grounds 'sand' and 'grass'"):
        grounds_of(names, {"sand": [0, 1], "grass": [1, 2]})
    with pytest.raises(InputError, match=r"c has no ground .* --ground NAME=c"):
        grounds_of(names, {"sand": [0, 1]})


@pytest.mark.parametrize(
    ("grounds", "sentence"),
    [
        ({"sand": ["elsewhere.csv"]}, "elsewhere.csv has a ground and is not among the drives"),
        ({"sand": [1]}, "drive number 1 has a ground: give numbers from 0 to 0"),
        ({"a/b": [0]}, "becomes the name of a file"),
    ],
)
def test_grounds_that_do_not_fit_the_drives_are_refused(field_drive, grounds, sentence):
    with pytest.raises(InputError, match=sentence):
        ddagr_gym.calibrate([field_drive], "ddagr", grounds=grounds)


def test_soils_by_ground_need_one_for_each(field_drive):
    with pytest.raises(InputError, match="no drive is on the ground 'sand'"):
        ddagr_gym.calibrate([field_drive], "ddagr", {"sand": "lete_sand_wong"}, {"field": [0]})


def test_an_imported_drive_is_known_by_the_name_of_its_file(field_drive):
    """The Parquet file of an import still says what it was imported from."""
    found = [field_drive.with_meta(source="monday.csv.gz"), field_drive.with_meta(source="tuesday.bag")]
    assert [_number(name, found, found) for name in ("monday.parquet", "data/tuesday.parquet", "tuesday.bag")] == [
        0,
        1,
        1,
    ]
    with pytest.raises(InputError, match=r"wednesday.parquet has a ground and is not among the drives"):
        _number("wednesday.parquet", found, found)


def test_drives_of_one_file_name_are_told_apart_by_their_paths(field_drive, tmp_path, monkeypatch):
    paths = [tmp_path / day / "run.csv" for day in ("monday", "tuesday")]
    found = [field_drive.with_meta(source=name) for name in names_apart(["run.csv"] * 2, paths)]
    monkeypatch.chdir(tmp_path)
    for given in (paths[1], str(paths[1]), "tuesday/run.csv", "./monday/../tuesday/run.csv"):
        assert _numbers({"sand": [given], "yard": paths[0]}, paths, found) == {"sand": [1], "yard": [0]}
    monkeypatch.chdir("/")
    assert _number("tuesday/run.csv", paths, found) == 1
    with pytest.raises(InputError, match=r"run.csv is the name of 2 drives: give the whole path of one \(or"):
        _number("run.csv", paths, found)
    with pytest.raises(InputError, match=r"not among the drives monday/run.csv, .*: give the name or path of one\.$"):
        _number("friday/run.csv", paths, found)
    with pytest.raises(InputError, match="a Recording has a ground and is not among"):
        _number(field_drive, paths, found)


def test_recordings_of_one_name_are_told_apart_by_their_numbers(field_drive):
    found = [field_drive.with_meta(source=name) for name in names_apart(["run.csv"] * 2, [field_drive] * 2)]
    assert _number("run.csv (2)", found, found) == 1
    with pytest.raises(InputError, match=r"run.csv is the name of 2 drives"):
        _number("run.csv", found, found)


def test_a_single_drive_needs_no_list(field_drive):
    found = [field_drive.with_meta(source="a.csv"), field_drive.with_meta(source="b.csv")]
    assert _numbers({"sand": "a.csv", "yard": 1}, found, found) == {"sand": [0], "yard": [1]}
