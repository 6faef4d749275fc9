"""Where the joint fit begins: at the best of several starts.

Delay, ramp and loop of a drivetrain stand for one another, and the fit has several minima: a command that acts late and
at once looks much like one that is shaped slowly. A first-order loop without load gives the first start. Two others
have delays of real robots with a ramp that hardly shapes anything, and one has slow motors in place of a filter.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.calibration.calibration_data import CalibrationData
from ddagr_gym.calibration.exchanged_parts import with_slow_motors
from ddagr_gym.calibration.independent_steps import IndependentSteps
from ddagr_gym.calibration.joint_fit import (
    FittedModel,
    Standing,
    first_weights,
    fit_model,
    rough_fit,
    weights_by_drive,
)
from ddagr_gym.calibration.parts import RobotModel, complete_robot, first_values
from ddagr_gym.calibration.settings import LONGEST_DELAY
from ddagr_gym.identification.parameters import ModelParameter
from ddagr_gym.identification.residual_weights import Weights
from ddagr_gym.identification.windows import CHANNELS, WindowSet
from ddagr_gym.parameters import Robot
from ddagr_gym.replay_analysis.kinematic import Motor
from ddagr_gym.tasks import Task

Array = NDArray[np.float64]

START_DELAYS = np.arange(0.0, LONGEST_DELAY + 1e-9, 0.05)
"""Delays from which a fit may start [s]: a fit finds one within half of the robot's reaction, no farther."""

START_FACTORS = (0.25, 0.5, 1.0, 2.0, 4.0)
"""Factors on the data sheet's motor rate from which it may start (ours)."""

OTHER_STARTS = ({"command_delay": 0.3, "command_ramp": 1.4}, {"command_delay": 0.4, "command_ramp": 0.7})
"""Values of the other starts [s], [logarithm of a factor]: delays of a Husky and a Warthog (0.2 to 0.43 s), and ramps
two and four times as fast as a likely one. On three drives these two or three others lowered the cost by 7 to 11 %."""

TRIAL_ITERATIONS = 6
"""Steps of the fit from each start (ours): enough to tell minima apart whose costs differ by some per cent."""

MOST_ITERATIONS = 36
"""Steps of the fit from the best start (ours): what it leaves unsettled would count for each part that is taken out."""

WEIGHINGS = 2
"""Times that residuals are weighed again by what that fit leaves (ours): the rough fit's weights depend on where it
stopped. Six drives in another order had weights that differed by up to two times, and then other parts."""

FASTEST = 99.0
"""Percentile of the wheels' turning at which a limit of it starts (ours): single samples overshoot."""

LEAST_TURNING = 0.2
"""Share of a likely turning limit below which it does not start (ours)."""

_ROBUST_SPEED = 0.5
"""Error of a bank speed from which the loss of the start is linear [rad/s] (ours)."""


def start_values(data: CalibrationData, windows: WindowSet, parameters: tuple[ModelParameter, ...]) -> dict[str, float]:
    """Values from which a fit may start; delay and motor rate are the best of many, by a first-order loop without load.

    Args:
        data: drives.
        windows: to fit.
        parameters: of all parts.
    """
    columns = [CHANNELS.index("encoder_right"), CHANNELS.index("encoder_left")]
    measured = windows.measured[..., columns]
    known = np.isfinite(measured)
    best = (np.inf, 0.0, 1.0)
    for delay in START_DELAYS:
        for factor in START_FACTORS:
            motor = Motor(factor * data.robot.motor_rate, data.robot.maximum_wheel_speed, float(delay))
            error = (motor.speeds(windows)[:, 1:] - measured)[known] / _ROBUST_SPEED
            best = min(best, (float(np.mean(np.sqrt(1.0 + error**2))), float(delay), factor))
    return {
        **first_values(parameters),
        "command_delay": best[1],
        "motor_rate": float(np.log(best[2])),
        "turning_limit": _turning_start(data.robot, measured),
    }


