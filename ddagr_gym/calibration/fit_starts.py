"""Where the joint fit begins: at the best of several starts.

Delay, ramps, filter and loop of a drivetrain stand for one another, and the fit has several minima: a command that acts
late and at once looks much like one that is shaped slowly. A first-order loop without load gives the first start, with
a ramp of each bank. Two others have delays of real robots and ramps that hardly shape anything, one has ramps of mean
and turning in place of that of each bank, and one has slow motors in place of a filter. Residuals of a fit that is far
off weigh little beside what the data sheet promises; so each start is weighed again by what it leaves, and the one that
leaves least is taken.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.calibration.calibration_data import CalibrationData
from ddagr_gym.calibration.exchanged_parts import (
    DELAY,
    MEAN_RAMP,
    RAMP,
    TURNING_RAMP,
    has_slow_motors,
    with_slow_motors,
)
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

FAST, FASTER = 0.7, 1.4
"""Logarithms of the factors on a likely ramp, two and four, with which it hardly shapes anything (ours)."""

OTHER_STARTS: Mapping[str, Mapping[str, float]] = {
    "late and at once": {DELAY: 0.3, RAMP: FASTER},
    "later and fast": {DELAY: 0.4, RAMP: FAST},
    "mean and turning ramped": {MEAN_RAMP: 0.0, TURNING_RAMP: 0.0, RAMP: FASTER},
}
"""Values of other starts [s], [logarithm of a factor]: delays of a Husky and a Warthog (0.2 to 0.43 s). On three drives
two or three of them lowered the cost by 7 to 11 %."""

TRIAL_ITERATIONS = (4, 3)
"""Steps of the fit from each start, weighed again between (ours): enough to tell minima apart by some per cent."""

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
        # what a first-order loop is told by would go on into ramps that act
        MEAN_RAMP: FASTER,
        TURNING_RAMP: FASTER,
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
    """Fit of all parts of a model, weighed by what it leaves of each drive, from the start that leaves least.

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
    starts = {"as a first-order loop": rough.values}
    starts |= {name: {**rough.values, **change} for name, change in OTHER_STARTS.items()}
    if has_slow_motors(rough.standing):
        starts["slow motors"] = with_slow_motors(rough.standing, model.robot).values
    tasks = [
        Task(f"fit of all parts, {name}", first_steps, (common, values), f"start {number}")
        for number, (name, values) in enumerate(starts.items())
    ]
    tried = steps.results("fit of all parts from several starts", tasks)
    weights, best = min(tried, key=lambda item: size_of(item[0]))
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


def size_of(weights: Weights) -> float:
    """Mean logarithm of the standard deviations of residuals."""
    known = weights.sigma[np.isfinite(weights.sigma)]
    return float(np.log(known).mean())


def first_steps(
    common: tuple[CalibrationData, WindowSet, RobotModel, Weights, int, Array], values: Mapping[str, float]
) -> tuple[Weights, Standing]:
    """Weights by what a few steps from a start leave, and where they lead; workers call it by name.

    Args:
        common: what all starts share: data, windows, model, weights, threads and states, as of :func:`fit_model`.
        values: of the start.
    """
    data, windows, model, weights, threads, states = common
    noise = first_weights(data, windows)
    for iterations in TRIAL_ITERATIONS:
        found = fit_model(
            data, windows, model, weights, values, threads, states=states, iterations=iterations, renewed=False
        )
        values, states = found.values, found.fitted.point.states
        weights = weights_by_drive(windows, found.fitted.prediction, noise)
    return weights, found.standing
