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
from ddagr_gym.identification.windows import CHANNELS, WindowSet
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.physics.effects import Effect
from ddagr_gym.replay_analysis.kinematic import Motor
from ddagr_gym.replay_analysis.residuals import residuals, successive_correlation

Array = NDArray[np.float64]

UNFITTED = ("specific_force_x", "specific_force_y")
"""Not fitted: tilt of the ground, lever arm and vibration are all in them, and not in the nominal model."""
MOTOR_PARAMETERS = ("motor_rate", "maximum_wheel_speed")
"""Not fitted where recorded wheel speeds drive."""

LATEST_CLOCK = 0.5
"""Drive kept before and after every window, and so the largest lateness of a clock that a fit can find [s]."""

ROBUST = 2.0
"""Weighted residual from which the loss is linear (ours): what the model cannot explain must not bend it."""

MOST_WINDOWS = 150
"""Training windows that a fit uses, evenly chosen: 5 min of 2 s windows."""

UNKNOWN_GYRO_BIAS = 0.005
"""Prior where a robot never stood [rad/s]: that of a MEMS gyro (ours)."""

LEAST_GYRO_BIAS = 2e-4
"""Least prior [rad/s]: the bias of a gyro wanders by so much in a drive (ours)."""

PASSES = 2
"""Fits: the first weighs by the sensors' noise, the second by what the first leaves unexplained."""

ITERATIONS = 8
"""Most Gauss-Newton steps of a pass (ours): field drives take 3 to 8."""

_NORMAL = 1.4826
"""Standard deviation of a normal variable over the median of its size."""

_STRONGEST = 0.98
"""Correlation of successive samples beyond which they are not weighed down further (ours): a hundred are worth one."""

_AT_BOUND = 1e-9
"""Distance from a bound that is none, in the unit of the parameter."""

_FEWEST = 20
"""Samples of a channel below which its residuals change no weight (ours)."""


@dataclass(frozen=True, eq=False)
class Weights:
    """Weights of a fit.

    Correlated samples count for less: with the correlation r of successive ones (1 + r)/(1 - r) of them are worth one
    (M. S. Bartlett 1946). Their standard deviation is enlarged by the root of that, the size from which the loss is
    linear reduced by it, so that outliers are judged by the size of single samples.

    Attributes:
        sigma: (W, 1, 8) enlarged standard deviations; infinite for channels that are left out.
        robust: (8,) weighted residuals from which the loss is linear.
    """

    sigma: Array
    robust: Array


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


def noise_weights(
    noise: Sequence[RecordingNoise],
    windows: WindowSet,
    imposed: bool,
    dead: Sequence[str],
    unfitted: Sequence[str] = UNFITTED,
) -> Weights:
    """Weights by the recordings' noise.

    Args:
        noise: one per recording.
        windows: to be fitted.
        imposed: True where the encoders drive, and so cannot judge.
        dead: channels to leave out.
        unfitted: further ones; parameters are fitted without UNFITTED, initial states with all.
    """
    roots = np.stack([[_root(item.channels[name].correlation) for name in CHANNELS] for item in noise])
    sigma = (np.stack([item.sigma for item in noise]) * roots)[windows.recording][:, None, :]
    left_out = [*unfitted, *dead, *(("encoder_right", "encoder_left") if imposed else ())]
    sigma[..., [CHANNELS.index(name) for name in left_out]] = np.inf
    return Weights(sigma, ROBUST / roots.max(axis=0))


def misfit_weights(windows: WindowSet, prediction: Array, before: Weights) -> Weights:
    """Weights by the residuals of a fit: their robust size and their correlation, never below the noise's.

    Args:
        windows: that were fitted.
        prediction: (W, T, 8) of the fit.
        before: weights of the fit.
    """
    sigma, robust = before.sigma.copy(), before.robust.copy()
    left = residuals(windows, prediction)
    for k in range(len(CHANNELS)):
        residual = left[..., k]
        known = np.isfinite(residual)
        if known.sum() < _FEWEST or not np.isfinite(sigma[..., k]).any():
            continue
        size = _NORMAL * float(np.median(np.abs(residual[known])))
        limit = 3.0 * size
        root = _root(successive_correlation(np.clip(residual, -limit, limit)))
        sigma[..., k] = np.maximum(sigma[..., k], size * root)
        robust[k] = min(robust[k], ROBUST / root)
    return Weights(sigma, robust)


def _root(correlation: float) -> float:
    """Root of the samples that are worth one."""
    kept = min(max(correlation, 0.0), _STRONGEST)
    return float(np.sqrt((1.0 + kept) / (1.0 - kept)))


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
