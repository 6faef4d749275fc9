"""Errors of forecasts of left-out drives by data sheet, calibration, and a kinematic model with the same chances."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.calibration.calibration_data import CalibrationData
from ddagr_gym.calibration.joint_fit import FittedModel
from ddagr_gym.calibration.left_out import ENCODERS, Forecast, fold_name, folds
from ddagr_gym.calibration.result import CALIBRATED, DATA_SHEET, KINEMATIC, ForecastError
from ddagr_gym.calibration.simulator_values import fitted_factors, fitted_soil
from ddagr_gym.identification.fit_numerics import field_numerics
from ddagr_gym.identification.fitted_values import robot_with_values
from ddagr_gym.identification.motor_currents import without_currents
from ddagr_gym.identification.residual_weights import ROBUST
from ddagr_gym.identification.side_by_side import side_by_side
from ddagr_gym.identification.window_model import WindowModel
from ddagr_gym.identification.windows import CHANNELS, WindowSet
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.physics.effects import Effect
from ddagr_gym.recordings.channels import CURRENTS
from ddagr_gym.replay_analysis.horizons import METRICS, horizon_errors, sample_errors
from ddagr_gym.replay_analysis.intervals import error_statistics
from ddagr_gym.replay_analysis.kinematic import KinematicModel, fit_motor, fit_track

Array = NDArray[np.float64]

HORIZONS = (1.0, 5.0)
"""[s]: what a controller plans over, and what a turn takes."""

SHOWN = ("heading", "position", "wheel_speed")
"""Metrics that are written down of each horizon."""

_GYRO = CHANNELS.index("yaw_rate")


@dataclass(frozen=True, eq=False)
class Forecasts:
    """Forecasts of one left-out drive by all models.

    Attributes:
        drive: name of the drive, or of its half.
        ground: that it was on.
        soil_from: where its soil was fitted.
        windows: that were forecast.
        predictions: (W, T, 8) by model.
        robot: as calibrated without the drive.
        soil: of its ground, likewise.
        sensors: what was calibrated of sensors and gains of commands, likewise.
        currents: measured and forecast currents of both banks (W, T, 2) [A]; None where none is compared.
    """

    drive: str
    ground: str
    soil_from: str
    windows: WindowSet
    predictions: dict[str, Array]
    robot: Robot
    soil: Soil
    sensors: tuple[Effect, ...]
    currents: tuple[Array, Array] | None = None


OTHER_DRIVES = "other drives"
ITSELF = "its first half"


def all_forecasts(
    data: CalibrationData, model: FittedModel, made: Sequence[Forecast], held: dict[str, float], threads: int
) -> tuple[Forecasts, ...]:
    """Forecasts of every left-out drive by the calibrated model, the data sheet and a kinematic one.

    Args:
        data: drives.
        model: calibrated.
        made: its forecasts.
        held: values of the parameters that carry the nominal soils.
        threads: of the simulator.
    """
    fitted = model.problem.blocked.windows
    by_window = folds(data, fitted)

    def compared(forecast: Forecast, own_threads: int) -> Forecasts:
        windows = without_currents(forecast.windows)
        before = _by_data_sheet(data, model, windows, held, own_threads)
        predictions = {DATA_SHEET: before, CALIBRATED: forecast.prediction[..., : len(CHANNELS)]}
        kinematic = _kinematic(data, without_currents(fitted.subset(np.asarray(by_window != forecast.fold))))
        if kinematic is not None:
            predictions[KINEMATIC] = kinematic.predict(windows)
        drive = int(windows.recording[0])
        ground = data.grounds[drive]
        soil_from = ITSELF if data.is_alone(drive) else OTHER_DRIVES
        values = forecast.values_of(model)
        return Forecasts(
            fold_name(data, forecast.fold), ground, soil_from, windows, predictions,
            robot_with_values(model.model.robot, values), fitted_soil(data, ground, values), fitted_factors(values),
            None if data.currents is None else _currents(forecast),
        )  # fmt: skip

    return tuple(side_by_side(compared, made, threads))


def _by_data_sheet(
    data: CalibrationData, model: FittedModel, windows: WindowSet, held: Mapping[str, float], threads: int
) -> Array:
    """Prediction (W, T, 8) of the robot of the data sheet on the nominal soils."""
    offsets = tuple(p for p in model.parameters if p.name in held)
    soil = next(iter(data.soils.values()))
    sheet = WindowModel(data.robot, soil, windows, offsets, numerics=field_numerics(), threads=threads)
    return sheet.predict(np.array([held[p.name] for p in offsets]), windows.initial)


def explained_when_left_out(
    data: CalibrationData, model: FittedModel, made: Iterable[Forecast], held: Mapping[str, float], threads: int
) -> float:
    """Share of the squared error of left-out wheel speeds that a model takes away from the data sheet's.

    Args:
        data: drives.
        model: fitted.
        made: its forecasts.
        held: values of the parameters that carry the nominal soils.
        threads: of the simulator.
    """
    before, after = 0.0, 0.0
    for forecast in made:
        windows = without_currents(forecast.windows)
        measured = windows.measured[..., ENCODERS]
        sheet = _by_data_sheet(data, model, windows, held, threads)
        before += float(np.nansum((sheet[..., ENCODERS] - measured) ** 2))
        after += float(np.nansum((forecast.prediction[..., ENCODERS] - measured) ** 2))
    return 1.0 - after / before if before > 0.0 else 0.0


def _currents(forecast: Forecast) -> tuple[Array, Array]:
    """Measured and forecast currents of both banks (W, T, 2) [A]."""
    own = slice(len(CHANNELS), len(CHANNELS) + len(CURRENTS))
    return forecast.windows.measured[..., own], forecast.prediction[..., own]


def _kinematic(data: CalibrationData, windows: WindowSet) -> KinematicModel | None:
    """Effective track behind a first-order motor with a delay, fitted to the other drives; None without turns."""
    sigma = data.prepared.sigma
    robot = data.robot
    motor = fit_motor(windows, robot.motor_rate, robot.maximum_wheel_speed, float(sigma[ENCODERS[0]]))
    return fit_track(windows, robot.outer_radius, robot.half_track, motor, sigma=float(sigma[_GYRO]), robust=ROBUST)


def forecast_errors(forecasts: Sequence[Forecasts], seed: int, threads: int = 1) -> tuple[ForecastError, ...]:
    """Table of errors by drive, model, metric and horizon, with 95 % intervals.

    Args:
        forecasts: of left-out drives.
        seed: of resampled intervals.
        threads: for the drives.
    """

    def of_drive(item: Forecasts, own_threads: int) -> list[ForecastError]:
        return [error for model, made in item.predictions.items() for error in _errors(item, model, made, seed)]

    return tuple(error for found in side_by_side(of_drive, forecasts, threads) for error in found)


def _errors(item: Forecasts, model: str, prediction: Array, seed: int) -> Iterator[ForecastError]:
    """Errors of one model after every horizon, and of all samples."""
    for horizon in (h for h in HORIZONS if h <= item.windows.duration + 1e-9):
        samples = round(horizon / item.windows.period)
        short = _shortened(item.windows, samples)
        errors = horizon_errors(short, prediction[:, :samples])
        clusters = np.arange(short.count)
        yield from (_error(item, model, m, horizon, METRICS[m][0], errors[m], clusters, seed) for m in SHOWN)
    yield from _samples(item, model, prediction, seed)


def _shortened(windows: WindowSet, samples: int) -> WindowSet:
    """The first samples of every window."""
    speeds = windows.speeds[:, : windows.history + samples]
    return replace(windows, measured=windows.measured[:, :samples], speeds=speeds)


def _samples(item: Forecasts, model: str, prediction: Array, seed: int) -> list[ForecastError]:
    """Errors of all samples of the encoders and of the gyro."""
    made = []
    for metric, channels, unit in (("wheel_speed", ENCODERS, "rad/s"), ("yaw_rate", [_GYRO], "rad/s")):
        errors, clusters = sample_errors(item.windows, prediction, channels)
        made.append(_error(item, model, metric, None, unit, errors, clusters, seed))
    return made


def _error(
    item: Forecasts,
    model: str,
    metric: str,
    horizon: float | None,
    unit: str,
    errors: Array,
    clusters: NDArray[np.integer[Any]],
    seed: int,
) -> ForecastError:
    size = error_statistics(errors, np.asarray(clusters, dtype=np.int64), np.random.default_rng(seed))
    return ForecastError(
        item.drive, item.ground, item.soil_from, model, metric, horizon, unit, size.count, size.rms,
        size.rms_interval, size.median, size.median_interval,
    )  # fmt: skip
