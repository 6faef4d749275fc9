"""Changes that begin in the middle of a real drive, and the scores of what is said of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.real_mid_drive import (
    CHANGES,
    EARLIEST,
    LATEST,
    begins_at,
    figures,
    first_difference,
    is_told_to_begin,
    later,
)
from benchmarks.what_changed import ALL
from ddagr_gym import simulate

ROWS = 200


def table():
    rows = np.arange(ROWS)
    columns = {"seq": rows // 20, "t": 0.05 * (rows % 20), "window": 0 * rows, "imu_gz": np.sin(rows)}
    return {name: [f"{value:.9g}" for value in values] for name, values in columns.items()}


def case(told: str = "begins", interval: list[float] | None = None, **others):
    onset = {"kind": told, "value": 100.0, "interval": interval or [95.0, 105.0]}
    return {
        "drive": "open/warthog_sand", "change": "gyro_scaled", "truth": "gyro_scale", "verdict": ["gyro_scale"],
        "complete": True, "sets": [["gyro_scale"]], "sizes": {"gyro_scale": {"scale": [1.09, 1.05, 1.12]}},
        "begins": 101.0, "onsets": {"gyro_scale": onset}, **others,
    }  # fmt: skip


@pytest.mark.parametrize("name", ["gyro_scaled", "gyro_biased"])
def test_rows_before_a_change_begins_stay_as_they_are(name):
    before, after = table(), later(ALL[name]).write(table())
    first = round(begins_at(name) * ROWS)
    assert after["imu_gz"][:first] == before["imu_gz"][:first]
    assert after["imu_gz"][first:] == list(ALL[name].write(before)["imu_gz"][first:])
    assert {key: values for key, values in after.items() if key != "imu_gz"} == {
        key: values for key, values in before.items() if key != "imu_gz"
    }


def test_changes_begin_one_after_another_in_the_middle_of_a_drive():
    shares = [begins_at(name) for name in CHANGES]
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (EARLIEST, LATEST)


def test_the_time_of_a_change_is_that_of_the_first_sample_that_differs():
    before = simulate("straight").recording
    yaw_rate = before["yaw_rate"].copy()
    yaw_rate[30:] += 0.1
    after = replace(before, channels={**before.channels, "yaw_rate": yaw_rate})
    assert first_difference(before, after) == before.t[30]


def test_a_time_counts_where_the_true_effect_is_said_to_begin():
    late, unnamed = case(interval=[110.0, 120.0]), case(onsets={}, verdict=["none"], sets=[], sizes={})
    cases = [case(), late, case(told="constant"), unnamed]
    assert [is_told_to_begin(item) for item in cases] == [True, True, False, False]
    found = figures(cases)
    assert found["said to begin in mid-drive"]["value"] == 0.5
    assert found["time inside its interval"]["value"] == 0.5
    assert found["right or in a set of at most three"]["value"] == 0.75
    assert found["intervals that hold the size"]["count"] == 2
