"""The thesis's own filter (chapter 5), put right and kept for comparison; nothing of ours is added.

States v_x, v_y, yaw rate, omega_right, omega_left, a1, a2, b: linear parameters, no resistance, no biases (5.1).
Put right: signs of the force law and rows of the model (theory: wheel model, eq. (37)), specific force F/m as the
accelerometer's reading instead of the body velocity's derivative (5.5), innovation y - h(x) (5.12 prints y - Hx), the
transpose in the Joseph form (5.11). Kept: fourth-order Runge-Kutta of state and covariance (5.7), (5.8), the vector
update (5.10), noise of (6.2). Ours, because the thesis says nothing: initial parameters and their variances, the least
value of the parameters, which keeps them positive, and Runge-Kutta steps that follow the stiffness.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.estimation.columns import known_commands, sample_times, stack_columns
from ddagr_gym.estimation.filter import FilterRun
from ddagr_gym.estimation.filter_model import FilterModel
from ddagr_gym.estimation.force_laws import ForceLaw
from ddagr_gym.estimation.layout import (
    CHANNEL_SIZE,
    CHANNELS,
    COMMANDS,
    FORCE,
    GRADIENT,
    MOTOR_RATE,
    PARAMETER,
    STRIDE,
    WORK_SIZE,
    X,
)
from ddagr_gym.estimation.process_model import body_forces
from ddagr_gym.jit import kernel
from ddagr_gym.parameters import Robot
from ddagr_gym.validated import Validated, bounded

Array = NDArray[np.float64]

THESIS_STATE = ("v_x", "v_y", "yaw_rate", "omega_right", "omega_left", "a1", "a2", "b")
"""Entries of the thesis's state (5.1)."""

_SIZE = 8  # entries of THESIS_STATE
_LEAST_STEPS = 8  # of Runge-Kutta in a sample (ours): 1 ms, the period of the thesis's inner loop, at its 125 Hz
_STAGES = np.array([0.0, 0.5, 0.5, 1.0])  # of the classical fourth-order Runge-Kutta method
_NO_RESISTANCE = np.log(1e-12)  # [ln N]: the thesis's law has none, and the logarithm of nothing is infinite


@dataclass(frozen=True)
class ThesisModel(Validated):
    """The thesis filter's knowledge: robot, noise, start.

    Attributes:
        robot: mass, inertia, geometry and motor rate.
        process: diagonal of Q per second, in the order of THESIS_STATE (6.2).
        measurement: diagonal of R, in the order of CHANNELS (6.2).
        initial_variance: diagonal of P0; (6.2) for the parameters, ours for a1 and b, whose unit is the newton.
        parameters: initial a1 [N], a2 [-], b [N/rad].
        least_parameter: least value of a1, a2 and b.
        sample_period: [s].
        stability: Runge-Kutta step times largest row sum of the model's derivative, which reaches 1e4 1/s near rest;
            the method is stable up to 2.78, a positive covariance needs less.
    """

    robot: Robot
    process: tuple[float, ...] = (1e-6, 1e-5, 1e-6, 0.0, 0.0, 1e-7, 1e-9, 1e-7)
    measurement: tuple[float, ...] = (5e-3, 5e-3, 7e-5, 1e-1, 1e-1)
    initial_variance: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0, 2500.0, 1.0, 10000.0)
    parameters: tuple[float, float, float] = (165.0, 5.0, 840.0)
    least_parameter: float = bounded("-", 0.0, 1.0, default=1e-2, open_low=True)
    sample_period: float = bounded("s", 0.0, 1.0, default=0.008, open_low=True)
    stability: float = bounded("-", 0.0, 2.0, default=0.4, open_low=True)

    def _check(self) -> None:
        for name, length in (("process", _SIZE), ("measurement", CHANNEL_SIZE), ("initial_variance", _SIZE)):
            values = np.asarray(getattr(self, name), dtype=np.float64)
            if values.shape != (length,) or not (np.isfinite(values).all() and (values >= 0.0).all()):
                raise InputError(f"ThesisModel.{name} is {getattr(self, name)!r}: give {length} variances.")


class _Scratch(NamedTuple):
    """Arrays that a step writes into.

    Attributes:
        k_x: (5, 8) derivatives of the state at the four stages, and the state of a stage.
        k_p: (5, 8, 8) the same of the covariance.
        a: (8, 8) Jacobian.
        work: (WORK_SIZE,) of the force law.
    """

    k_x: Array
    k_p: Array
    a: Array
    work: Array

    @classmethod
    def empty(cls) -> _Scratch:
        """Zeros."""
        return cls(np.zeros((5, _SIZE)), np.zeros((5, _SIZE, _SIZE)), np.zeros((_SIZE, _SIZE)), np.zeros(WORK_SIZE))


@kernel()
def _derivative(
    model: Array, x: Array, p: Array, command: Array, noise: Array, a: Array, x_dot: Array, p_dot: Array, work: Array
) -> None:
    """Right-hand sides of (5.7) and (5.8)."""
    _evaluate(model, x, work)
    a[:] = 0.0
    for row in range(3):
        for j in range(_SIZE):
            a[row, j] = work[GRADIENT + STRIDE * row + j]
    a[0, 1] += x[2]
    a[0, 2] += x[1]
    a[1, 0] -= x[2]
    a[1, 2] -= x[0]
    x_dot[:] = 0.0
    x_dot[0] = work[FORCE] + x[2] * x[1]
    x_dot[1] = work[FORCE + 1] - x[2] * x[0]
    x_dot[2] = work[FORCE + 2]
    for bank in range(2):
        a[3 + bank, 3 + bank] = -model[MOTOR_RATE]
        x_dot[3 + bank] = model[MOTOR_RATE] * (command[bank] - x[3 + bank])
    for i in range(_SIZE):
        for j in range(_SIZE):
            p_dot[i, j] = noise[i] if i == j else 0.0
    for i in range(PARAMETER):
        for j in range(_SIZE):
            total = 0.0
            for k in range(_SIZE):
                total += a[i, k] * p[k, j]
            p_dot[i, j] += total
            p_dot[j, i] += total


