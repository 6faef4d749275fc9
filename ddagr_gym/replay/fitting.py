"""The refit of a replay: what may move in which arm, with which weights, on which windows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.physics.effects import Effect
from ddagr_gym.replay.kinematic import Motor
from ddagr_gym.replay.model import WindowModel, fit_numerics
from ddagr_gym.replay.noise import RecordingNoise
from ddagr_gym.replay.parameters import (
    KIND_STIFFNESS_DEVIATION,
    ModelParameter,
    command_shift,
    robot_parameters,
    sensor_parameters,
    soil_parameters,
    wheel_speed_shift,
)
from ddagr_gym.replay.refit import Refit, Refitter
from ddagr_gym.replay.windows import CHANNELS, WindowSet

Array = NDArray[np.float64]

MOTOR_PARAMETERS = ("motor_rate", "maximum_wheel_speed")
LATEST_CLOCK = 0.5
"""Drive kept before and after every window, and so the largest lateness of a clock that a fit can find [s]."""
ROBUST = 2.0
"""Weighted residual from which the loss is linear: what the model cannot explain, such as digging in, must not bend it."""
MOST_WINDOWS = 150
"""Training windows that a fit uses, evenly chosen: 5 min of 2 s windows."""
UNKNOWN_GYRO_BIAS = 0.005
ACCELEROMETER_BIAS = 0.5
"""Priors [rad/s] where the robot never stood, and [m/s^2]: 3 degrees of tilt."""
ITERATIONS = 10
TOLERANCE = 5e-4


@dataclass(frozen=True, eq=False)
class ArmFit:
    """A refit with the parameters that it moved.

    Attributes:
        parameters: (P,).
        fit: their values and deviations.
        windows: that it used.
    """

    parameters: tuple[ModelParameter, ...]
    fit: Refit
    windows: int


def channel_sigma(noise: Sequence[RecordingNoise], windows: WindowSet, imposed: bool, dead: Sequence[str]) -> Array:
    """Standard deviations (W, 1, 8) of each window's channels; infinite for what is imposed or dead."""
    sigma = np.stack([item.sigma for item in noise])[windows.recording][:, None, :].copy()
    left_out = [*dead, *(("encoder_right", "encoder_left") if imposed else ())]
    sigma[..., [CHANNELS.index(name) for name in left_out]] = np.inf
    return sigma


def arm_parameters(
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
    biases = [UNKNOWN_GYRO_BIAS if item.gyro_bias is None else float(np.hypot(*item.gyro_bias)) for item in noise]
    sensors = sensor_parameters(len(noise), max(biases), ACCELEROMETER_BIAS)
    shift = wheel_speed_shift(LATEST_CLOCK - period) if imposed else command_shift(period)
    return (*soil_parameters(soil, KIND_STIFFNESS_DEVIATION), *robots, *sensors, shift)


def fit_arm(
    robot: Robot,
    soil: Soil,
    windows: WindowSet,
    parameters: Sequence[ModelParameter],
    sigma: Array,
    *,
    imposed: bool,
    start: dict[str, float] | None = None,
    effects: Sequence[Effect] = (),
    threads: int = 1,
    progress: Callable[[], None] = lambda: None,
) -> ArmFit:
    """Refit on training windows.

    Args:
        robot: nominal.
        soil: nominal.
        windows: training part.
        parameters: see :func:`arm_parameters`.
        sigma: see :func:`channel_sigma`, for these windows.
        imposed: whether recorded wheel speeds drive.
        start: values to start from by name; 0 for the others.
        effects: missing physics that stays fixed.
        threads: of the simulator.
        progress: called after each of at most ITERATIONS iterations.
    """
    model = WindowModel(
        robot, soil, windows, parameters, imposed=imposed, numerics=fit_numerics(), threads=threads
    )
    given = start or {}
    values = np.clip(
        [given.get(p.name, 0.0) for p in parameters], [p.low for p in parameters], [p.high for p in parameters]
    )
    refitter = Refitter(model, sigma, effects, progress, robust=ROBUST)
    return ArmFit(tuple(parameters), refitter.fit(values, iterations=ITERATIONS, tolerance=TOLERANCE), windows.count)


def motor_start(robot: Robot, motor: Motor) -> dict[str, float]:
    """Values of the command arm's parameters at which the simulator's motors are ``motor``."""
    return {
        "motor_rate": float(np.log(motor.rate / robot.motor_rate)),
        "maximum_wheel_speed": float(np.log(motor.maximum_speed / robot.maximum_wheel_speed)),
        "command_shift": motor.delay,
    }
