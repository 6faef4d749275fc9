"""Models beside the calibrated simulator on the same left-out windows, and the errors of all of them.

By commands: the data sheet's simulator, the calibrated one, the same as if the lateness of every command were known
(:mod:`benchmarks.real_drives.lateness`), a kinematic model without slip, one with an effective track that is given a
delay, a lag and a ceiling as well, and a learned one (:mod:`benchmarks.real_drives.learned`). By wheel speeds: the
calibrated simulator and an effective track.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.real_drives.lateness import Lateness, lateness_of
from benchmarks.real_drives.learned import learned_forecast, training_windows
from ddagr_gym.calibration.calibration_data import CalibrationData
from ddagr_gym.calibration.forecast_errors import ITSELF, Forecasts
from ddagr_gym.calibration.result import CALIBRATED, DATA_SHEET, KINEMATIC
from ddagr_gym.calibration.run import Outcome
from ddagr_gym.calibration.settings import HISTORY
from ddagr_gym.identification.fit_numerics import field_numerics
from ddagr_gym.identification.residual_weights import ROBUST
from ddagr_gym.identification.window_model import WindowModel
from ddagr_gym.identification.windows import CHANNELS, WindowSet, cut_windows
from ddagr_gym.replay_analysis.horizons import METRICS, horizon_errors, sample_errors
from ddagr_gym.replay_analysis.intervals import RESAMPLES, error_statistics
from ddagr_gym.replay_analysis.kinematic import KinematicModel, fit_motor, fit_track

Array = NDArray[np.float64]

ROLLING = "kinematic without slip"
LEARNED = "learned"
LATENESS_KNOWN = "calibrated, lateness of each command known"
CALIBRATED_BY_SPEEDS = "calibrated, by wheel speeds"
TRACK_BY_SPEEDS = "effective track, by wheel speeds"
HORIZONS = (1.0, 5.0)
SHOWN = ("heading", "position", "wheel_speed")
LATEST = 0.5  # [s] that wheel speeds may be late or early

_ENCODERS = [CHANNELS.index("encoder_right"), CHANNELS.index("encoder_left")]


@dataclass(frozen=True, eq=False)
class Compared:
    """All forecasts of one left-out drive.

    Attributes:
        drive: its name.
        ground: that it was on.
        soil_from: where its soil was fitted.
        windows: that were forecast.
        predictions: (W, T, 8) by model; those by wheel speeds have NaN in windows without them.
        lateness: how late the commands of each window act; None where that was not looked at.
    """

    drive: str
    ground: str
    soil_from: str
    windows: WindowSet
    predictions: dict[str, Array]
    lateness: Lateness | None = None


def compare(outcome: Outcome, item: Forecasts, seed: int) -> Compared:
    """Forecasts of one drive by all models; none has seen what it forecasts.

    Args:
        outcome: of the calibration with all drives.
        item: its forecasts of that drive.
        seed: of the learned model.
    """
    data, windows = outcome.data, item.windows
    drive = int(windows.recording[0])
    training = training_windows(data.windows, drive, item.soil_from == ITSELF)
    robot = data.robot
    motor = fit_motor(training, robot.motor_rate, robot.maximum_wheel_speed, float(data.prepared.sigma[_ENCODERS[0]]))
    predictions = dict(item.predictions)
    predictions[ROLLING] = KinematicModel(robot.outer_radius, robot.half_track, 1.0, motor).predict(windows)
    predictions[LEARNED] = learned_forecast(training, windows, robot.outer_radius, seed)
    predictions |= by_wheel_speeds(data, item, training)
    lateness = lateness_of(item)
    predictions[LATENESS_KNOWN] = lateness.prediction
    return Compared(item.drive, item.ground, item.soil_from, windows, predictions, lateness)


def by_wheel_speeds(data: CalibrationData, item: Forecasts, training: WindowSet) -> dict[str, Array]:
    """Forecasts from recorded wheel speeds, with the drivetrain taken out, by models that have not seen the drive.

    Args:
        data: all drives.
        item: forecasts by commands, with robot, soil and sensors as calibrated without the drive.
        training: windows of the other drives, to which the track is fitted.
    """
    windows = item.windows
    driven = cut_windows(
        data.prepared.recordings, windows.duration, wheel_radius=data.robot.outer_radius,
        half_track=data.robot.half_track, drive_by="encoders", history=HISTORY, ahead=LATEST,
    )  # fmt: skip
    places = _places(windows, driven)
    seen = driven.subset(np.flatnonzero(np.isin(_keys(driven), _keys(training))))
    sigma = float(data.prepared.sigma[CHANNELS.index("yaw_rate")])
    track = fit_track(seen, data.robot.outer_radius, data.robot.half_track, sigma=sigma, robust=ROBUST)
    chosen = driven.subset(places[places >= 0])
    late = 0.0 if track is None else track.delay
    model = WindowModel(item.robot, item.soil, chosen, imposed=True, numerics=field_numerics(), delay=late)
    found = {CALIBRATED_BY_SPEEDS: model.predict(np.zeros(0), chosen.initial, item.sensors)}
    if track is not None:
        found[TRACK_BY_SPEEDS] = track.predict(chosen)
    return {name: _spread_out(prediction, places) for name, prediction in found.items()}


def _keys(windows: WindowSet) -> NDArray[np.int64]:
    """One number for recording and start."""
    return np.asarray(windows.recording * 10_000_000 + windows.start, dtype=np.int64)


def _places(windows: WindowSet, others: WindowSet) -> NDArray[np.int64]:
    """Place of each window among others with the same start; -1 where there is none."""
    at = {int(key): place for place, key in enumerate(_keys(others))}
    return np.array([at.get(int(key), -1) for key in _keys(windows)], dtype=np.int64)


def _spread_out(prediction: Array, places: NDArray[np.int64]) -> Array:
    found = np.full((len(places), *prediction.shape[1:]), np.nan)
    found[places >= 0] = prediction
    return found


def errors_of(item: Compared, seed: int) -> list[dict[str, Any]]:
    """Rows of drive, model, metric, horizon, and the error with its 95 % interval."""
    rows = []
    for model, prediction in item.predictions.items():
        for horizon in (h for h in HORIZONS if h <= item.windows.duration + 1e-9):
            samples = round(horizon / item.windows.period)
            short = replace(item.windows, measured=item.windows.measured[:, :samples])
            errors = horizon_errors(short, prediction[:, :samples])
            for metric in SHOWN:
                rows.append(_row(item, model, metric, horizon, METRICS[metric][0], errors[metric], seed))
        rows.append(_encoder_row(item, model, prediction, seed))
    return [row for row in rows if row["count"]]


def _encoder_row(item: Compared, model: str, prediction: Array, seed: int) -> dict[str, Any]:
    """Residual of all encoder samples; by window, so that the interval knows that they belong together."""
    errors, clusters = sample_errors(item.windows, prediction, _ENCODERS)
    return _row(item, model, "encoder", None, "rad/s", errors, seed, clusters)


def _row(
    item: Compared,
    model: str,
    metric: str,
    horizon: float | None,
    unit: str,
    errors: Array,
    seed: int,
    clusters: NDArray[np.int64] | None = None,
) -> dict[str, Any]:
    known = np.isfinite(errors)
    numbers = np.arange(len(errors)) if clusters is None else clusters
    size = error_statistics(errors[known], numbers[known], np.random.default_rng(seed))
    return {
        "drive": item.drive, "ground": item.ground, "model": model, "metric": metric, "horizon": horizon,
        "unit": unit, "count": size.count, "rms": size.rms, "rms_interval": size.rms_interval,
        "median": size.median, "median_interval": size.median_interval,
    }  # fmt: skip


def ratio_of(item: Compared, model: str, baseline: str, horizon: float, seed: int) -> dict[str, float] | None:
    """Root mean square heading error of one model over that of another after a horizon, with a 95 % interval.

    Windows are resampled, the same ones for both. The ratio of the medians stands beside it.
    """
    errors = _heading_errors_of(item, (model, baseline), horizon)
    if errors is None:
        return None
    low, high = _interval(lambda drawn: _rms(drawn[0]) / _rms(drawn[1]), errors, seed)
    medians = np.median(np.abs(errors), axis=1)
    return {
        "ratio": float(_rms(errors[0]) / _rms(errors[1])),
        "low": low,
        "high": high,
        "medians": float(medians[0] / medians[1]),
    }


def gain_share(
    item: Compared, model: str, ceiling: str, baseline: str, horizon: float, seed: int
) -> dict[str, float] | None:
    """Share of what a ceiling takes off a baseline's root mean square heading error that a model takes off.

    With a 95 % interval as of :func:`ratio_of`; None where the ceiling takes nothing off.
    """
    errors = _heading_errors_of(item, (model, ceiling, baseline), horizon)
    if errors is None or _rms(errors[1]) >= _rms(errors[2]):
        return None

    def share(drawn: Array) -> Array:
        own, best, worst = _rms(drawn)
        return np.asarray((worst - own) / np.maximum(worst - best, 1e-12))

    low, high = _interval(share, errors, seed)
    return {"ratio": float(share(errors)), "low": low, "high": high}


def _heading_errors_of(item: Compared, models: Sequence[str], horizon: float) -> Array | None:
    """(M, W) heading errors of models where all are known; None where a model made no forecast."""
    if any(model not in item.predictions for model in models):
        return None
    errors = np.stack([heading_errors(item, model, horizon) for model in models])
    return np.asarray(errors[:, np.isfinite(errors).all(axis=0)])


def _interval(statistic: Callable[[Array], Array], errors: Array, seed: int) -> tuple[float, float]:
    """95 % interval of a statistic of (M, R, W) errors, windows drawn R times, the same ones for all models."""
    count = errors.shape[1]
    draws = np.random.default_rng(seed).integers(count, size=(RESAMPLES, count))
    low, high = np.percentile(statistic(errors[:, draws]), [2.5, 97.5])
    return float(low), float(high)


def heading_errors(item: Compared, model: str, horizon: float) -> Array:
    """(W,) error of the heading's change after a horizon [rad], by the gyro; NaN where it cannot be measured."""
    samples = round(horizon / item.windows.period)
    short = replace(item.windows, measured=item.windows.measured[:, :samples])
    return horizon_errors(short, item.predictions[model][:, :samples])["heading"]


def _rms(errors: Array) -> Array:
    return np.asarray(np.sqrt(np.mean(errors**2, axis=-1)))


BY_COMMANDS = (DATA_SHEET, ROLLING, KINEMATIC, CALIBRATED, LEARNED)
"""In the order of tables and figures."""
