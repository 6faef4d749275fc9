"""What a diagnosis says of the drivetrain as a whole, as tables."""

from __future__ import annotations

from typing import Any

from ddagr_gym.calibration.files import PAGE
from ddagr_gym.diagnosis.answer.drivetrain import PART_TITLES, DrivetrainAnswer, ForecastComparison
from ddagr_gym.reporting.calibration_text import error_label, number

DRIVETRAIN_FOLDER = "drivetrain"
"""Beside the page: the page of the calibration that found the drivetrain."""

PART_HEADER = ("part", "named", "forecasts without it are worse by", "standard error")
FORECAST_HEADER = ("left out", "error", "unit", "simulator as given", "corrected", "effective track")


def drivetrain_section(answer: DrivetrainAnswer | None) -> dict[str, Any]:
    """Parts, errors on what was left out, and where the rest is; empty where the drivetrain was not asked for."""
    if answer is None:
        return {}
    return {
        "parts": part_rows(answer),
        "header": FORECAST_HEADER,
        "forecasts": forecast_rows(answer),
        "remaining": remaining_in_words(answer),
        "page": f"{DRIVETRAIN_FOLDER}/{PAGE}",
    }


def part_rows(answer: DrivetrainAnswer) -> list[tuple[str, ...]]:
    """One row per part that was tried, under :data:`PART_HEADER`."""
    return [
        (
            PART_TITLES[part.name],
            "yes" if part.kept else "no",
            f"{100.0 * part.growth:+.1f} %",
            "–" if part.error is None else f"{100.0 * part.error:.1f} %",
        )
        for part in answer.parts
    ]


def forecast_rows(answer: DrivetrainAnswer) -> list[tuple[str, ...]]:
    """One row per stretch, metric and horizon, under :data:`FORECAST_HEADER`."""
    return [_forecast_row(item) for item in answer.forecasts]


def _forecast_row(item: ForecastComparison) -> tuple[str, ...]:
    spread = item.corrected_interval
    between = "" if spread is None else f" ({number(spread[0])} to {number(spread[1])})"
    corrected = f"{number(item.corrected)}{between}"
    label = item.metric.replace("_", " ") if item.horizon is None else error_label(item.metric, item.horizon)
    return item.drive, label, item.unit, number(item.nominal), corrected, number(item.kinematic)


def remaining_in_words(answer: DrivetrainAnswer) -> str:
    """Conditions with their shares of the squared error."""
    shares = [f"{100.0 * part.share:.0f} % {part.condition}" for part in answer.remaining]
    return ", ".join(shares) or "not located"
