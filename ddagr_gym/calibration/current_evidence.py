"""What a calibration says of the motors' currents: their constants, and how well they are forecast."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ddagr_gym.calibration.calibration_data import CalibrationData
from ddagr_gym.calibration.forecast_errors import Forecasts
from ddagr_gym.calibration.identifiability import covariance
from ddagr_gym.calibration.joint_fit import FittedModel
from ddagr_gym.calibration.result import CurrentConstant, CurrentError, CurrentEvidence
from ddagr_gym.identification.motor_currents import BANKS


def current_evidence(
    data: CalibrationData, model: FittedModel, forecasts: Sequence[Forecasts]
) -> CurrentEvidence | None:
    """Currents as a calibration used them; None where it used none.

    Args:
        data: drives.
        model: joint fit.
        forecasts: of all left-out drives.
    """
    currents = data.currents
    if currents is None:
        return None
    deviation = dict(zip(model.free, np.sqrt(np.diag(covariance(model))).tolist(), strict=True))
    constants = tuple(
        CurrentConstant(name, currents.unit(name), value, currents.of_one(name) * deviation.get(name, 0.0))
        for name, value in currents.constants(model.values).items()
    )
    errors = tuple(error for item in forecasts for error in _errors(item))
    return CurrentEvidence(str(currents.kind), constants, errors)


def _errors(item: Forecasts) -> Iterator[CurrentError]:
    """Of both banks of a left-out drive that has currents."""
    if item.currents is None:
        return
    for k, bank in enumerate(BANKS):
        measured, forecast = (values[..., k] for values in item.currents)
        known = np.isfinite(measured) & np.isfinite(forecast)
        if known.sum() > 1:
            left = float(np.sqrt(np.mean((measured - forecast)[known] ** 2)))
            yield CurrentError(item.drive, bank, int(known.sum()), float(np.std(measured[known])), left)
