"""What a calibration says of the drivetrain, in the words of a diagnosis."""

from __future__ import annotations

from collections.abc import Mapping

from ddagr_gym.calibration.forecast_findings import folds_of, forecast_finding
from ddagr_gym.calibration.part_comparison import least_growth
from ddagr_gym.calibration.parts import part_named
from ddagr_gym.calibration.result import (
    CALIBRATED,
    DATA_SHEET,
    KINEMATIC,
    CalibratedParameter,
    Calibration,
    ForecastError,
    PartDecision,
)
from ddagr_gym.diagnosis.answer.drivetrain import (
    PART_TITLES,
    DrivetrainAnswer,
    ForecastComparison,
    PartEvidence,
    Remaining,
)
from ddagr_gym.diagnosis.answer.verdict import Estimate, Finding

WHEEL_SPEED = "wheel_speed"

_Key = tuple[str, str, float | None]


def drivetrain_answer(calibration: Calibration, misfit: Mapping[str, float]) -> DrivetrainAnswer:
    """Parts of the drivetrain, and what they are worth on what was left out.

    Args:
        calibration: of the recordings that are diagnosed.
        misfit: of the encoders over their limits, for which the drivetrain was asked.
    """
    parts = {item.name: item for item in calibration.parts if item.name in PART_TITLES}
    made = tuple(
        PartEvidence(name, name in named_parts(calibration), parts[name].growth, parts[name].error)
        for name in PART_TITLES
        if name in parts
    )
    other = (p.name for p in calibration.parameters if p.calibrated and p.part not in PART_TITLES)
    remaining = (Remaining(u.condition, u.share, u.time) for u in calibration.unexplained if u.channel == WHEEL_SPEED)
    forecasts = tuple(_comparisons(calibration))
    return DrivetrainAnswer(made, forecasts, tuple(remaining), _explained(forecasts), tuple(other), dict(misfit))


def named_parts(calibration: Calibration) -> dict[str, list[CalibratedParameter]]:
    """Parts of the drivetrain that were kept and of which some parameter was determined, with these parameters."""
    kept = {part.name for part in calibration.parts if part.kept}
    found: dict[str, list[CalibratedParameter]] = {}
    for item in calibration.parameters:
        if item.calibrated and item.part in kept and item.part in PART_TITLES:
            found.setdefault(item.part, []).append(item)
    return {name: found[name] for name in PART_TITLES if name in found}


def drivetrain_findings(calibration: Calibration) -> tuple[Finding, ...]:
    """One finding per part that the recordings ask for, in the order of the signal."""
    decisions = {item.name: item for item in calibration.parts}
    folds = folds_of(calibration)
    return tuple(_finding(decisions[name], found, folds) for name, found in named_parts(calibration).items())


def _finding(part: PartDecision, parameters: list[CalibratedParameter], folds: int) -> Finding:
    estimates = {p.name: Estimate(p.value, p.unit, p.interval) for p in parameters if p.value is not None}
    gate = least_growth(part.error, folds, part_named(part.name).usual)
    return forecast_finding(part.name, estimates, part.growth, part.error, gate)


def _comparisons(calibration: Calibration) -> list[ForecastComparison]:
    """Errors of the three models side by side, where all of them were measured."""
    by_model: dict[_Key, dict[str, ForecastError]] = {}
    for item in calibration.forecasts:
        by_model.setdefault((item.drive, item.metric, item.horizon), {})[item.model] = item
    found = []
    for (drive, metric, horizon), models in by_model.items():
        rms = {name: item.rms for name, item in models.items() if item.rms is not None}
        if {DATA_SHEET, CALIBRATED, KINEMATIC} <= set(rms):
            found.append(
                ForecastComparison(
                    drive,
                    metric,
                    horizon,
                    models[CALIBRATED].unit,
                    rms[DATA_SHEET],
                    rms[CALIBRATED],
                    rms[KINEMATIC],
                    models[CALIBRATED].rms_interval,
                )
            )
    return found


def _explained(forecasts: tuple[ForecastComparison, ...]) -> float:
    """Share of the nominal simulator's squared error of the wheel speeds that the correction takes away."""
    wheels = [item for item in forecasts if item.metric == WHEEL_SPEED and item.horizon is None]
    before = sum(item.nominal**2 for item in wheels)
    return 1.0 - sum(item.corrected**2 for item in wheels) / before if before > 0.0 else 0.0
