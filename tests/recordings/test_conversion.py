from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.column_map import (
    BodyCommands,
    ColumnMap,
    ColumnSource,
    HeldChannels,
    Pieces,
    TimeSource,
    ValidCommands,
)
from ddagr_gym.recordings.conversion import RawTable, build_recording

YAW = {"yaw_rate": ColumnSource("gz")}


def table(labels=None, **numbers):
    arrays = {name: np.asarray(v, dtype=float) for name, v in numbers.items()}
    codes, texts = {}, {}
    for name, column in (labels or {}).items():
        values = list(dict.fromkeys(column))
        codes[name] = np.array([values.index(v) for v in column])
        texts[name] = tuple(values)
    return RawTable(arrays, codes, texts)


def test_steps_get_a_running_clock_with_the_missing_time_at_each_join():
    column_map = ColumnMap(
        time=TimeSource("t"),
        channels=YAW,
        pieces=Pieces(("seq",), ("window",), join_gap=0.05, span_gap=1.0),
    )
    t = np.tile(np.arange(6) * 0.05, 2)
    rows = table({"seq": [0] * 6 + [1] * 6, "window": [0, 0, 1, 1, 2, 2] * 2}, t=t, gz=t)
    recording = build_recording(rows, column_map, None)
    step = np.array([0.0, 0.05, 0.15, 0.20, 0.30, 0.35])
    np.testing.assert_allclose(recording.t, np.concatenate([step, 1.35 + step]))
    assert recording.meta.spans == ((0, 6), (6, 12))
    assert recording.meta.segments == tuple((i, i + 2) for i in range(0, 12, 2))


def test_an_absolute_clock_is_used_where_the_file_has_one():
    column_map = ColumnMap(time=TimeSource("t", absolute_column="utc"), channels=YAW, pieces=Pieces(("seq",)))
    rows = table({"seq": [0, 0, 1, 1]}, t=[0, 1, 0, 1], utc=[100, 101, 150, 151], gz=[1, 2, 3, 4])
    recording = build_recording(rows, column_map, None)
    np.testing.assert_allclose(recording.t, [0, 1, 50, 51])
    assert recording.meta.start_time == 100.0
    assert recording.meta.spans == ((0, 2), (2, 4))


def test_unsorted_time_is_refused_with_the_place():
    with pytest.raises(InputError, match=r"from 2 s to 1 s after row 3"):
        build_recording(table(t=[0, 1, 2, 1, 3], gz=np.ones(5)), ColumnMap(TimeSource("t"), YAW), None)


def test_missing_time_is_refused_with_the_place():
    with pytest.raises(InputError, match="row 3 has no valid time"):
        build_recording(table(t=[0, 1, np.nan], gz=np.ones(3)), ColumnMap(TimeSource("t"), YAW), None)


def test_no_rows_are_refused():
    with pytest.raises(InputError, match="no rows"):
        build_recording(table(t=[], gz=[]), ColumnMap(TimeSource("t"), YAW), None)


def test_repeated_rows_are_left_out_and_counted():
    recording = build_recording(table(t=[0, 1, 1, 2], gz=[1, 2, 9, 3]), ColumnMap(TimeSource("t"), YAW), None)
    np.testing.assert_array_equal(recording["yaw_rate"], [1, 2, 3])
    assert recording.meta.duplicates_dropped == 1


def test_rows_of_several_sensors_with_one_stamp_are_one_row():
    nan = np.nan
    gyro, wheel = [1.0, nan, 2.0, nan, 9.0, nan], [nan, 5.0, nan, nan, nan, 6.0]
    rows = table(t=[0, 0, 1, 1, 1, 2], gz=gyro, w=wheel)
    column_map = ColumnMap(TimeSource("t"), YAW | {"encoder_right": ColumnSource("w")})
    recording = build_recording(rows, column_map, None)
    np.testing.assert_array_equal(recording.t, [0, 1, 2])
    np.testing.assert_array_equal(recording["yaw_rate"], [1, 2, nan])
    np.testing.assert_array_equal(recording["encoder_right"], [5, nan, 6])
    assert recording.meta.duplicates_dropped == 2
    assert any("1 rows with the time of the row before were joined" in note for note in recording.meta.notes)


def test_times_that_go_back_are_refused_by_the_row_of_the_file():
    with pytest.raises(InputError, match=r"time goes back from 3 s to 2\.5 s after row 5"):
        build_recording(table(t=[0, 1, 1, 1, 3, 2.5], gz=np.ones(6)), ColumnMap(TimeSource("t"), YAW), None)


@pytest.mark.parametrize("times", [np.full(10, 5.0), np.floor(np.arange(10) / 4.0)])
def test_a_clock_that_stands_still_or_is_coarse_is_refused(times):
    with pytest.raises(InputError, match=r"of 10 rows repeat the time of the row before: t stands still"):
        build_recording(table(t=times, gz=np.arange(10)), ColumnMap(TimeSource("t"), YAW), None)


