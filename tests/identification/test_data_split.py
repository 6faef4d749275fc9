from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.identification.data_split import clusters, evenly, held_out, split_recording, training
from ddagr_gym.identification.windows import cut_windows

GEOMETRY = {"wheel_radius": 0.3, "half_track": 0.5}


def windows_of(recording, duration=1.0, **more):
    return cut_windows([recording], duration, **GEOMETRY, **more)


def test_many_spans_alternate(make_recording):
    spans = [(k, k + 100) for k in range(0, 2000, 100)]
    split = split_recording(make_recording(spans=spans, segments=spans))
    np.testing.assert_array_equal(split.block, np.repeat(np.arange(20), 100))
    assert split.rule.startswith("20 spans alternate: the first trains")


def test_one_span_falls_into_blocks_of_a_quarter(make_recording):
    split = split_recording(make_recording(seconds=100.0))
    assert len(np.unique(split.block)) == 4
    np.testing.assert_allclose(np.bincount(split.block), 500, atol=2)


def test_a_long_drive_has_blocks_that_hold_a_30_s_horizon(make_recording):
    recording = make_recording(seconds=1000.0)
    split = split_recording(recording)
    windows = windows_of(recording, 30.0, stride=5.0)
    assert held_out(windows, [split]).sum() > 10
    np.testing.assert_allclose(np.bincount(split.block)[:-1], 800, atol=2)


def test_parts_are_apart_and_swapping_exchanges_them(make_recording):
    recording = make_recording()
    plain, swapped = (split_recording(recording, swapped) for swapped in (False, True))
    windows = windows_of(recording)
    first, second = training(windows, [plain]), held_out(windows, [plain])
    assert not (first & second).any()
    assert first.sum() == pytest.approx(second.sum(), abs=2)
    np.testing.assert_array_equal(first, held_out(windows, [swapped]))
    np.testing.assert_array_equal(second, training(windows, [swapped]))


def test_a_window_across_two_blocks_belongs_to_neither(make_recording):
    recording = make_recording()
    split = split_recording(recording)
    windows = windows_of(recording)
    edges = np.flatnonzero(np.diff(split.block)) + 1
    across = np.any([(windows.start < e) & (windows.start + windows.samples >= e) for e in edges], axis=0)
    assert across.any()
    np.testing.assert_array_equal(training(windows, [split]) | held_out(windows, [split]), ~across)


def test_commands_known_for_a_short_while_fall_into_both_parts(make_recording):
    valid = np.zeros(2000, dtype=bool)
    valid[520:880] = True
    recording = make_recording(command_valid=valid)
    split = split_recording(recording)
    commanded = windows_of(recording)
    assert training(commanded, [split]).sum() >= 5
    assert held_out(commanded, [split]).sum() >= 5
    assert "where commands are known" in split.rule
    assert set(split.block[valid]).isdisjoint(split.block[~valid])


def test_commands_known_throughout_do_not_change_the_blocks(make_recording):
    recording = make_recording()
    without = replace(recording, command_valid=np.zeros(2000, dtype=bool))
    np.testing.assert_array_equal(split_recording(recording).block, split_recording(without).block)


def test_close_windows_are_resampled_together(make_recording):
    recording = make_recording()
    windows = windows_of(recording)
    found = clusters(windows, [split_recording(recording)])
    together = found[:, None] == found
    apart = np.abs(windows.time[:, None] - windows.time) > 10.0
    assert not (together & apart).any()
    assert len(np.unique(found)) < windows.count / 4


@pytest.mark.parametrize(("count", "most", "expected"), [(0, 5, []), (3, 5, [0, 1, 2]), (10, 4, [0, 3, 6, 9])])
def test_evenly(count, most, expected):
    assert evenly(count, most).tolist() == expected
