from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.identification.windows import CHANNELS, cut_runs, cut_windows

GEOMETRY = {"wheel_radius": 0.3, "half_track": 0.5}


@pytest.fixture(scope="module")
def counting(make_recording):
    """Commands that count the rows, so that a window's commands say which rows they came from."""

    def make(**columns):
        rows = np.arange(2000.0)
        return make_recording(command_right=rows, command_left=-rows, yaw_rate=rows / 100.0, **columns)

    return make


def test_a_window_holds_the_samples_after_its_start(counting):
    windows = cut_windows([counting()], 2.0, **GEOMETRY)
    assert (windows.count, windows.samples, windows.duration) == (49, 40, pytest.approx(2.0))
    np.testing.assert_allclose(windows.measured[3, :, CHANNELS.index("yaw_rate")], np.arange(121, 161) / 100.0)
    assert windows.time[3] == pytest.approx(6.0)


def test_the_command_in_force_until_a_sample_is_that_of_the_samples_row(counting):
    windows = cut_windows([counting()], 2.0, **GEOMETRY)
    np.testing.assert_allclose(windows.drive()[3, :, 0], np.arange(121, 161))
    np.testing.assert_allclose(windows.drive(0.1)[3, :, 0], np.arange(119, 159))
    np.testing.assert_allclose(windows.drive(0.025)[3, :, 1], -np.arange(120.5, 160.5))


def test_a_late_clock_takes_the_drive_from_the_future_that_was_kept(counting):
    windows = cut_windows([counting()], 2.0, ahead=0.2, **GEOMETRY)
    np.testing.assert_allclose(windows.drive(-0.1)[3, :, 0], np.arange(123, 163))
    held = windows.drive(-10.0)[3, :, 0]
    np.testing.assert_allclose(held, 164.0)


def test_windows_stay_inside_segments_and_where_commands_are_known(counting):
    valid = np.ones(2000, dtype=bool)
    valid[500:600] = False
    windows = cut_windows([counting(command_valid=valid, segments=[(0, 1000), (1010, 2000)])], 2.0, **GEOMETRY)
    rows = windows.start[:, None] + np.arange(41)
    assert not ((rows[:, :1] < 1000) & (rows[:, -1:] >= 1000)).any()
    assert valid[rows[:, 1:]].all()


def test_stride_makes_windows_overlap(counting):
    windows = cut_windows([counting()], 2.0, stride=1.0, **GEOMETRY)
    assert set(np.diff(windows.start)) == {20}


def test_a_stride_holds_across_short_segments(counting):
    """Recordings in pieces of 2 s: one window in four, as in a recording without gaps."""
    pieces = [(row, row + 41) for row in range(0, 1960, 41)]
    windows = cut_windows([counting(segments=pieces)], 2.0, stride=8.0, **GEOMETRY)
    assert set(np.diff(windows.start)) == {164}
    assert cut_windows([counting(segments=pieces)], 2.0, **GEOMETRY).count == len(pieces)


def test_encoders_that_hold_samples_are_joined_by_lines(counting):
    speeds = np.where(np.arange(2000) % 5 == 0, 0.1 * np.arange(2000), np.nan)
    recording = counting(encoder_right=speeds, encoder_left=speeds)
    windows = cut_windows([recording], 2.0, drive_by="encoders", **GEOMETRY)
    np.testing.assert_allclose(windows.drive()[3, :, 0], 0.1 * np.arange(121, 161), atol=1e-9)


def test_encoders_with_a_long_gap_do_not_drive_across_it(counting):
    speeds = np.zeros(2000)
    speeds[400:440] = np.nan
    windows = cut_windows([counting(encoder_right=speeds, encoder_left=speeds)], 2.0, drive_by="encoders", **GEOMETRY)
    inside = (windows.start < 425) & (windows.start + 40 > 415)
    assert not inside.any()


def test_the_first_guess_is_the_state_that_the_sensors_show(make_recording):
    recording = make_recording(encoder_right=np.full(2000, 2.0), encoder_left=np.full(2000, 1.0))
    windows = cut_windows([recording], 2.0, **GEOMETRY)
    np.testing.assert_allclose(windows.initial[0], [0, 0, 0, 0.45, 0, 0, 2, 1])


