from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.alignment import Stream, align, nearest_rows, regular_base

TIMES = st.lists(st.integers(0, 400), min_size=1, max_size=40, unique=True).map(lambda v: np.sort(np.array(v)) / 10)


@given(base=TIMES, t=TIMES, tolerance=st.floats(0.01, 3.0))
def test_matches_are_unique_near_and_the_nearest_of_their_row(base, t, tolerance):
    rows, samples = nearest_rows(base, t, tolerance)
    assert len(set(rows.tolist())) == len(rows)
    assert len(set(samples.tolist())) == len(samples)
    distance = np.abs(base[rows] - t[samples])
    assert np.all(distance <= tolerance)
    for row, sample in zip(rows, samples, strict=True):
        own = np.abs(base[row] - t[sample])
        # No other row is nearer to this sample, and no other sample of this row is nearer to it.
        assert own <= np.min(np.abs(base - t[sample])) + 1e-12
        mine = [s for s in range(t.size) if np.argmin(np.abs(base - t[s])) == row]
        assert own <= min(np.abs(base[row] - t[s]) for s in mine) + 1e-12 if mine else True


@given(base=TIMES, tolerance=st.floats(0.01, 3.0))
def test_samples_on_the_rows_all_come_through(base, tolerance):
    rows, samples = nearest_rows(base, base, tolerance)
    np.testing.assert_array_equal(np.sort(rows), np.arange(base.size))
    np.testing.assert_array_equal(rows[np.argsort(samples)], np.arange(base.size))


def test_nothing_is_invented_between_samples():
    base = np.arange(10) * 0.02
    slow = Stream(np.array([0.001, 0.101]), {"pose_x": np.array([1.0, 2.0])})
    channels, lost = align(base, {"pose": slow}, 0.01)
    expected = np.full(10, np.nan)
    expected[[0, 5]] = [1.0, 2.0]
    np.testing.assert_array_equal(channels["pose_x"], expected)
    assert lost == {"pose": 0}


def test_samples_far_from_any_row_and_crowded_ones_are_counted_as_lost():
    fast = Stream(np.array([0.0, 0.1, 0.4, 7.0]), {"yaw_rate": np.array([1.0, 2.0, 3.0, 4.0])})
    channels, lost = align(np.array([0.0, 1.0]), {"imu": fast}, 0.45)
    np.testing.assert_array_equal(channels["yaw_rate"], [1.0, np.nan])
    assert lost == {"imu": 3}


def test_unsorted_stamps_are_sorted_and_repeated_ones_kept_once():
    stream = Stream(np.array([2.0, 1.0, 1.0]), {"yaw_rate": np.array([20.0, 10.0, 11.0])}).sorted()
    np.testing.assert_array_equal(stream.t, [1.0, 2.0])
    np.testing.assert_array_equal(stream.channels["yaw_rate"], [10.0, 20.0])


def test_the_first_stream_that_has_a_channel_keeps_it():
    one = Stream(np.array([0.0]), {"roll": np.array([1.0])})
    two = Stream(np.array([0.0]), {"roll": np.array([2.0])})
    channels, _ = align(np.array([0.0]), {"imu": one, "pose": two}, 0.1)
    assert channels["roll"][0] == 1.0


def test_empty_streams_give_no_rows():
    rows, samples = nearest_rows(np.empty(0), np.array([1.0]), 1.0)
    assert rows.size == samples.size == 0


def test_a_regular_base_and_its_limit():
    np.testing.assert_allclose(regular_base(5.0, 6.0, 4.0, 100), [5.0, 5.25, 5.5, 5.75, 6.0])
    with pytest.raises(InputError, match="--maximum-rows"):
        regular_base(0.0, 1e9, 100.0, 1000)
    with pytest.raises(InputError, match="Hz"):
        regular_base(0.0, 1.0, 0.0, 1000)


def test_a_command_far_from_every_row_holds_from_the_next_one_on():
    """No rows from 1 to 3 s: of two commands meanwhile the later one is in force then."""
    base = np.array([0.0, 0.5, 1.0, 3.0, 3.5])
    stamps = np.array([-9.0, -5.0, 0.5, 1.6, 2.4, 9.0])
    values = np.arange(6.0)
    commands = Stream(stamps, {"command_right": values, "command_left": -values})
    channels, lost = align(base, {"command": commands}, 0.1)
    np.testing.assert_array_equal(channels["command_right"], [1.0, 2.0, np.nan, 4.0, np.nan])
    assert lost == {"command": 3}
    later = Stream(np.array([2.4, 3.05]), {"command_right": np.array([1.0, 2.0])})
    np.testing.assert_array_equal(align(base, {"command": later}, 0.1)[0]["command_right"][3], 2.0)
    other = Stream(stamps, {"yaw_rate": values})
    np.testing.assert_array_equal(
        align(base, {"imu": other}, 0.1)[0]["yaw_rate"], [np.nan, 2.0, np.nan, np.nan, np.nan]
    )
