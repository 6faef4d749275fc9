"""Drives at which sizes change: found where and of the kind that they are, and seldom where nothing did."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import stdtr

from ddagr_gym.diagnosis.answer.drive_series import LAST, PASSES, SINGLE, STAYS
from ddagr_gym.diagnosis.change.shifts import family_probability
from ddagr_gym.diagnosis.series.change_points import MOST_EVENTS, change_points
from tests.diagnosis.series.made_points import DEGREES, SHARED, drawn


def changed(seed: int, drives: int, rows: slice, by: float, size: int = 0):
    sizes = drawn(seed, drives)
    values = sizes.values.copy()
    values[rows, size] += by
    return replace(sizes, values=values)


def test_drives_in_which_nothing_changed_seldom_have_an_event():
    alarms = [bool(change_points(drawn(seed, 12))) for seed in range(80)]
    assert np.mean(alarms) < 0.05


def test_a_small_change_that_stays_is_found_where_no_drive_alone_tells_it():
    found = [change_points(changed(seed, 30, slice(15, None), 2.5)) for seed in range(20)]
    said = [events[0] for events in found if events]
    assert len(said) >= 16
    assert all(event.place.kind(30) == STAYS for event in said)
    assert all(event.earliest <= 15 <= event.latest for event in said)
    assert max(abs(event.place.first - 15) for event in said) <= 1


@pytest.mark.parametrize(
    ("drives", "rows", "kind", "drive"),
    [
        (12, slice(4, 5), SINGLE, 4),
        (12, slice(11, 12), LAST, 11),
        (12, slice(0, None), STAYS, 0),
        (12, slice(7, None), STAYS, 7),
        (20, slice(6, 13), PASSES, 6),
        (1, slice(0, 1), LAST, 0),
    ],
)
def test_a_large_change_is_of_its_kind(drives, rows, kind, drive):
    (event,) = change_points(changed(3, drives, rows, 25.0))
    assert (event.place.kind(drives), event.place.first) == (kind, drive)
    assert (event.earliest, event.latest) == (drive, drive)
    assert abs(event.shifts[0] - 25.0) < 4.0
    assert np.argmin(event.probabilities) == 0


def test_a_change_on_a_change_is_a_second_event():
    sizes = changed(5, 20, slice(6, None), 20.0)
    values = sizes.values.copy()
    values[13:, 1] += 20.0
    first, second = change_points(replace(sizes, values=values))
    assert (first.place.first, second.place.first) == (6, 13)
    assert np.argmin(first.probabilities) == 0
    assert np.argmin(second.probabilities) == 1


def test_one_drive_is_judged_as_a_comparison_judges_it():
    sizes = changed(7, 1, slice(0, 1), 25.0)
    (event,) = change_points(sizes)
    deviation = sizes.deviations[0, 0] * np.hypot(1.0, SHARED)
    assert event.deviations[0] == pytest.approx(deviation)
    single = 2.0 * stdtr(DEGREES, -sizes.values[0, 0] / deviation)
    assert event.probabilities[0] == pytest.approx(family_probability(single, sizes.values.shape[1]))


def test_a_size_that_some_drives_do_not_show_is_judged_by_the_others():
    sizes = changed(9, 14, slice(8, None), 20.0)
    values = sizes.values.copy()
    values[[2, 10], 0] = np.nan
    values[:, 5] = np.nan
    (event,) = change_points(replace(sizes, values=values))
    assert event.place.first == 8
    assert event.probabilities[5] == 1.0


def test_a_parameter_without_doubt_of_its_mean_does_not_hide_others():
    sizes = changed(4, 12, slice(7, None), 20.0)
    scales = np.geomspace(1e-4, 1e4, sizes.values.shape[1])
    found = replace(
        sizes, values=sizes.values * scales, deviations=sizes.deviations * scales,
        mean_deviations=np.zeros(len(scales)),
    )  # fmt: skip
    assert [(event.place.first, event.place.end) for event in change_points(found)] == [(7, 12)]


def test_odd_drives_do_not_hide_each_other_and_their_number_is_bounded():
    sizes = drawn(1, 40)
    values = sizes.values.copy()
    values[1::2, 0] += 100.0 * np.arange(1, 21)
    assert len(change_points(replace(sizes, values=values))) == MOST_EVENTS


def test_what_a_moved_parameter_does_beside_is_no_event():
    """A fit draws a parameter back by more or less, depending on the drive."""
    sizes = changed(4, 14, slice(7, None), 40.0)
    values = sizes.values.copy()
    values[7:, 1] += 24.0
    values[12, 1] -= 14.0
    sizes = replace(sizes, values=values)
    assert [event.place.first for event in change_points(sizes)] == [7, 12]
    drawn_back = np.array([False, True, False, False, False, False])
    assert [event.place.first for event in change_points(replace(sizes, drawn=drawn_back))] == [7]


def test_a_large_change_that_is_not_quite_steady_is_one_event():
    sizes = changed(4, 14, slice(7, None), 400.0)
    values = sizes.values.copy()
    values[10, 0] += 20.0
    assert [event.place.first for event in change_points(replace(sizes, values=values))] == [7]
