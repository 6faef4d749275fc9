"""Speed estimators on one drive with known truth: yardsticks, the thesis's filter, ours and its variants."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.control.circle import turn_window
from ddagr_gym.errors import InputError
from ddagr_gym.estimation import (
    FilterModel,
    FilterRun,
    ForceLaw,
    SoilPrior,
    ThesisModel,
    channel_statistics,
    encoder_motion,
    run_filter,
    run_thesis_filter,
    slip_ratio,
    symmetric_forward_speed,
)
from ddagr_gym.evaluation.force_law_fits import LAUNCH, drive_law_fit
from ddagr_gym.parameters import Robot, Sensors

Array = NDArray[np.float64]
Columns = Mapping[str, Array]

SMOOTHING = 25
"""Samples over which the yardsticks average encoders and gyro: 0.2 s, a fifth of the motors' time constant more lag."""
SLOW = 0.05
"""Speed of rim and hub below which slip is not judged [m/s]."""
KNOWN_DEVIATION = 0.02
"""Of the logs of the force law's parameters where they are known."""


class Motion(NamedTuple):
    """Estimate of a drive.

    Attributes:
        v_x: (T,) [m/s].
        yaw_rate: (T,) [rad/s].
        omega_right: (T,) [rad/s].
        omega_left: (T,) [rad/s].
        v_x_deviation: (T,) of a filter [m/s].
        standardised: (T, 5) innovations of a filter.
    """

    v_x: Array
    yaw_rate: Array
    omega_right: Array
    omega_left: Array
    v_x_deviation: Array | None = None
    standardised: Array | None = None


@dataclass(frozen=True)
class SpeedEstimator:
    """A named estimator.

    Attributes:
        title: in words.
        estimate: (robot, sensors, columns) -> motion; knows the nominal robot and the sensors' data sheets.
    """

    title: str
    estimate: Callable[[Robot, Sensors, Columns], Motion]


def _of_states(run: FilterRun) -> Motion:
    x = run.states
    with np.errstate(invalid="ignore"):
        return Motion(x[:, 0], x[:, 2], x[:, 3], x[:, 4], run.deviations[:, 0], run.standardised)


def _smooth(values: Array) -> Array:
    """Mean of the last SMOOTHING samples that there are."""
    known = np.isfinite(values)
    total = np.cumsum(np.concatenate([np.zeros(SMOOTHING), np.where(known, values, 0.0)]))
    count = np.cumsum(np.concatenate([np.zeros(SMOOTHING), known]))
    total, count = total[SMOOTHING:] - total[:-SMOOTHING], count[SMOOTHING:] - count[:-SMOOTHING]
    return np.where(count > 0, total / np.maximum(count, 1), 0.0)


def _encoders(robot: Robot, sensors: Sensors, columns: Columns) -> Motion:
    right, left = _smooth(columns["encoder_right"]), _smooth(columns["encoder_left"])
    motion = encoder_motion(robot, right, left)
    return Motion(motion.v_x, motion.yaw_rate, right, left)


def _closed_form(robot: Robot, sensors: Sensors, columns: Columns) -> Motion:
    """The encoders' speed replaces the closed form where this has no solution, so that every sample has an estimate."""
    right, left, turning = (_smooth(columns[name]) for name in ("encoder_right", "encoder_left", "yaw_rate"))
    speed = symmetric_forward_speed(robot, turning, right, left)
    speed = np.where(np.isfinite(speed), speed, encoder_motion(robot, right, left).v_x)
    return Motion(speed, turning, right, left)


def _thesis(robot: Robot, sensors: Sensors, columns: Columns) -> Motion:
    return _of_states(run_thesis_filter(ThesisModel(robot, sample_period=sensors.period), columns))


def _filter(robot: Robot, sensors: Sensors, columns: Columns) -> Motion:
    return _of_states(run_filter(FilterModel.of(robot, sensors), columns))


def _filter_thesis_law(robot: Robot, sensors: Sensors, columns: Columns) -> Motion:
    return _of_states(run_filter(FilterModel.of(robot, sensors, law=ForceLaw.thesis), columns))


