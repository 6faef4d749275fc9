"""What a calibration says of every drive and every parameter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ddagr_gym.calibration.calibration_data import CalibrationData
from ddagr_gym.calibration.drive_scatter import DriveEstimates, half_width, scatter
from ddagr_gym.calibration.forecast_errors import Forecasts
from ddagr_gym.calibration.identifiability import covariance
from ddagr_gym.calibration.joint_fit import FittedModel
from ddagr_gym.calibration.parts import RobotModel
from ddagr_gym.calibration.result import CalibratedParameter, DriveEstimate, DriveSummary, Scatter
from ddagr_gym.calibration.simulator_values import Quantity, quantity
from ddagr_gym.diagnosis.preprocessing.input_requirements import content_hash
from ddagr_gym.identification.parameters import OF_SENSORS, ModelParameter
from ddagr_gym.identification.windows import WindowSet
from ddagr_gym.recordings.schema import Recording

NOT_IDENTIFIED = "the drives do not identify it (it would be about as uncertain as before)."
NOT_NEEDED = "forecasts of left-out drives are worse without it by too little, or not at all."

NO_SCATTER = Scatter(0, None, None, 0, 0)


def drive_summaries(
    data: CalibrationData, recordings: Sequence[Recording], windows: WindowSet, compared: Sequence[Forecasts]
) -> tuple[DriveSummary, ...]:
    """One for each drive.

    Args:
        data: drives as they were fitted.
        recordings: as they were given.
        windows: that the joint fit used.
        compared: forecasts of left-out drives.
    """
    found = []
    for number, recording in enumerate(recordings):
        known = np.isfinite(np.stack(recording.held_commands())).all(axis=0)
        used = int(np.count_nonzero(windows.recording == number))
        judged = sum(int(np.count_nonzero(item.windows.recording == number)) for item in compared)
        found.append(
            DriveSummary(
                recording.meta.source,
                content_hash(recording),
                data.grounds[number],
                float(known.sum()) * recording.period,
                used * windows.duration,
                judged * windows.duration,
                data.prepared.noise[number].pose_lateness,
                data.notes[number],
                data.prepared.noise[number].lateness_interval,
            )
        )
    return tuple(found)


def parameter_results(
    data: CalibrationData,
    complete: RobotModel,
    model: FittedModel,
    left_out: frozenset[str],
    refused: Mapping[str, float],
    estimates: DriveEstimates,
) -> tuple[CalibratedParameter, ...]:
    """Every parameter of the robot, then those of the grounds.

    Args:
        data: drives.
        complete: all that could be fitted, with their priors.
        model: joint fit.
        left_out: names of parts that forecasts do not ask for.
        refused: parameters that are not identified, with deviation after over before.
        estimates: by drive.
    """
    deviation = dict(zip(model.free, np.sqrt(np.diag(covariance(model))).tolist(), strict=True))
    found = []
    for parameter in complete.parameters:
        if parameter.prior == 0.0 or parameter.name.startswith(OF_SENSORS):
            continue
        known = quantity(data, complete, parameter)
        if parameter.name in deviation:
            change = model.values[parameter.name]
            found.append(_calibrated(data, parameter, known, change, deviation[parameter.name], estimates))
        else:
            found.append(_kept(parameter, known, _reason(parameter, known, left_out, refused)))
    return tuple(sorted(found, key=lambda item: item.ground != ""))


def _calibrated(
    data: CalibrationData,
    parameter: ModelParameter,
    known: Quantity,
    change: float,
    deviation: float,
    estimates: DriveEstimates,
) -> CalibratedParameter:
    values, variances = estimates.values[parameter.name], estimates.variances[parameter.name]
    half = half_width(values, variances, deviation)
    low, high = max(change - half, parameter.low), min(change + half, parameter.high)
    return CalibratedParameter(
        name=known.name,
        part=known.part,
        ground=known.ground,
        unit=known.unit,
        data_sheet=known.stated,
        expected=known.nominal,
        expected_deviation=known.deviation(0.0, parameter.prior),
        value=known.value(change),
        interval=(known.value(low), known.value(high)),
        calibrated=True,
        reason="",
        helps="",
        change=change,
        deviation=deviation,
        scatter=scatter(values, variances, data.grounds),
        estimates=tuple(
            DriveEstimate(name, ground, float(value), float(np.sqrt(variance)))
            for name, ground, value, variance in zip(data.names, data.grounds, values, variances, strict=True)
            if np.isfinite(value)
        ),
    )


def _kept(parameter: ModelParameter, known: Quantity, reason: str) -> CalibratedParameter:
    return CalibratedParameter(
        name=known.name,
        part=known.part,
        ground=known.ground,
        unit=known.unit,
        data_sheet=known.stated,
        expected=known.nominal,
        expected_deviation=known.deviation(0.0, parameter.prior),
        value=known.stated,
        interval=None,
        calibrated=False,
        reason=reason,
        helps=known.helps,
        change=0.0,
        deviation=None,
        scatter=NO_SCATTER,
        estimates=(),
    )


def _reason(parameter: ModelParameter, known: Quantity, left_out: frozenset[str], refused: Mapping[str, float]) -> str:
    if parameter.name in refused:
        return NOT_IDENTIFIED
    if known.part in left_out:
        return NOT_NEEDED
    return "it was not fitted."
