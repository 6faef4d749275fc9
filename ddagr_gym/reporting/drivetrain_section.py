"""What a diagnosis says of the drivetrain as a whole, as tables."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from ddagr_gym.calibration.files import PAGE
from ddagr_gym.calibration.parts import PARTS
from ddagr_gym.calibration.result import ForecastError
from ddagr_gym.diagnosis.answer.amounts import amounts, size
from ddagr_gym.diagnosis.answer.drivetrain import PART_TITLES, DrivetrainAnswer, ForecastComparison, PartEvidence
from ddagr_gym.diagnosis.answer.verdict import Diagnosis, Finding
from ddagr_gym.reporting.calibration_text import error_label, number

DRIVETRAIN_FOLDER = "drivetrain"
"""Beside the page: the page of the calibration that found the drivetrain."""

PART_HEADER = ("part", "size", "forecasts without it are worse by", "standard error")
FORECAST_HEADER = ("left out", "error", "unit", "simulator as given", "corrected", "effective track")
ERROR_HEADER = FORECAST_HEADER[1:]


def drivetrain_section(diagnosis: Diagnosis) -> dict[str, Any]:
    """Parts, errors on what was left out, and where the rest is; empty where the drivetrain was not asked for."""
    answer = diagnosis.drivetrain
    if answer is None:
        return {}
    return {
        "part_header": PART_HEADER,
        "parts": part_rows(diagnosis),
        "error_header": ERROR_HEADER,
        "errors": error_rows(answer),
        "header": FORECAST_HEADER,
        "forecasts": forecast_rows(answer),
        "remaining": remaining_in_words(answer),
        "page": f"{DRIVETRAIN_FOLDER}/{PAGE}",
    }


def drivetrain_tiles(answer: DrivetrainAnswer) -> list[dict[str, str]]:
    """What the parts explain on what was left out of the fit."""
    label = "of the squared error of the wheel speeds explained, where nothing was fitted"
    found = [{"value": f"{100.0 * max(answer.explained, 0.0):.0f} %", "label": label}]
    heading = [item for item in answer.forecasts if (item.metric, item.horizon) == _TILE]
    if heading:
        given, corrected = (root_mean_square([getattr(i, name) for i in heading]) for name in ("nominal", "corrected"))
        label = f"off in heading after {_TILE[1]:g} s there, instead of {number(given)} rad"
        found.append({"value": f"{number(corrected)} rad", "label": label})
    return found


_TILE = ("heading", 5.0)
"""Error that stands for all: its metric and horizon [s]."""


def other_findings(diagnosis: Diagnosis) -> tuple[Finding, ...]:
    """Findings that are no parts of the drivetrain: all of them where that was not asked for."""
    parts = () if diagnosis.drivetrain is None else diagnosis.drivetrain.names
    return tuple(finding for finding in diagnosis.findings if finding.name not in parts)


def part_rows(diagnosis: Diagnosis) -> list[tuple[str, ...]]:
    """One row per part that was tried, under :data:`PART_HEADER`; none where the drivetrain was not asked for."""
    found = {finding.name: finding for finding in diagnosis.findings}
    answer = diagnosis.drivetrain
    return [] if answer is None else [_part_row(part, found.get(part.name), answer.names) for part in answer.parts]


def _part_row(part: PartEvidence, finding: Finding | None, kept: Sequence[str]) -> tuple[str, ...]:
    sizes = "" if finding is None else "; ".join(size(item) for item in amounts(finding.parameters).values())
    idle = next((item.needs for item in PARTS if item.name == part.name), ())
    absent = "nothing to act on" if idle and not set(idle) & set(kept) else "not needed"
    return (
        PART_TITLES[part.name],
        sizes if part.kept else absent,
        f"{100.0 * part.growth:+.1f} %",
        "–" if part.error is None else f"{100.0 * part.error:.1f} %",
    )


def error_rows(answer: DrivetrainAnswer) -> list[tuple[str, ...]]:
    """One row per metric and horizon over all that was left out, under :data:`ERROR_HEADER`."""
    return [_error_row(items) for items in grouped_forecasts(answer)]


def grouped_forecasts(answer: DrivetrainAnswer) -> list[list[ForecastComparison]]:
    """Errors of all stretches by metric and horizon."""
    grouped: dict[tuple[str, float | None], list[ForecastComparison]] = {}
    for item in answer.forecasts:
        grouped.setdefault((item.metric, item.horizon), []).append(item)
    return list(grouped.values())


def _error_row(items: Sequence[ForecastComparison]) -> tuple[str, ...]:
    """Root mean square over stretches, with the range over them of the corrected model."""
    nominal, corrected, kinematic = (
        number(root_mean_square([getattr(item, model) for item in items]))
        for model in ("nominal", "corrected", "kinematic")
    )
    each = [item.corrected for item in items]
    between = f" ({number(min(each))} to {number(max(each))})" if len(each) > 1 else ""
    return forecast_label(items[0]), items[0].unit, nominal, f"{corrected}{between}", kinematic


def root_mean_square(values: Sequence[float]) -> float:
    """Of errors that are root mean squares themselves, of stretches of one length."""
    return math.sqrt(sum(value**2 for value in values) / len(values))


def forecast_rows(answer: DrivetrainAnswer) -> list[tuple[str, ...]]:
    """One row per stretch, metric and horizon, under :data:`FORECAST_HEADER`."""
    return [_forecast_row(item) for item in answer.forecasts]


def _forecast_row(item: ForecastComparison) -> tuple[str, ...]:
    spread = item.corrected_interval
    between = "" if spread is None else f" ({number(spread[0])} to {number(spread[1])})"
    corrected = f"{number(item.corrected)}{between}"
    return item.drive, forecast_label(item), item.unit, number(item.nominal), corrected, number(item.kinematic)


def forecast_label(item: ForecastComparison | ForecastError) -> str:
    """Metric and horizon in words."""
    return item.metric.replace("_", " ") if item.horizon is None else error_label(item.metric, item.horizon)


def remaining_in_words(answer: DrivetrainAnswer) -> str:
    """Conditions with their shares of the squared error."""
    shares = [f"{100.0 * part.share:.0f} % {part.condition}" for part in answer.remaining]
    return ", ".join(shares) or "not located"
