"""How far the filter was off in a simulated drive (theory: control, metric 6): pure functions of a drive's columns."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.control.circle import turn_window
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.estimation import FilterModel, FilterRun, roll_out, run_filter, slip_ratio
from ddagr_gym.estimation.dead_reckoning import integrate_track
from ddagr_gym.estimation.layout import CHANNELS, OMEGA
from ddagr_gym.evaluation.costs import finite_series
from ddagr_gym.evaluation.metrics import headland_samples

Array = NDArray[np.float64]

HORIZONS = (1.0, 5.0)
"""Of the predictions that are judged [s] (theory: control, metric 6)."""

_START_SPACING = 2.0
"""Between the starts of predictions [s] (ours)."""

_JUDGED_CHANNELS = tuple(CHANNELS.index(name) for name in ("yaw_rate", "encoder_right", "encoder_left"))


@dataclass(frozen=True)
class EstimatorErrors:
    """Errors of the filter in one drive, up to the next row's start line where it was reached.

    Attributes:
        speed_rms: root mean square error of v_x [m/s].
        yaw_rate_rms: of the yaw rate [rad/s].
        slip_rms: of the slip ratios of both banks [-].
        radius: estimated over true R_int less one, both arc length over heading change in the turn's window [-]; None
            where there is no such turn.
        prediction_1s: root mean square position error of predictions by the filter's model over 1 s [m].
        prediction_5s: over 5 s [m]; None for a drive that is shorter.
        dead_reckoning: distance of the integrated estimate from the true position at the end, over the path [-].
        innovation: mean normalised innovation squared of gyro and encoders per channel [-]; 1 for a consistent filter.
    """

    speed_rms: float
    yaw_rate_rms: float
    slip_rms: float
    radius: float | None
    prediction_1s: float | None
    prediction_5s: float | None
    dead_reckoning: float
    innovation: float


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _slip_error(model: FilterModel, states: Array, truth: Mapping[str, Array]) -> float:
    errors = []
    for bank, side in ((0, 1.0), (1, -1.0)):
        name, arm = ("right", "left")[bank], side * model.robot.half_track
        estimated = slip_ratio(model.outer_radius * states[:, OMEGA + bank], states[:, 0] + arm * states[:, 2])
        hub = truth["true_v_x"] + arm * truth["true_yaw_rate"]
        errors.append(estimated - slip_ratio(model.outer_radius * truth[f"true_omega_{name}"], hub))
    return _rms(np.concatenate(errors))


def _radius_error(states: Array, truth: Mapping[str, Array], side: str) -> float | None:
    window, _ = turn_window(truth["true_yaw"], side)
    if window is None or window.stop - window.start < 2:
        return None
    speed = np.hypot(states[window, 0], states[window, 1]).sum()
    true_speed = np.hypot(truth["true_v_x"][window], truth["true_v_y"][window]).sum()
    rate, true_rate = states[window, 2].sum(), truth["true_yaw_rate"][window].sum()
    if abs(rate) < 1e-9 or abs(true_rate) < 1e-9 or true_speed <= 0.0:
        return None
    return float(speed / rate / (true_speed / true_rate) - 1.0)


def _prediction_error(
    model: FilterModel, states: Array, commands: Array, truth: Mapping[str, Array], horizon: float
) -> float | None:
    """Position error of roll-outs from the estimate, in the frame of the true pose at their start."""
    period = model.sample_period
    steps, spacing = round(horizon / period), round(_START_SPACING / period)
    errors = []
    for start in range(spacing, len(states) - steps, spacing):
        future = roll_out(model, states[start], commands[start + 1 : start + 1 + steps])
        motion = np.vstack([states[start, :3], future[:, :3]])
        yaw = np.cumsum(0.5 * (motion[1:, 2] + motion[:-1, 2])) * period
        heading = truth["true_yaw"][start] + yaw - 0.5 * period * motion[1:, 2]
        middle = 0.5 * (motion[1:] + motion[:-1])
        x = np.sum(middle[:, 0] * np.cos(heading) - middle[:, 1] * np.sin(heading)) * period
        y = np.sum(middle[:, 0] * np.sin(heading) + middle[:, 1] * np.cos(heading)) * period
        errors.append(
            math.hypot(
                truth["true_x"][start + steps] - truth["true_x"][start] - x,
                truth["true_y"][start + steps] - truth["true_y"][start] - y,
            )
        )
    return _rms(np.array(errors)) if errors else None


def _dead_reckoning(
    states: Array, truth: Mapping[str, Array], start: tuple[float, float, float], period: float
) -> float:
    x, y, _ = integrate_track(states[:, 0], states[:, 1], states[:, 2], period)[-1]
    cosine, sine = math.cos(start[2]), math.sin(start[2])
    reached = (start[0] + cosine * x - sine * y, start[1] + sine * x + cosine * y)
    steps = np.hypot(np.diff(truth["true_x"], prepend=start[0]), np.diff(truth["true_y"], prepend=start[1]))
    missed = math.hypot(reached[0] - truth["true_x"][-1], reached[1] - truth["true_y"][-1])
    return missed / max(float(steps.sum()), 1e-3)


def estimator_errors(
    model: FilterModel,
    columns: Mapping[str, ArrayLike],
    turn: RowTurn,
    start: tuple[float, float, float],
    run: FilterRun | None = None,
) -> EstimatorErrors:
    """Errors of the filter in a simulated drive, by running the filter over its readings.

    Args:
        model: of the filter, from the nominal robot and sensors.
        columns: of a simulated drive: time, commands, readings and truth, each (T,).
        turn: the commanded manoeuvre.
        start: true pose before the first sample, x, y [m], yaw [rad].
        run: the filter's run over ``columns`` where it is already known.

    Raises:
        InputError: a column has gaps or another length.
    """
    filtered = run_filter(model, columns) if run is None else run
    names = [name for name in columns if name.startswith("true_")] + ["command_right", "command_left"]
    whole = dict(zip(names, finite_series(**{name: columns[name] for name in names}), strict=True))
    window, crossed = headland_samples(whole["true_x"], whole["true_yaw"], turn.side)
    end = window.stop if window is not None and crossed else len(filtered.t)
    truth = {name: values[:end] for name, values in whole.items()}
    states = filtered.states[:end]
    commands = np.column_stack([truth["command_right"], truth["command_left"]])
    normalised = filtered.standardised[:end, list(_JUDGED_CHANNELS)]
    predictions = [_prediction_error(model, states, commands, truth, horizon) for horizon in HORIZONS]
    return EstimatorErrors(
        speed_rms=_rms(states[:, 0] - truth["true_v_x"]),
        yaw_rate_rms=_rms(states[:, 2] - truth["true_yaw_rate"]),
        slip_rms=_slip_error(model, states, truth),
        radius=_radius_error(states, truth, turn.side),
        prediction_1s=predictions[0],
        prediction_5s=predictions[1],
        dead_reckoning=_dead_reckoning(states, truth, start, model.sample_period),
        innovation=float(np.nanmean(np.square(normalised))),
    )
