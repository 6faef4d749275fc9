"""What changed as a table: distances in place of gains, units in words, and how much was compared."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ddagr_gym.diagnosis.answer.verdict import DataSource
from ddagr_gym.reporting.change_text import changed_rows
from ddagr_gym.reporting.diagnosis_tables import tiles
from ddagr_gym.reporting.parameter_units import unit_in_words
from tests.reporting.made_diagnosis import diagnosis, entries


def finding(**changes):
    return entries()["findings"][0] | changes


def test_distances_are_those_whose_half_squares_gains_are():
    first = changed_rows(diagnosis(findings=[finding(gain=8.0, gate=4.5)]))[0]
    assert first[4:6] == ("4.0", "3.0")


def test_what_is_seen_in_the_values_has_no_distance():
    first = changed_rows(diagnosis(findings=[finding(gain=0.9, gate=0.0)]))[0]
    assert first[4:] == ("–", "–", "accelerometer_bias 0.20")


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