@kernel()
def _evaluate(model: Array, x: Array, work: Array) -> None:
    """Forces of the thesis law at the linear parameters, and their derivatives by the state."""
    for i in range(PARAMETER):
        work[X + i] = x[i]
    for i in range(PARAMETER, _SIZE):
        work[X + i] = np.log(x[i])
    work[X + PARAMETER + 3] = _NO_RESISTANCE
    body_forces(model, work)
    for row in range(3):
        for i in range(PARAMETER, _SIZE):
            work[GRADIENT + STRIDE * row + i] /= x[i]


@kernel()
def _predict(
    model: Array, x: Array, p: Array, command: Array, noise: Array, duration: float, stability: float, scratch: _Scratch
) -> None:
    """Fourth-order Runge-Kutta of state (8,) and covariance (8, 8)."""
    k_x, k_p, a, work = scratch
    _derivative(model, x, p, command, noise, a, k_x[0], k_p[0], work)
    steepest = 0.0
    for i in range(PARAMETER):
        total = 0.0
        for j in range(PARAMETER):
            total += abs(a[i, j])
        steepest = max(steepest, total)
    steps = max(math.ceil(duration * steepest / stability), _LEAST_STEPS)
    h = duration / steps
    for _ in range(steps):
        for stage in range(4):
            part = h * _STAGES[stage]
            last = max(stage - 1, 0)
            for i in range(_SIZE):
                k_x[4, i] = x[i] + part * k_x[last, i]
                for j in range(_SIZE):
                    k_p[4, i, j] = p[i, j] + part * k_p[last, i, j]
            _derivative(model, k_x[4], k_p[4], command, noise, a, k_x[stage], k_p[stage], work)
        for i in range(_SIZE):
            x[i] += h / 6.0 * (k_x[0, i] + 2.0 * k_x[1, i] + 2.0 * k_x[2, i] + k_x[3, i])
            for j in range(_SIZE):
                p[i, j] += h / 6.0 * (k_p[0, i, j] + 2.0 * k_p[1, i, j] + 2.0 * k_p[2, i, j] + k_p[3, i, j])


def _correct(packed: Array, x: Array, p: Array, reading: Array, variances: Array, work: Array) -> Array:
    """Vector update (5.10)-(5.12) in place with the channels that have a sample; returns standardised innovations."""
    _evaluate(packed, x, work)
    h, predicted = np.eye(CHANNEL_SIZE, _SIZE), x[:CHANNEL_SIZE].copy()
    for axis in range(2):
        predicted[axis] = work[FORCE + axis]
        h[axis] = work[GRADIENT + STRIDE * axis : GRADIENT + STRIDE * axis + _SIZE]
    used = np.isfinite(reading)
    h, r, innovation = h[used], np.diag(variances[used]), (reading - predicted)[used]
    standardised = np.full(CHANNEL_SIZE, np.nan)
    s = h @ p @ h.T + r
    gain = np.linalg.solve(s, h @ p).T
    x += gain @ innovation
    rest = np.eye(_SIZE) - gain @ h
    p[:] = rest @ p @ rest.T + gain @ r @ gain.T
    p[:] = 0.5 * (p + p.T)
    standardised[used] = innovation / np.sqrt(np.diag(s))
    return standardised


def run_thesis_filter(model: ThesisModel, columns: Mapping[str, ArrayLike]) -> FilterRun:
    """The thesis's filter over a recording, from rest.

    Args:
        model: its knowledge.
        columns: as for :func:`~ddagr_gym.estimation.filter.run_filter`; commands are needed.

    Returns:
        States (T, 8) in the order of THESIS_STATE; they may be NaN from the sample on at which the filter broke down,
        which is a result of the comparison, not an error.

    Raises:
        InputError: columns missing or of different lengths, or commands that are not known throughout.
    """
    missing = [name for name in ("t", *COMMANDS) if name not in columns]
    if missing:
        raise InputError(f"columns lack {', '.join(missing)}: the thesis's filter needs time and commands.")
    t, durations = sample_times(columns, model.sample_period)
    commands = known_commands(columns, "the thesis's filter")
    readings = stack_columns(columns, CHANNELS, np.nan)
    states, covariances = np.empty((t.size, _SIZE)), np.empty((t.size, _SIZE, _SIZE))
    standardised = np.empty(readings.shape)
    x, p = np.concatenate([np.zeros(5), model.parameters]), np.diag(np.asarray(model.initial_variance, dtype=float))
    packed = FilterModel(model.robot, law=ForceLaw.thesis).pack()
    noise, variances = np.asarray(model.process, dtype=float), np.asarray(model.measurement, dtype=float)
    scratch = _Scratch.empty()
    for k in range(t.size):
        _predict(packed, x, p, commands[k], noise, durations[k], model.stability, scratch)
        # A filter that has broken down carries NaN on; that is its result.
        with np.errstate(invalid="ignore", over="ignore"):
            standardised[k] = _correct(packed, x, p, readings[k], variances, scratch.work)
        x[5:] = np.maximum(x[5:], model.least_parameter)
        states[k], covariances[k] = x, p
    return FilterRun(t, states, covariances, standardised)