def test_runs_are_the_longest_stretches(counting):
    valid = np.ones(2000, dtype=bool)
    valid[500:600] = False
    runs = cut_runs([counting(command_valid=valid)], **GEOMETRY)
    assert [(run.count, run.samples) for run in runs] == [(1, 499), (1, 1399)]


def test_a_subset_keeps_what_belongs_together(counting):
    windows = cut_windows([counting()], 2.0, **GEOMETRY)
    chosen = windows.subset(np.array([5, 2]))
    np.testing.assert_array_equal(chosen.start, windows.start[[5, 2]])
    np.testing.assert_array_equal(chosen.drive(), windows.drive()[[5, 2]])
    assert chosen.history == windows.history


def test_too_long_a_window_is_refused_with_the_remedy(counting):
    with pytest.raises(InputError, match="no window of 200 s fits into valid commands"):
        cut_windows([counting()], 200.0, **GEOMETRY)


def test_recordings_of_two_rates_are_refused(counting, make_recording):
    with pytest.raises(InputError, match=r"have periods .* replay those of one rate"):
        cut_windows([counting(), make_recording(period=0.02)], 2.0, **GEOMETRY)


def test_an_unknown_drive_is_refused(counting):
    with pytest.raises(InputError, match="drive_by is 'wind'"):
        cut_windows([counting()], 2.0, drive_by="wind", **GEOMETRY)


def test_a_drive_is_interpolated_between_samples(make_windows):
    windows = make_windows(np.arange(40.0)[None, :, None] * np.ones(2))
    np.testing.assert_allclose(windows.drive(0.0125)[0, :3, 0], [9.75, 10.75, 11.75])


def test_speeds_are_those_of_the_rows_and_shorter_windows_keep_what_is_left(counting):
    windows = cut_windows([counting(encoder_right=np.arange(2000.0), encoder_left=np.arange(2000.0))], 2.0, **GEOMETRY)
    later = windows.subset(np.arange(windows.count) > 0)
    rows = later.start[:, None] + 1 - later.history + np.arange(later.history + later.samples)
    np.testing.assert_allclose(later.speeds[..., 0], rows)
    assert np.isnan(windows.past_speeds[0, : windows.history - 1]).all()
    short = replace(windows, measured=windows.measured[:, :10])
    np.testing.assert_array_equal(short.speeds, windows.speeds[:, : windows.history + 10])
    np.testing.assert_array_equal(short.past_speeds, windows.past_speeds)


def test_what_was_driven_right_before_is_kept_where_it_is_known(counting):
    speeds = 0.1 * np.arange(2000)
    windows = cut_windows([counting(encoder_right=speeds, encoder_left=speeds)], 2.0, run_in=3.0, **GEOMETRY)
    run_in = windows.run_in
    assert run_in is not None
    # before 3.5 s, of which 0.5 s are its own history, less is known; the row before the first command is none
    assert run_in.leads_to.tolist() == list(range(2, windows.count))
    assert (run_in.windows.samples, run_in.windows.run_in) == (60, None)
    np.testing.assert_array_equal(run_in.windows.start + 60, windows.start[2:])
    np.testing.assert_array_equal(run_in.windows.drive()[0, :, 0], np.arange(21, 81))
    np.testing.assert_allclose(run_in.windows.initial[:, 6], 0.1 * run_in.windows.start)


def test_chosen_windows_keep_what_was_driven_before_them(counting):
    speeds = 0.1 * np.arange(2000)
    windows = cut_windows([counting(encoder_right=speeds, encoder_left=speeds)], 2.0, run_in=3.0, **GEOMETRY)
    chosen = windows.subset(np.array([7, 0, 3, 7]))
    assert chosen.run_in is not None
    assert chosen.run_in.leads_to.tolist() == [0, 2, 3]
    np.testing.assert_array_equal(chosen.run_in.windows.start + 60, chosen.start[[0, 2, 3]])
    none = windows.subset(np.arange(windows.count) < 2)
    assert none.run_in is not None
    assert not len(none.run_in.leads_to)
