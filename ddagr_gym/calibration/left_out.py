"""Forecasts of drives that were left out of the fit.

A fit to the other drives is one Gauss-Newton step from the joint one: its sensitivities are known, and leaving one
drive of several out moves the parameters little. Of this step the share is taken by which the other drives are read
best: where they hardly tell parameters apart, the linear problem moves these far. What belongs to the left-out drive
alone (the soil of a ground that no other drive is on, its gyro bias) is fitted to the first half of it, and the second
half is forecast.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.calibration.calibration_data import CalibrationData
from ddagr_gym.calibration.joint_fit import LAST_ITERATIONS, FittedModel, fit_model
from ddagr_gym.calibration.parts import RobotModel
from ddagr_gym.identification.data_split import parts_of_time
from ddagr_gym.identification.fit_numerics import FIELD_TOLERANCE
from ddagr_gym.identification.gauss_newton import fit, values_after_step
from ddagr_gym.identification.least_squares import huber_loss
from ddagr_gym.identification.problem import Point, Problem
from ddagr_gym.identification.residual_weights import Weights, residuals
from ddagr_gym.identification.side_by_side import side_by_side
from ddagr_gym.identification.windows import CHANNELS, WindowSet
from ddagr_gym.recordings.channels import CURRENTS

Array = NDArray[np.float64]
Booleans = NDArray[np.bool_]
Integers = NDArray[np.int64]

OWN_ITERATIONS = 5
"""Steps of the fit of what belongs to a left-out drive alone (ours): few parameters, and few windows."""


@dataclass(frozen=True, eq=False)
class Forecast:
    """Prediction of windows that no fit has seen, from the state at their start.

    Attributes:
        fold: which of the folds was left out.
        windows: that are forecast.
        values: (P,) of the parameters, fitted without them.
        prediction: (W, T, 8).
    """

    fold: int
    windows: WindowSet
    values: Array
    prediction: Array

    def values_of(self, model: FittedModel) -> dict[str, float]:
        """Values by name of the parameters of the model that was forecast with."""
        return dict(zip((p.name for p in model.parameters), self.values.tolist(), strict=True))


QUARTERS = ("first", "second", "third", "last")
"""Parts of a single drive that are left out in turn (ours): a fit to half of a drive differs too much from one to all,
and two parts say nothing of the scatter between them."""


def folds(data: CalibrationData, windows: WindowSet) -> Integers:
    """(W,) fold of each window: its drive, or of a single drive the quarter of its time."""
    if data.count > 1:
        return windows.recording
    return parts_of_time(windows.time, data.windows.time, len(QUARTERS))


def fold_name(data: CalibrationData, fold: int) -> str:
    """What a fold is called."""
    return data.names[fold] if data.count > 1 else f"{data.names[0]}, {QUARTERS[fold]} quarter"


def first_half(windows: WindowSet, chosen: Booleans) -> Booleans:
    """(W,) windows of the first half, in time, of the chosen ones."""
    middle = np.median(windows.time[chosen])
    return np.asarray(chosen & (windows.time < middle))


def values_without(model: FittedModel, out: Booleans) -> Array:
    """Values (P,) of a model's parameters as fitted without some windows; what acts in those alone is left as it is.

    Args:
        model: fitted to all windows.
        out: (W,) windows that are left out.
    """
    return values_after_step(_of_others(model, out), model.fitted.subset(~out))


def refitted_without(model: FittedModel, out: Booleans) -> Array:
    """The same as :func:`values_without` by a fit of its own, of some minutes, from where the model stands."""
    start = Point(model.fitted.point.values, model.fitted.point.states[~out])
    found = fit(
        _of_others(model, out), start, iterations=LAST_ITERATIONS, tolerance=FIELD_TOLERANCE, renewals=LAST_ITERATIONS
    )
    return found.point.values


def _of_others(model: FittedModel, out: Booleans) -> Problem:
    """The fit of the windows that stay, with what acts in the others alone held."""
    alone = np.array([not _acts(model, k, ~out) for k in range(len(model.parameters))])
    return model.problem.subset(~out).holding(alone)


def _acts(model: FittedModel, parameter: int, rows: Booleans) -> bool:
    """Whether a parameter acts in any of the windows."""
    recording = model.problem.blocked.windows.recording[rows]
    return bool(model.parameters[parameter].acts_in(recording).any())


def _with_own(
    data: CalibrationData, model: FittedModel, values: Array, out: Booleans, weights: Weights, threads: int
) -> Array:
    """Values (P,) with what belongs to a left-out drive alone fitted to the first half of it."""
    names = [p.name for p in model.parameters]
    own = frozenset(p.name for k, p in enumerate(model.parameters) if p.prior > 0.0 and not _acts(model, k, ~out))
    alone = RobotModel(
        model.model.robot, tuple(p if p.name in own else replace(p, prior=0.0) for p in model.parameters)
    )
    windows = model.problem.blocked.windows
    rows = first_half(windows, out)
    start = {name: 0.0 if name in own else value for name, value in zip(names, values.tolist(), strict=True)}
    found = fit_model(
        data, windows.subset(rows), alone, Weights(weights.sigma[rows], weights.robust), start, threads,
        iterations=OWN_ITERATIONS,
    )  # fmt: skip
    return np.array([found.values[name] for name in names])


def forecasts(
    data: CalibrationData,
    model: FittedModel,
    judged: WindowSet,
    weights: Weights,
    threads: int,
    without: Callable[[FittedModel, Booleans], Array] = values_without,
) -> Iterator[Forecast]:
    """Forecast of every fold that the fit has windows of, by the model fitted without it.

    Few windows spread over a single drive may miss a quarter with hardly any commands. Its first and its last quarter
    always have one, so that at least two folds are forecast.

    Args:
        data: drives.
        model: fitted to windows of all drives.
        judged: windows to forecast.
        weights: of the fit.
        threads: of the simulator.
        without: the model's parameters as fitted without some windows.
    """
    fitted = model.problem.blocked.windows
    by_window, by_judged = folds(data, fitted), folds(data, judged)

    def forecast(fold: int, own_threads: int) -> Forecast:
        out, inside = by_window == fold, by_judged == fold
        own = replace(model, problem=model.problem.on_threads(own_threads))
        values = without(own, out)
        if data.is_alone(fold):
            values = _with_own(data, own, values, out, weights, own_threads)
            # what was fitted to the first half judges the second only
            inside &= judged.time >= float(np.median(fitted.time[out]))
        chosen = judged.subset(np.asarray(inside))
        return Forecast(fold, chosen, values, own.problem.model_of(chosen).predict(values, chosen.initial))

    return side_by_side(forecast, np.intersect1d(by_window, by_judged).tolist(), threads)


def forecast_losses(forecast: Forecast, sigma: Array, robust: Array) -> tuple[float, float]:
    """Mean robust losses of a forecast's samples: of all channels, and of what the drivetrain moves by itself.

    The latter are encoders and the motors' currents; all channels where none of them counts.

    Args:
        forecast: of one fold.
        sigma: (8,) of the channels, infinite for those that do not count.
        robust: (8,) weighted residual from which the loss is linear.
    """
    weighted = residuals(forecast.windows, forecast.prediction) / sigma
    weighted = np.where(np.isfinite(forecast.prediction), weighted, BROKEN)
    known = np.isfinite(forecast.windows.measured) & np.isfinite(sigma)
    wheels = known & np.isin(np.arange(known.shape[2]), WHEELS)
    losses = huber_loss(weighted, np.broadcast_to(robust, weighted.shape))
    return float(np.mean(losses[known])), float(np.mean(losses[wheels if wheels.any() else known]))


BROKEN = 100.0
"""Weighted residual that stands for a prediction that failed (ours): far beyond any other."""


def fold_sigma(data: CalibrationData, windows: WindowSet, weights: Weights) -> dict[int, Array]:
    """(8,) standard deviations of the channels by fold."""
    by_window = folds(data, windows)
    return {int(fold): weights.sigma[by_window == fold][0, 0] for fold in np.unique(by_window)}


ENCODERS = (CHANNELS.index("encoder_right"), CHANNELS.index("encoder_left"))
WHEELS = (*ENCODERS, *range(len(CHANNELS), len(CHANNELS) + len(CURRENTS)))
"""Channels of the drivetrain alone; currents are not always there."""
