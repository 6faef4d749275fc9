"""Simulated drives over time against a robot that is known from others."""

from __future__ import annotations

import pytest

from ddagr_gym.diagnosis.answer.drive_series import PARAMETER, STAYS
from ddagr_gym.diagnosis.series.conclusion import conclude_series, drive_row
from ddagr_gym.diagnosis.series.one_drive import answer_for
from tests.diagnosis.change.conftest import drive
from tests.diagnosis.change.conftest import ordinary_robot as ordinary_robot


@pytest.mark.slow
def test_the_first_changed_drive_is_found_with_its_name(ordinary_robot):
    recordings = [drive(61), drive(62), drive(63), *(drive(seed, "gyro_bias=0.004") for seed in (64, 65, 66))]
    answers = [answer_for(recording, ordinary_robot, "field") for recording in recordings]
    rows = [drive_row(recording.meta.source, "", found) for recording, found in zip(recordings, answers, strict=True)]
    series = conclude_series(rows, [found.points for found in answers], "name", ordinary_robot, "field")
    (event,) = series.events
    assert (event.kind, event.drive, next(iter(event.names))) == (STAYS, 3, "gyro_bias")
    bias = next(item for item in event.moved if (item.effect, item.size) == ("gyro_bias", "bias"))
    assert abs(bias.shift - 0.004) < 0.001
    charts = {(chart.effect, chart.size): chart for chart in series.charts}
    assert len(charts["gyro_bias", "bias"].ordinary) == 3
    assert (PARAMETER, "motor rate") in charts
    assert not any(point.outside for point in charts[PARAMETER, "motor rate"].points)


@pytest.mark.slow
def test_the_points_of_a_drive_are_the_shifts_of_its_answer(ordinary_robot):
    found = answer_for(drive(64, "gyro_bias=0.004"), ordinary_robot, "field")
    point = next(item for item in found.points if item.effect == "gyro_bias")
    shift = next(item for item in found.diagnosis.change.shifts if item.effect == "gyro_bias").sizes["bias"]
    assert point.value == pytest.approx(shift.value)
    assert point.deviation**2 + point.mean_deviation**2 == pytest.approx(shift.deviation**2)
    assert 0.0 < point.mean_deviation < point.deviation
    assert found.seconds == pytest.approx(50.0, abs=0.1)


@pytest.mark.slow
def test_an_ordinary_drive_is_compared_with_the_others(ordinary_robot):
    found = answer_for(drive(1), ordinary_robot, "field", "drive_1.csv")
    assert found.left_out
    assert found.diagnosis.verdict == ("none",)
    assert found.diagnosis.change.ordinary == ("drive_2.csv", "drive_3.csv")
    assert {len(point.ordinary) for point in found.points if point.effect} == {2}
