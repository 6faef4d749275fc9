"""Figures of many drives over time: what changed where, and a control chart of every size."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ddagr_gym.diagnosis.answer.drive_series import SINGLE
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.drive_series_text import moved_label
from ddagr_gym.reporting.figures import PAGE_WIDTH, blank_figure

if TYPE_CHECKING:
    from ddagr_gym.diagnosis.answer.drive_series import DriveSeries, SizeChart

PANEL = (3.5, 1.75)
"""Width and height of one chart [inches]."""

MOST_NAMED_DRIVES = 30
"""Drives up to which each has a number at the axis (ours)."""

MOST_SIZES = 12
"""Sizes in the map over the drives (ours): those that moved most, and the charts below hold all."""


def overview_figure(series: DriveSeries) -> Any:
    """Distance of each drive over its limit, for the sizes that moved most, as a map over the drives."""
    charts = series.charts[:MOST_SIZES]
    figure = blank_figure(1.2 + 0.26 * len(charts), PAGE_WIDTH)
    axis = figure.subplots()
    drives = len(series.rows)
    cells = [[math.nan] * drives for _ in charts]
    for row, chart in enumerate(charts):
        for point in chart.points:
            cells[row][point.drive] = point.value / point.limit
    image = axis.imshow(cells, aspect="auto", cmap="RdBu_r", vmin=-2.0, vmax=2.0, interpolation="nearest")
    for row, chart in enumerate(charts):
        outside = [point.drive for point in chart.points if point.outside]
        axis.plot(outside, [row] * len(outside), "o", ms=4, mfc=palette.PAPER, mec=palette.INK, mew=0.7)
    axis.set_yticks(range(len(charts)), [moved_label(chart) for chart in charts])
    _drive_axis(axis, series)
    axis.grid(False)
    _event_lines(axis, series)
    bar = figure.colorbar(image, ax=axis, pad=0.01, ticks=[-2, -1, 0, 1, 2])
    bar.set_label("shift over limit", fontsize=7)
    return figure


def chart_figure(chart: SizeChart, series: DriveSeries) -> Any:
    """Control chart of one size: ordinary drives, then each drive against its limit, with the weighted mean.

    Args:
        chart: of the size.
        series: of drives.
    """
    figure = blank_figure(PANEL[1], PANEL[0])
    axis = figure.subplots()
    known = len(chart.ordinary)
    places = [k - known - 0.5 for k in range(known)]
    axis.axvspan(-known - 1.0, -0.75, color=palette.SHADE, linewidth=0.0, zorder=0)
    axis.plot(places, chart.ordinary, "o", ms=2.5, color=palette.GREY, zorder=3)
    drives = [point.drive for point in chart.points]
    for sign in (-1.0, 1.0):
        limits = [sign * point.limit for point in chart.points]
        axis.step(drives, limits, where="mid", color=palette.GREY, lw=0.9, linestyle=(0, (3, 2)))
    band = [point.average_limit for point in chart.points]
    axis.fill_between(drives, [-value for value in band], band, color=palette.SKY_BLUE, alpha=0.18, linewidth=0.0)
    axis.plot(drives, [point.average for point in chart.points], color=palette.BLUE, lw=1.2, zorder=4)
    _points(axis, chart)
    axis.axhline(0.0, color=palette.PALE, lw=0.7, zorder=1)
    _event_lines(axis, series)
    axis.set_xlim(-known - 1.0, len(series.rows) - 0.5)
    _drive_axis(axis, series, short=True)
    unit = "" if chart.unit == "-" else f" [{chart.unit}]"
    axis.set_title(f"{moved_label(chart)}{unit}", fontsize=8)
    axis.tick_params(labelsize=7)
    return figure


def _points(axis: Any, chart: SizeChart) -> None:
    inside = [point for point in chart.points if not point.outside]
    outside = [point for point in chart.points if point.outside]
    for points, colour in ((inside, palette.INK), (outside, palette.VERMILLION)):
        axis.plot([p.drive for p in points], [p.value for p in points], "o", ms=3, color=colour, zorder=5)


def _event_lines(axis: Any, series: DriveSeries) -> None:
    for event in series.events:
        if event.kind != SINGLE:
            axis.axvline(event.drive - 0.5, color=palette.VERMILLION, lw=1.1, zorder=6)


def _drive_axis(axis: Any, series: DriveSeries, short: bool = False) -> None:
    """Numbers of the drives, from 1."""
    drives = len(series.rows)
    step = max(1, math.ceil(drives / (8 if short else MOST_NAMED_DRIVES)))
    shown: Sequence[int] = range(0, drives, step)
    axis.set_xticks(list(shown), [str(place + 1) for place in shown])
    if not short:
        axis.set_xlabel("drive")
