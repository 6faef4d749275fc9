"""Drives drawn from the filter's own model: what a filter that is right must be consistent with."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.estimation.ekf import bank_noise
from ddagr_gym.estimation.filter_model import FilterModel
from ddagr_gym.estimation.layout import (
    CHANNEL_SIZE,
    ENCODER_CHANNEL,
    FORCE_CHANNEL,
    GYRO_BIAS,
    GYRO_CHANNEL,
    MEASUREMENT,
    OMEGA,
    PARAMETER,
    PARAMETER_SIZE,
    PROCESS,
    RESPONSE,
    SOIL_RATE,
    STATE_SIZE,
    STRIDE,
    WORK_SIZE,
    X,
)
from ddagr_gym.estimation.measurement_models import specific_force
from ddagr_gym.estimation.process_model import advance_state, body_forces
from ddagr_gym.jit import kernel

Array = NDArray[np.float64]


@kernel()
def _perturb(model: Array, work: Array, root: Array, lags: Array, step: float, draw: Array) -> None:
    """Process noise of one step after :func:`advance_state`; ``draw`` (12,) standard normal."""
    for i in range(3):
        for j in range(3):
            work[X + i] += work[RESPONSE + STRIDE * i + j] * math.sqrt(model[PROCESS + j] / step) * draw[j]
    for bank in range(2):
        work[X + OMEGA + bank] += math.sqrt(bank_noise(model, bank, lags[bank], step)) * draw[OMEGA + bank]
    for i in range(PARAMETER_SIZE):
        for j in range(PARAMETER_SIZE):
            work[X + PARAMETER + i] += math.sqrt(step * model[SOIL_RATE]) * root[i, j] * draw[PARAMETER + j]
    for i in range(GYRO_BIAS, STATE_SIZE):
        work[X + i] += math.sqrt(step * model[PROCESS + i]) * draw[i]


@kernel()
def _read(model: Array, work: Array, draw: Array, reading: Array) -> None:
    """One sample of all channels; ``draw`` (5,) standard normal."""
    body_forces(model, work)
    for axis in range(2):
        reading[FORCE_CHANNEL + axis] = specific_force(model, work, axis)
    reading[GYRO_CHANNEL] = work[X + 2] + work[X + GYRO_BIAS]
    reading[ENCODER_CHANNEL] = work[X + OMEGA]
    reading[ENCODER_CHANNEL + 1] = work[X + OMEGA + 1]
    for channel in range(CHANNEL_SIZE):
        reading[channel] += math.sqrt(model[MEASUREMENT + channel]) * draw[channel]


@kernel()
def _draw(
    model: Array, work: Array, root: Array, commands: Array, step: float, normal: Array, states: Array, readings: Array
) -> None:
    lags = np.empty(2)
    for k in range(commands.shape[0]):
        for bank in range(2):
            lags[bank] = commands[k, bank] - work[X + OMEGA + bank]
        advance_state(model, work, commands[k, 0], commands[k, 1], 0.0, 0.0, step)
        _perturb(model, work, root, lags, step, normal[k, :STATE_SIZE])
        _read(model, work, normal[k, STATE_SIZE:], readings[k])
        for i in range(STATE_SIZE):
            states[k, i] = work[X + i]


def draw_drive(
    model: FilterModel, commands: ArrayLike, rng: np.random.Generator, state: ArrayLike | None = None
) -> tuple[Array, Array]:
    """Drive by the filter's process model with its process and measurement noise.

    Args:
        model: filter model; its sample period is the step.
        commands: (T, 2) right and left bank speed commands [rad/s].
        rng: of all noise, and of the initial state.
        state: (12,) initial; drawn from the model's prior by default.

    Returns:
        States (T, 12) and readings (T, 5).
    """
    drive = np.ascontiguousarray(commands, dtype=np.float64)
    if drive.ndim != 2 or drive.shape[1] != 2:
        raise InputError(f"commands have shape {drive.shape}: give (T, 2).")
    mean, covariance = model.initial()
    x = rng.multivariate_normal(mean, covariance) if state is None else np.array(state, dtype=np.float64)
    root = np.linalg.cholesky(model.soil_prior.logs(model.wheel_load)[1])
    normal = rng.standard_normal((len(drive), STATE_SIZE + CHANNEL_SIZE))
    states, readings = np.empty((len(drive), STATE_SIZE)), np.empty((len(drive), CHANNEL_SIZE))
    work = np.zeros(WORK_SIZE)
    work[X : X + STATE_SIZE] = x
    _draw(model.pack(), work, root, drive, model.sample_period, normal, states, readings)
    return states, readings
