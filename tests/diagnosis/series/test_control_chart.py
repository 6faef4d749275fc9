"""Control charts: limits by the formulas of their sources."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import stdtrit

from ddagr_gym.diagnosis.series.control_chart import WEIGHT, control_chart, series_of
from tests.diagnosis.series.made_points import DEGREES, SHARED, points


def series(values):
    return series_of({drive: points([value]) for drive, value in enumerate(values)})["gyro_bias", "size"]


def test_limits_are_those_of_shewhart_and_roberts():
    chart = control_chart(series(np.zeros(60)), tests=120)
    quantile = stdtrit(DEGREES, 1.0 - 0.5 * (1.0 - 0.95 ** (1.0 / 120.0)))
    assert chart.points[0].limit == pytest.approx(quantile * np.hypot(1.0, SHARED))
    assert chart.points[0].average_limit == pytest.approx(WEIGHT * chart.points[0].limit)
    settled = quantile * np.sqrt(WEIGHT / (2.0 - WEIGHT) + SHARED**2)  # Roberts (1959), with a mean that is in doubt
    assert chart.points[-1].average_limit == pytest.approx(settled, rel=1e-4)


def test_the_mean_shows_a_small_change_that_no_drive_shows():
    chart = control_chart(series([0.0] * 10 + [5.0] * 15), tests=50)
    assert not any(point.outside for point in chart.points)
    assert next(point.drive for point in chart.points if point.average_outside) > 10
    assert chart.points[10].average == pytest.approx(WEIGHT * 5.0)


def test_a_drive_that_shows_nothing_of_a_size_has_no_point():
    found = series_of({0: points([1.0]), 2: points([1.0]), 5: ()})["gyro_bias", "size"]
    chart = control_chart(found, tests=4)
    assert [point.drive for point in chart.points] == [0, 2]
    assert chart.points[1].average == pytest.approx(1.0 - (1.0 - WEIGHT) ** 2)


def test_a_drive_that_says_little_has_a_wide_limit():
    (point,) = points([3.0])
    chart = control_chart({0: point, 1: replace(point, deviation=10.0)}, tests=2)
    assert chart.points[1].limit > 5.0 * chart.points[0].limit
