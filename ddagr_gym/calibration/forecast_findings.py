"""Findings that forecasts of what was left out of a fit decide on."""

from __future__ import annotations

from collections.abc import Mapping

from ddagr_gym.calibration.result import Calibration
from ddagr_gym.diagnosis.answer.verdict import Estimate, Finding


def folds_of(calibration: Calibration) -> int:
    """Number of drives, or of parts of a single one, that were left out in turn."""
    return len({item.drive for item in calibration.forecasts})


def forecast_finding(
    name: str, sizes: Mapping[str, Estimate], growth: float, error: float | None, gate: float
) -> Finding:
    """What forecasts are worse without, as a finding.

    Args:
        name: of the effect or part.
        sizes: by field.
        growth: relative growth of the forecasts' loss without it [-].
        error: standard error of that; None for a single fold.
        gate: growth that it had to pass [-].
    """
    score = growth / error if error else 0.0
    return Finding(name, dict(sizes), growth, gate, score, growth, {}, {name: 1.0})