def test_units_and_signs():
    sources = {
        "yaw_rate": ColumnSource("gz", "deg/s", -1),
        "specific_force_x": ColumnSource("ax", "g"),
        "pose_yaw": ColumnSource("psi", "deg"),
    }
    rows = table(t=[0, 1000], gz=[180.0, 0], ax=[1.0, 0], psi=[90.0, 0])
    recording = build_recording(rows, ColumnMap(TimeSource("t", "ms"), sources), None)
    assert recording["yaw_rate"][0] == pytest.approx(-np.pi)
    assert recording["specific_force_x"][0] == pytest.approx(9.80665)
    assert recording["pose_yaw"][0] == pytest.approx(np.pi / 2)
    assert recording.t[1] == pytest.approx(1.0)
    assert sum("times" in note for note in recording.meta.notes) == 3


def test_body_commands_become_bank_speeds_and_need_the_robot(warthog):
    commands = BodyCommands(ColumnSource("v"), ColumnSource("w"))
    column_map = ColumnMap(TimeSource("t"), YAW, body_commands=commands)
    rows = table(t=[0, 1], gz=[0, 0], v=[0.6, 0], w=[1.0, 0])
    recording = build_recording(rows, column_map, warthog)
    assert recording["command_right"][0] == pytest.approx((0.6 + 0.54) / 0.3)
    assert recording["command_left"][0] == pytest.approx((0.6 - 0.54) / 0.3)
    with pytest.raises(InputError, match="--robot"):
        build_recording(rows, column_map, None)


def test_commands_outside_the_valid_rows_become_nan():
    sources = {"command_right": ColumnSource("r"), "command_left": ColumnSource("l")}
    column_map = ColumnMap(TimeSource("t"), sources, command_valid=ValidCommands("state", ("calib", "auto")))
    rows = table({"state": ["", "calib", "auto", "idle"]}, t=[0, 1, 2, 3], r=[1, 2, 3, 4], l=[1, 2, 3, 4])
    recording = build_recording(rows, column_map, None)
    np.testing.assert_array_equal(recording.command_valid, [False, True, True, False])
    np.testing.assert_array_equal(recording["command_right"], [np.nan, 2, 3, np.nan])


def test_without_commands_none_are_valid():
    recording = build_recording(table(t=[0, 1], gz=[1, 2]), ColumnMap(TimeSource("t"), YAW), None)
    assert not recording.command_valid.any()


def held_map(**options):
    names = tuple(options.pop("names", ("encoder_right",)))
    sources = {name: ColumnSource(name) for name in names}
    return ColumnMap(TimeSource("t"), sources, held=(HeldChannels(names, **options),))


def test_held_values_are_new_where_they_change():
    rows = table(t=np.arange(6), encoder_right=[5, 5, 5, 7, 7, 5])
    recording = build_recording(rows, held_map(), None)
    np.testing.assert_array_equal(recording["encoder_right"], [np.nan, np.nan, np.nan, 7, np.nan, 5])


def test_channels_of_one_group_are_new_together():
    rows = table(t=np.arange(4), pose_x=[1, 1, 2, 2], pose_y=[3, 3, 3, 4])
    recording = build_recording(rows, held_map(names=("pose_x", "pose_y")), None)
    np.testing.assert_array_equal(recording["pose_x"], [np.nan, np.nan, 2, 2])
    np.testing.assert_array_equal(recording["pose_y"], [np.nan, np.nan, 3, 4])


def test_a_flag_column_says_what_is_new_even_if_equal():
    column_map = ColumnMap(
        TimeSource("t"), {"pose_x": ColumnSource("x")}, held=(HeldChannels(("pose_x",), flag_column="new", period=0.1),)
    )
    recording = build_recording(table(t=np.arange(4), x=[1, 1, 1, 2], new=[1, 0, 1, 0]), column_map, None)
    np.testing.assert_array_equal(recording["pose_x"], [1, np.nan, 1, np.nan])
    assert recording.meta.held == {"pose_x": 0.1}


def test_zeros_at_standstill_are_new_once_a_period_and_other_repeats_are_not():
    values = [2, 0, 0, 0, 0, 0, 3, 3, 3, 3]
    rows = table(t=np.arange(10) * 0.1, encoder_right=values)
    recording = build_recording(rows, held_map(zero_period=0.2), None)
    expected = [np.nan, 0, np.nan, 0, np.nan, 0, 3, np.nan, np.nan, np.nan]
    np.testing.assert_array_equal(recording["encoder_right"], expected)


def test_infinite_values_are_no_samples():
    recording = build_recording(table(t=[0, 1], gz=[np.inf, 1]), ColumnMap(TimeSource("t"), YAW), None)
    assert np.isnan(recording["yaw_rate"][0])
