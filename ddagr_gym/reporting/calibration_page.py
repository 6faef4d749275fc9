"""The page of a calibration: one file without links to anywhere, each drive before and after first."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ddagr_gym.calibration.files import NAME, PAGE, ROBOT, soil_file
from ddagr_gym.calibration.forecast_errors import Forecasts
from ddagr_gym.calibration.result import CALIBRATED, DATA_SHEET, MODELS, Calibration
from ddagr_gym.files import write_text
from ddagr_gym.reporting import calibration_figures as figures
from ddagr_gym.reporting import calibration_text as text
from ddagr_gym.reporting.current_figure import current_figure
from ddagr_gym.reporting.figures import house_style
from ddagr_gym.reporting.page_template import embedded, page_template


def write_page(folder: Path, calibration: Calibration, forecasts: Sequence[Forecasts]) -> None:
    """Write ``calibration.html``, its pictures in it.

    Args:
        folder: that exists.
        calibration: the answer.
        forecasts: of the left-out drives, of the same calibration.

    Raises:
        InputError: matplotlib or jinja2 is not installed.
    """
    page = page_template("calibration.html")
    with house_style():
        context = _context(calibration, forecasts)
    write_text(folder / PAGE, page.render(context))


def _context(calibration: Calibration, forecasts: Sequence[Forecasts]) -> dict[str, Any]:
    found = [item for item in calibration.parameters if item.calibrated]
    return {
        "headline": text.headline(calibration),
        "robot": calibration.robot,
        "tiles": _tiles(calibration),
        "before": figures.MODEL_STYLES[DATA_SHEET][0],
        "after": figures.MODEL_STYLES[CALIBRATED][0],
        "files": [ROBOT, *(soil_file(ground) for ground in calibration.grounds), NAME],
        "notes": [(drive.source, note) for drive in calibration.drives for note in drive.notes],
        "drives": [
            {
                **embedded(
                    figures.drive_figure(item), f"Wheel speeds and yaw rate of a typical stretch of {item.drive}"
                ),
                "title": item.drive,
                "note": f"{item.ground}; forecast with {item.soil_from} for the soil",
            }
            for item in forecasts
        ],
        "parameter_picture": embedded(
            figures.parameter_figure(found), "Calibrated parameters in standard deviations of the data sheet"
        ),
        "parameter_header": text.PARAMETER_HEADER,
        "parameters": [text.parameter_row(item) for item in found],
        "refused": [(text.refused_heading(why), lines) for why, lines in text.refused_groups(calibration).items()],
        "measures": text.MEASURES,
        "part_header": text.PART_HEADER,
        "parts": text.part_rows(calibration),
        "error_picture": embedded(figures.error_figure(calibration), "Errors on left-out drives of all models"),
        "error_header": text.FORECAST_HEADER,
        "errors": text.forecast_rows(calibration, _ALL),
        "spectra": embedded(figures.spectrum_figure(calibration), "Spectra of the residuals before and after"),
        "unexplained": embedded(figures.unexplained_figure(calibration), "Where the residuals of left-out drives are"),
        "unexplained_header": text.UNEXPLAINED_HEADER,
        "unexplained_rows": text.unexplained_rows(calibration),
        "usage": [_usage(calibration, number) for number in range(len(calibration.drives))],
        "usage_header": ("drive", "ground", "under command [s]", "fitted [s]", "forecast [s]", "poses late by [s]"),
        "currents": _currents(calibration, forecasts),
        "mounting": _mounting(calibration),
        "slope_header": text.SLOPE_HEADER,
        "slopes": text.slope_rows(calibration.slopes),
        "seconds": f"{calibration.seconds:.0f}",
        "models": [text.MODEL_LABELS[name] for name in MODELS],
    }


_ALL = (
    ("wheel_speed", None),
    ("yaw_rate", None),
    ("heading", 1.0),
    ("heading", 5.0),
    ("position", 1.0),
    ("position", 5.0),
)
"""Errors of the table on the page."""


def _mounting(calibration: Calibration) -> dict[str, Any] | None:
    """Table of how the IMU is mounted, and what of its readings that explains; None where that was not asked."""
    found = calibration.imu
    if found is None:
        return None
    return {
        "header": text.MOUNTING_HEADER,
        "rows": text.mounting_rows(found),
        "before": f"{found.before:.2f}",
        "after": f"{found.after:.2f}",
    }


_KINDS = {"motor": "the motors' own current", "supply": "the current that the motors draw from their supply"}


def _currents(calibration: Calibration, forecasts: Sequence[Forecasts]) -> dict[str, Any] | None:
    """Pictures and tables of the motors' currents; None where none was used."""
    found = calibration.currents
    if found is None:
        return None
    by_drive: dict[int, list[Forecasts]] = {}
    for item in forecasts:
        if item.currents is not None and np.isfinite(item.currents[0]).any():
            by_drive.setdefault(int(item.windows.recording[0]), []).append(item)
    names = [drive.source for drive in calibration.drives]
    return {
        "kind": _KINDS[found.kind],
        "pictures": [
            {**embedded(current_figure(items), f"Motor currents of {names[number]}"), "title": names[number]}
            for number, items in by_drive.items()
        ],
        "constant_header": ("constant", "value", "standard deviation", "unit"),
        "constants": [
            (item.name.replace("_", " "), f"{item.value:.3g}", f"{item.deviation:.2g}", item.unit)
            for item in found.constants
        ],
        "error_header": ("drive", "bank", "samples", "measured, r.m.s. about the mean [A]", "left, r.m.s. [A]"),
        "errors": [(e.drive, e.bank, str(e.count), f"{e.measured:.2f}", f"{e.left:.2f}") for e in found.errors],
    }


def _tiles(calibration: Calibration) -> list[dict[str, str]]:
    found = []
    for metric, horizon in text.SHOWN:
        share = text.error_share(calibration, metric, horizon)
        if share is not None:
            label = error_words(metric, horizon)
            found.append(
                {"value": f"{100.0 * share:.0f} %", "label": f"of the data sheet's r.m.s. error left, {label}"}
            )
    seconds = sum(drive.used_seconds for drive in calibration.drives)
    found.append({"value": f"{seconds / 60.0:.0f} min", "label": "of driving fitted"})
    found.append({"value": str(len(calibration.calibrated)), "label": "parameters calibrated, soils included"})
    found.append({"value": str(len(calibration.refused)), "label": "parameters as in the data sheet"})
    return found


def error_words(metric: str, horizon: float | None) -> str:
    """What an error is of, for a tile."""
    name = metric.replace("_", " ")
    return f"{name} of all samples" if horizon is None else f"{name} after {horizon:g} s"


def _usage(calibration: Calibration, number: int) -> tuple[str, ...]:
    drive = calibration.drives[number]
    late = f"{drive.pose_lateness:.2f}" if drive.pose_lateness else "unknown"
    numbers = (f"{value:.0f}" for value in (drive.seconds, drive.used_seconds, drive.judged_seconds))
    return drive.source, drive.ground, *numbers, late
