"""Matched drives: what they draw, and the tables over them."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.filter_study.consistency import (
    MOST_RESISTANCE,
    counted,
    instants,
    matched_drive,
    matched_model,
    nees_table,
    nis_bands,
    row_turn_commands,
)
from ddagr_gym.errors import InputError
from ddagr_gym.estimation import CHANNELS
from ddagr_gym.estimation.layout import PARAMETER
from ddagr_gym.parameters import Sensors, WheelEncoder
from ddagr_gym.presets import get_robot

PERIOD = 0.008


@pytest.fixture(scope="module")
def drives():
    sensors = Sensors()
    model = matched_model(get_robot("ddagr"), sensors, "soil_known_to_15_percent")
    commands = row_turn_commands("left", 0.9, PERIOD)
    return [matched_drive(model, commands, sensors.encoder, np.random.default_rng([4, n])) for n in range(40)]


def test_the_filter_is_consistent_where_its_model_is_right(drives):
    table = nees_table(drives)
    for block in ("velocity", "parameters", "biases"):
        low, high = table[block]["band"]
        # the mean over time lies where that of one instant does
        assert low < table[block]["mean"] < high
        assert len(table[block]["by_instant"]) == len(drives[0]["nees"][block])


def test_bands_hold_one_and_counting_widens_those_of_the_encoders(drives):
    bands = nis_bands(drives)
    assert list(bands) == list(CHANNELS)
    for name, item in bands.items():
        assert item["band"][0] <= item["mean"] <= item["band"][1]
        assert item["mean_gaussian"] == pytest.approx(1.0, abs=0.25), name


def test_a_known_error_gives_the_table_s_values():
    drive = {"nees": {b: [1.0, 2.0, 9.0] for b in ("velocity", "bank_speeds", "parameters", "biases")}}
    shorter = {"nees": {b: [3.0, 2.0] for b in drive["nees"]}}
    velocity = nees_table([drive, shorter])["velocity"]
    assert velocity["by_instant"] == [2.0, 2.0]
    assert velocity["mean"] == velocity["highest"] == 2.0
    assert velocity["median_drive"] == pytest.approx(2.0)


def test_counts_are_whole_and_right_on_average():
    encoder = WheelEncoder(counts_per_revolution=1000.0)
    step = 2 * np.pi / 1000.0 / PERIOD
    read = counted(np.full((5000, 2), 0.7), encoder, PERIOD, np.random.default_rng(1))
    np.testing.assert_allclose(read / step, np.round(read / step), atol=1e-9)
    np.testing.assert_allclose(read.mean(axis=0), 0.7, rtol=2e-3)


def test_commands_turn_to_their_side():
    left, right = (row_turn_commands(side, 0.9, PERIOD) for side in ("left", "right"))
    np.testing.assert_array_equal(left, right[:, ::-1])
    middle = len(left) // 2
    assert left[middle, 0] > left[middle, 1] > 0.0
    assert left[0, 0] == left[0, 1]


def test_soils_on_which_nothing_moves_are_drawn_again():
    from benchmarks.filter_study.consistency import _moving_soil

    model = matched_model(get_robot("ddagr"), Sensors(), "default_prior")
    rng = np.random.default_rng(2)
    ratios = [np.exp(s[PARAMETER + 3] - s[PARAMETER]) for s in (_moving_soil(model, rng) for _ in range(200))]
    assert max(ratios) < MOST_RESISTANCE
    assert max(ratios) > 0.4


def test_instants_are_a_second_apart():
    np.testing.assert_array_equal(instants(400, PERIOD), [124, 249, 374])


def test_an_unknown_prior_is_named():
    with pytest.raises(InputError, match="unknown prior"):
        matched_model(get_robot("ddagr"), Sensors(), "default")
