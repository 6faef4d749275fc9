from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.identification.timing_repair import aligned_poses, bridged


@pytest.fixture
def joined(make_recording):
    """Two steps of two windows each; 50 ms are missing at the join inside a step."""
    t = np.arange(40) * 0.05
    t[10:] += 0.05
    t[20:] += 5.0
    t[30:] += 0.05
    rows = np.arange(40.0)
    ranges = {"segments": [(0, 10), (10, 20), (20, 30), (30, 40)], "spans": [(0, 20), (20, 40)]}
    return make_recording(seconds=2.0, t=t, yaw_rate=rows, command_right=rows, command_left=rows, **ranges)


def test_short_joins_are_bridged_by_empty_rows(joined):
    even = bridged(joined)
    assert len(even) == 42
    assert even.meta.segments == even.meta.spans == ((0, 21), (21, 42))
    for segment in even.segments():
        np.testing.assert_allclose(np.diff(even.t[segment]), 0.05, atol=1e-9)
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(even["yaw_rate"])), [10, 31])
    assert "2 rows without samples" in even.meta.notes[-1]


def test_commands_stay_in_force_over_a_bridge(joined):
    right, _ = bridged(joined).held_commands()
    np.testing.assert_allclose(right[9:12], [9.0, 9.0, 10.0])


def test_spans_and_long_gaps_are_never_joined(joined):
    assert len(bridged(joined, longest=0.01).meta.segments) == 4
    assert bridged(joined, longest=100.0).meta.spans == ((0, 21), (21, 42))


def test_an_even_recording_stays_as_it_is(make_recording):
    recording = make_recording()
    assert bridged(recording) is recording


def test_late_poses_move_to_their_own_rows(make_recording):
    t = np.arange(200) * 0.05
    pose = np.where(np.arange(200) % 4 == 0, t - 0.3, np.nan)
    moved = aligned_poses(make_recording(seconds=10.0, pose_x=pose, pose_y=pose, pose_yaw=pose), 0.3)
    known = np.isfinite(moved["pose_x"])
    np.testing.assert_allclose(moved["pose_x"][known], t[known], atol=1e-9)
    # those of the first 0.3 s are from before the recording
    assert known.sum() == np.isfinite(pose[t >= 0.3 - 1e-9]).sum()
    assert "0.3 s earlier" in moved.meta.notes[-1]


def test_poses_in_time_stay(make_recording):
    recording = make_recording(pose_x=np.zeros(2000))
    assert aligned_poses(recording, 0.0) is recording


def test_time_must_increase(make_recording):
    with pytest.raises(InputError):
        make_recording(t=np.zeros(2000))