def _filter_known_soil(robot: Robot, sensors: Sensors, columns: Columns) -> Motion:
    """The filter that knows the parameters which fit this drive's true wheel forces best."""
    model = FilterModel.of(robot, sensors)
    fit = drive_law_fit(robot, columns, ForceLaw.coupled)
    limit, rate, stiffness, resistance = np.exp(fit.logs)
    known = dict.fromkeys(
        ("traction_limit_deviation", "traction_rate_deviation", "coupling_deviation", "resistance_deviation"),
        KNOWN_DEVIATION,
    )
    prior = SoilPrior(limit / model.wheel_load, rate, stiffness / (limit * rate), resistance / limit, **known)
    return _of_states(run_filter(replace(model, prior=prior, noise=replace(model.noise, soil=0.0)), columns))


ESTIMATORS: dict[str, SpeedEstimator] = {
    "encoders": SpeedEstimator("encoders alone, no slip", _encoders),
    "closed_form": SpeedEstimator("gyro and encoders, symmetric closed form", _closed_form),
    "thesis_filter": SpeedEstimator("the thesis's filter, eight states", _thesis),
    "filter_thesis_law": SpeedEstimator("our filter with the thesis's force law", _filter_thesis_law),
    "filter": SpeedEstimator("our filter", _filter),
    "filter_known_soil": SpeedEstimator("our filter, soil law known", _filter_known_soil),
}
"""Compared estimators by name."""


def judge(motion: Motion, robot: Robot, columns: Columns, side: str) -> dict[str, Any]:
    """Errors of an estimate.

    Args:
        motion: the estimate.
        robot: nominal.
        columns: readings and truth of a row turn.
        side: to which it turned.

    Returns:
        ``radius_error``: distance over heading change between 30 and 150 degrees, over the true one, less 1 [-];
        ``radius_error_momentary``: median absolute relative error of v_x over yaw rate there [-];
        ``speed_square``: mean squared error of v_x [m^2/s^2]; ``slip_square``: of the banks' slip ratios [-];
        ``speed_coverage``: share of samples in which v_x is within two of its standard deviations, for a filter.
        None where the estimate is not finite throughout.

    Raises:
        InputError: a drive that never turned by 30 degrees.
    """
    window, _ = turn_window(columns["true_yaw"], side)
    if window is None:
        raise InputError(f"the robot did not turn {side} by 30 degrees: there is no radius to judge.")
    names = ("radius_error", "radius_error_momentary", "speed_square", "slip_square", "speed_coverage")
    if not all(np.isfinite(values).all() for values in motion[:4]):
        return dict.fromkeys(names)
    speed, turning = columns["true_v_x"][window], columns["true_yaw_rate"][window]
    ours = motion.v_x[window].sum() / motion.yaw_rate[window].sum()
    with np.errstate(divide="ignore", invalid="ignore"):
        momentary = np.abs(motion.v_x[window] / motion.yaw_rate[window] / (speed / turning) - 1.0)
    late = slice(round(LAUNCH / _period(columns)), None)
    wrong = (motion.v_x - columns["true_v_x"])[late]
    deviation = motion.v_x_deviation
    values = (
        ours / (speed.sum() / turning.sum()) - 1.0,
        np.median(momentary),
        np.mean(wrong**2),
        slip_square(motion, robot, columns, late),
        None if deviation is None else np.mean(np.abs(wrong) <= 2.0 * deviation[late]),
    )
    return {name: None if value is None else float(value) for name, value in zip(names, values, strict=True)}


def slip_square(motion: Motion, robot: Robot, columns: Columns, late: slice) -> float:
    """Mean squared error of the slip ratios of both banks, where rim or hub are not slow."""
    radius, width = robot.wheels[0].outer_radius, robot.half_track
    errors = []
    for bank, side in (("right", 1.0), ("left", -1.0)):
        hub = (columns["true_v_x"] + side * width * columns["true_yaw_rate"])[late]
        rim = radius * columns[f"true_omega_{bank}"][late]
        fast = np.maximum(np.abs(hub), np.abs(rim)) > SLOW
        estimated = slip_ratio(
            radius * getattr(motion, f"omega_{bank}")[late], (motion.v_x + side * width * motion.yaw_rate)[late]
        )
        errors.append((estimated - slip_ratio(rim, hub))[fast])
    return float(np.mean(np.concatenate(errors) ** 2))


def innovations(motion: Motion) -> dict[str, dict[str, float]]:
    """NIS and correlation at lag 1 of every channel; empty for an estimate without innovations."""
    if motion.standardised is None:
        return {}
    found = channel_statistics(motion.standardised, lags=1)
    return {name: {"nis": c.nis, "correlation": float(c.correlation[0])} for name, c in found.items()}


def _period(columns: Columns) -> float:
    return float(columns["t"][1] - columns["t"][0])
