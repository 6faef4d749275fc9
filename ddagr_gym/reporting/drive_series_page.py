"""The page of many drives over time: one file without links to anywhere."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ddagr_gym.diagnosis.answer.drive_series import SINGLE, STAYS
from ddagr_gym.files import write_text
from ddagr_gym.reporting import drive_series_figures as figures
from ddagr_gym.reporting import drive_series_text as text
from ddagr_gym.reporting.figures import house_style
from ddagr_gym.reporting.page_template import embedded, page_template

if TYPE_CHECKING:
    from ddagr_gym.diagnosis.answer.drive_series import DriveSeries, SizeChart

PAGE = "index.html"

OPEN_CHARTS = 9
"""That stand on the page unfolded (ours): those that moved, or came nearest to their limits."""


def write_page(folder: Path, series: DriveSeries) -> None:
    """Write ``index.html``, its pictures in it.

    Args:
        folder: that exists.
        series: of drives.

    Raises:
        InputError: matplotlib or jinja2 is not installed.
    """
    page = page_template("drive_series.html")
    with house_style():
        context = _context(series)
    write_text(folder / PAGE, page.render(context))


def _context(series: DriveSeries) -> dict[str, Any]:
    answered = [row for row in series.rows if not row.refused]
    return {
        "headline": series.sentence,
        "robot": series.robot,
        "calibration": series.calibration,
        "ground": series.ground,
        "tiles": _tiles(series),
        "overview": embedded(figures.overview_figure(series), "Shift over limit by size and drive")
        if series.charts
        else None,
        "charts": [_chart(chart, series) for chart in series.charts[:OPEN_CHARTS]],
        "further": [_chart(chart, series) for chart in series.charts[OPEN_CHARTS:]],
        "events": text.event_sentences(series),
        "event_header": text.EVENT_HEADER,
        "event_rows": text.event_rows(series),
        "drive_header": text.DRIVE_HEADER,
        "drive_rows": text.drive_rows(series),
        "refused": [(row.drive, row.sentence) for row in series.rows if row.refused],
        "ordinary": series.ordinary,
        "notes": text.notes(series),
        "level": f"{100.0 * series.level:g}",
        "weight": f"{series.weight:g}",
        "answered": len(answered),
    }


def _tiles(series: DriveSeries) -> list[tuple[str, str]]:
    """Numbers at the head of the page."""
    answered = [row for row in series.rows if not row.refused]
    minutes = sum(row.minutes or 0.0 for row in answered)
    named = sum(bool(row.findings) for row in answered)
    changed = next((str(event.drive + 1) for event in series.events if event.kind == STAYS), "none")
    odd = sum(event.kind == SINGLE for event in series.events)
    return [
        (str(len(series.rows)), "drives"),
        (f"{minutes:.0f}", "minutes"),
        (changed, "first drive of a change that stays"),
        (str(odd), "odd drives"),
        (str(named), "drives with a name"),
        (str(len(series.rows) - len(answered)), "refused"),
    ]


def _chart(chart: SizeChart, series: DriveSeries) -> dict[str, Any]:
    return embedded(figures.chart_figure(chart, series), f"{text.moved_label(chart)} over the drives")
