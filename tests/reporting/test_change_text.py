"""What changed as a table: distances in place of gains, units in words, and how much was compared."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ddagr_gym.diagnosis.answer.verdict import DataSource
from ddagr_gym.reporting.change_text import change_text, changed_rows
from ddagr_gym.reporting.diagnosis_tables import tiles
from ddagr_gym.reporting.parameter_units import unit_in_words
from tests.diagnosis.result.test_near_miss import CHANGE
from tests.reporting.made_diagnosis import diagnosis, entries


def finding(**changes):
    return entries()["findings"][0] | changes


def test_distances_are_those_whose_half_squares_gains_are():
    first = changed_rows(diagnosis(findings=[finding(gain=8.0, gate=4.5)]))[0]
    assert first[4:6] == ("4.0", "3.0")


def test_what_is_seen_in_the_values_has_no_distance():
    first = changed_rows(diagnosis(findings=[finding(gain=0.9, gate=0.0)]))[0]
    assert first[4:] == ("–", "–", "accelerometer_bias: less likely (20 %)")


def test_a_rival_of_the_same_weight_is_as_likely():
    even = finding(equivalence_set={"slope": 0.5, "payload": 0.5})
    assert changed_rows(diagnosis(findings=[even]))[0][-1] == "payload: as likely"


def test_the_table_of_all_effects_is_by_distance_over_limit_and_says_what_it_is():
    told = change_text(replace(diagnosis(), change=CHANGE))
    assert told.index("Offset centre of mass") < told.index("Gyro bias")
    assert "A first estimate of each effect as if it were the only one; the answer above fits together" in told
    assert "Only 3 ordinary drives say what is usual" in told


@pytest.mark.parametrize(
    ("name", "unit", "words"),
    [
        ("soil_strength", "-", "log of a factor"),
        ("turning_limit", "-", "log of a factor"),
        ("exit_angle_ratio", "-", "added, no unit"),
        ("slope_x", "-", "added, no unit"),
        ("limit_imbalance", "-", "added, no unit"),
        ("command_delay", "s", "s"),
    ],
)
def test_units_say_whether_a_number_is_added(name, unit, words):
    assert unit_in_words(name, unit) == words


def test_a_tile_says_how_much_was_compared():
    made = replace(diagnosis(), data=(DataSource("drive.csv", "0" * 64, 600, 60.0),))
    found = [tile["label"] for tile in tiles(made, 48.0)]
    assert any(label.startswith("of 60 s compared, in ") for label in found)
    some = [tile["label"] for tile in tiles(made, 20.0)]
    assert any(label.startswith("compared, in windows evenly chosen from 60 s in ") for label in some)
