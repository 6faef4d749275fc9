"""The refit of a replay: which parameters are fitted in which drive mode, with which weights, on which windows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.block_means import sample_windows
from ddagr_gym.identification.fit_numerics import FIELD_TOLERANCE, field_numerics
from ddagr_gym.identification.gauss_newton import Fitted, fit, linearised
from ddagr_gym.identification.nuisances import Nuisances
from ddagr_gym.identification.parameters import (
    KIND_STIFFNESS_DEVIATION,
    ModelParameter,
    command_shift,
    robot_parameters,
    sensor_parameters,
    soil_parameters,
    wheel_speed_shift,
)
from ddagr_gym.identification.problem import Point, Problem
from ddagr_gym.identification.recording_noise import RecordingNoise
from ddagr_gym.identification.residual_weights import (
    LEAST_GYRO_BIAS,
    UNKNOWN_GYRO_BIAS,
    Weights,
    misfit_weights,
)
from ddagr_gym.identification.windows import WindowSet
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.physics.effects import Effect
from ddagr_gym.replay_analysis.kinematic import Motor

Array = NDArray[np.float64]

MOTOR_PARAMETERS = ("motor_rate", "maximum_wheel_speed")
"""Not fitted where recorded wheel speeds drive."""

LATEST_CLOCK = 0.5
"""Drive kept before and after every window, and so the largest lateness of a clock that a fit can find [s]."""

MOST_WINDOWS = 150
"""Training windows that a fit uses, evenly chosen: 5 min of 2 s windows."""

PASSES = 2
"""Fits: the first weighs by the sensors' noise, the second by what the first leaves unexplained."""

ITERATIONS = 8
"""Most Gauss-Newton steps of a pass (ours): field drives take 3 to 8."""

_AT_BOUND = 1e-9
"""Distance from a bound that is none, in the unit of the parameter."""


@dataclass(frozen=True, eq=False)
class DriveModeFit:
    """A refit with the parameters that it moved.

    Attributes:
        parameters: (P,).
        fitted: the last pass.
        deviations: (P,) Gauss-Newton standard deviations; resampled intervals are wider and more honest.
        window_deviations: (P,) the same from the scatter of the windows (sandwich), which allows for correlated
            residuals inside a window.
        weights: of the last pass.
    """

    parameters: tuple[ModelParameter, ...]
    fitted: Fitted
    deviations: Array
    window_deviations: Array
    weights: Weights

    @property
    def values(self) -> Array:
        """(P,) fitted values."""
        return self.fitted.point.values

    @property
    def windows(self) -> int:
        """Number of windows that it used."""
        return len(self.fitted.window_cost)

    @property
    def at_bound(self) -> tuple[str, ...]:
        """Names of the parameters that sit at a bound."""
        pairs = zip(self.parameters, self.values, strict=True)
        return tuple(p.name for p, value in pairs if value <= p.low + _AT_BOUND or value >= p.high - _AT_BOUND)


def drive_mode_parameters(
    robot: Robot, soil: Soil, noise: Sequence[RecordingNoise], period: float, imposed: bool
) -> tuple[ModelParameter, ...]:
    """Soil, uncertain robot parameters, biases and the lateness of the drive.

    Args:
        robot: gives the priors of its parameters.
        soil: of a known kind, its stiffness known as well as soils of one kind agree.
        noise: one per recording, for the gyro biases.
        period: between samples [s].
        imposed: True where recorded wheel speeds drive, so that motors do not matter.
    """
    robots = tuple(p for p in robot_parameters(robot) if not (imposed and p.name in MOTOR_PARAMETERS))
    known = [float(np.hypot(*item.gyro_bias)) for item in noise if item.gyro_bias is not None]
    bias = max(*known, LEAST_GYRO_BIAS) if len(known) == len(noise) else UNKNOWN_GYRO_BIAS
    sensors = [p for p in sensor_parameters(len(noise), bias, 1.0) if p.name.startswith("gyro_bias")]
    shift = wheel_speed_shift(LATEST_CLOCK - period) if imposed else command_shift(period)
    return (*soil_parameters(soil, KIND_STIFFNESS_DEVIATION), *robots, *sensors, shift)


def fit_drive_mode(
    robot: Robot,
    soil: Soil,
    windows: WindowSet,
    parameters: Sequence[ModelParameter],
    weights: Weights,
    *,
    imposed: bool,
    start: dict[str, float] | None = None,
    effects: Sequence[Effect] = (),
    threads: int = 1,
    progress: Callable[[], None] = lambda: None,
) -> DriveModeFit:
    """Refit on training windows, first by the sensors' noise, then by what that fit leaves unexplained.

    Args:
        robot: nominal.
        soil: nominal.
        windows: training part.
        parameters: see :func:`drive_mode_parameters`.
        weights: from the noise, see :func:`noise_weights`.
        imposed: whether recorded wheel speeds drive.
        start: values to start from by name; 0 for the others.
        effects: missing physics that stays fixed.
        threads: of the simulator.
        progress: called after each of at most PASSES * ITERATIONS iterations.
    """
    given = start or {}
    low, high = ([getattr(p, bound) for p in parameters] for bound in ("low", "high"))
    values = np.clip([given.get(p.name, 0.0) for p in parameters], low, high)
    point = Point(values, windows.initial)
    for number in range(PASSES):
        problem = Problem(
            robot, soil, sample_windows(windows, weights.sigma), Nuisances(tuple(parameters)), imposed=imposed,
            known=effects, robust=weights.robust, threads=threads, numerics=field_numerics(),
        )  # fmt: skip
        # field data are far from the model: derivatives of a step before are worth less than they cost
        fitted = fit(
            problem, point, iterations=ITERATIONS, tolerance=FIELD_TOLERANCE, renewals=ITERATIONS, progress=progress
        )
        point = fitted.point
        if number < PASSES - 1:
            weights = misfit_weights(windows, fitted.prediction, weights)
    return DriveModeFit(tuple(parameters), fitted, *linearised(problem, fitted).deviations(), weights)


def motor_start(robot: Robot, motor: Motor) -> dict[str, float]:
    """Values of the parameters fitted when commands drive, at which the simulator's motors are ``motor``."""
    return {
        "motor_rate": float(np.log(motor.rate / robot.motor_rate)),
        "maximum_wheel_speed": float(np.log(motor.maximum_speed / robot.maximum_wheel_speed)),
        "command_shift": motor.delay,
    }