def _turning_start(robot: Robot, speeds: Array) -> float:
    """Factor on the turning limit, as a logarithm, that brings it to the fastest turning of the wheels (W, T, 2).

    Where commands never reach a limit, nothing says where it is: a fit has to begin where it acts.
    """
    turning = np.abs(held_turning(speeds))
    if not np.isfinite(turning).any():
        return 0.0
    fastest = float(np.nanpercentile(turning, FASTEST))
    likely = complete_robot(robot).drivetrain.turning_limit
    return float(np.log(max(fastest, LEAST_TURNING * likely) / likely))


def held_turning(speeds: Array) -> Array:
    """Half the difference of both banks' speeds (W, T), each held until its next reading: they seldom come together.

    Args:
        speeds: (W, T, 2) [rad/s], not a number where there is no reading.
    """
    rows = np.arange(speeds.shape[1])[None, :, None]
    last = np.maximum.accumulate(np.where(np.isfinite(speeds), rows, 0), axis=1)
    held = np.take_along_axis(speeds, last, axis=1)
    return np.asarray((held[..., 0] - held[..., 1]) / 2.0)


def fit_from_several(
    data: CalibrationData,
    windows: WindowSet,
    model: RobotModel,
    held: Mapping[str, float],
    threads: int,
    steps: IndependentSteps,
) -> tuple[FittedModel, Weights]:
    """Fit of all parts of a model, by what a rough fit leaves of each drive, from the start that a few steps like best.

    Args:
        data: drives.
        windows: to fit.
        model: with the parts that may be taken out.
        held: values of parameters that never move.
        threads: of the simulator.
        steps: run the first steps from each start.

    Returns:
        The fit, and its weights.
    """
    rough, weights = rough_fit(data, windows, model, {**held, **start_values(data, windows, model.parameters)}, threads)

    common = steps.runner.share((data, windows, model, weights, threads, rough.fitted.point.states))
    starts = {_name(change): {**rough.values, **change} for change in ({}, *OTHER_STARTS)}
    starts["fit of all parts, slower motors"] = with_slow_motors(rough.standing, model.robot).values
    tasks = [
        Task(name, first_steps, (common, values), f"start {number}")
        for number, (name, values) in enumerate(starts.items())
    ]
    tried = steps.results("fit of all parts from several starts", tasks)
    _, best = min(tried, key=lambda item: item[0])
    fitted = _settled_fit(data, windows, model, weights, best, threads)
    noise = first_weights(data, windows)
    for _ in range(WEIGHINGS):
        weights = weights_by_drive(windows, fitted.fitted.prediction, noise)
        fitted = _settled_fit(data, windows, model, weights, fitted.standing, threads)
    return fitted, weights


def _settled_fit(
    data: CalibrationData,
    windows: WindowSet,
    model: RobotModel,
    weights: Weights,
    start: Standing,
    threads: int,
) -> FittedModel:
    """Fit from where another one stands, until it is settled. Arguments as :func:`fit_from_several`."""
    return fit_model(
        data, windows, model, weights, start.values, threads, states=start.states, iterations=MOST_ITERATIONS
    )


def _name(change: Mapping[str, float]) -> str:
    return "fit of all parts" + "".join(f", {name} from {value:g}" for name, value in change.items())


def first_steps(
    common: tuple[CalibrationData, WindowSet, RobotModel, Weights, int, Array], values: Mapping[str, float]
) -> tuple[float, Standing]:
    """Cost after a few steps from a start, and where they lead; workers call it by name.

    Args:
        common: what all starts share: data, windows, model, weights, threads and states, as of :func:`fit_model`.
        values: of the start.
    """
    data, windows, model, weights, threads, states = common
    found = fit_model(data, windows, model, weights, values, threads, states=states, iterations=TRIAL_ITERATIONS)
    return found.fitted.cost, found.standing
