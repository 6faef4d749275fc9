"""Control charts of sizes over drives: each drive against limits, and an exponentially weighted mean for small changes.

With the shift x_i of drive i from the mean of ordinary drives, its own deviation s_i, and the deviation c of that mean,
which all drives share,

    |x_i| > t sqrt(s_i^2 + c^2)                                                                                     (1)

is Shewhart's chart, and with z_i = (1 - r) z_(i-1) + r x_i, z_0 = 0,

    |z_i| > t sqrt(q_i + (1 - (1 - r)^i)^2 c^2),    q_i = (1 - r)^2 q_(i-1) + r^2 s_i^2                             (2)

that of S. W. Roberts (Technometrics 1 (1959) 239), with the variance of the mean as it is from the first drive on and
for drives that are not equally exact. t is the two-sided quantile of Student's t with the degrees of freedom of
ordinary drives, at the level of one of 2 n q tests whose family has 5 % (Z. Sidak): n drives, q sizes, two charts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeAlias

import numpy as np

from ddagr_gym.diagnosis.answer.drive_series import ChartPoint, SizeChart, SizePoint
from ddagr_gym.diagnosis.change.shifts import distance_at, single_level

WEIGHT = 0.2
"""Of the newest drive in the mean: usual for changes of about one standard deviation (J. M. Lucas, M. S. Saccucci,
Technometrics 32 (1990) 1)."""

CHARTS = 2
"""Each drive is looked at alone and in the mean."""

Key: TypeAlias = tuple[str, str]
"""Effect and size."""

Series: TypeAlias = Mapping[int, SizePoint]
"""Points of one size by the number of the drive."""


def series_of(points: Mapping[int, Sequence[SizePoint]]) -> dict[Key, dict[int, SizePoint]]:
    """Points of every size by drive, in the order of the drives.

    Args:
        points: of each drive by its number.
    """
    found: dict[Key, dict[int, SizePoint]] = {}
    for drive in sorted(points):
        for point in points[drive]:
            found.setdefault((point.effect, point.size), {})[drive] = point
    return found


def control_chart(series: Series, tests: int) -> SizeChart:
    """Chart of one size, equations (1) and (2); a drive that shows nothing of it leaves the mean as it is.

    Args:
        series: of the size, at least one drive.
        tests: 2 n q of all charts together.
    """
    first = next(iter(series.values()))
    quantile = distance_at(single_level(tests), 1, min(point.degrees for point in series.values()))
    average, own, reached = 0.0, 0.0, 0.0
    points = []
    for drive, point in series.items():
        average = (1.0 - WEIGHT) * average + WEIGHT * point.value
        own = (1.0 - WEIGHT) ** 2 * own + WEIGHT**2 * point.deviation**2
        reached = (1.0 - WEIGHT) * reached + WEIGHT
        limit = quantile * float(np.hypot(point.deviation, point.mean_deviation))
        average_limit = quantile * float(np.sqrt(own + (reached * point.mean_deviation) ** 2))
        points.append(ChartPoint(drive, point.value, limit, average, average_limit))
    return SizeChart(first.effect, first.size, first.unit, first.ordinary, tuple(points))
