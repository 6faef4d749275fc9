"""Drives drawn from the filter's own model: what a filter that is right must be consistent with."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.estimation.ekf import step_noise
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
    PROCESS,
    PRODUCT_ROW,
    SCRATCH_ROWS,
    STATE_SIZE,
)
from ddagr_gym.estimation.measurement_models import specific_force
from ddagr_gym.estimation.process_model import advance_state, body_forces
from ddagr_gym.jit import kernel

Array = NDArray[np.float64]


@kernel()
def _draw(
    model: Array, state: Array, root: Array, commands: Array, step: float, normal: Array, states: Array,
    readings: Array, scratch: Array,
) -> None:  # fmt: skip
    for k in range(commands.shape[0]):
        right, left = commands[k, 0], commands[k, 1]
        lag_right, lag_left = right - state[OMEGA], left - state[OMEGA + 1]
        draw = normal[k]
        decay = advance_state(model, state, right, left, 0.0, 0.0, step, scratch)
        for i in range(3):
            for j in range(3):
                state[i] += scratch[PRODUCT_ROW + i, j] * np.sqrt(model[PROCESS + j] / step) * draw[j]
        right_variance, left_variance, share = step_noise(model, lag_right, lag_left, decay, step)
        state[OMEGA] += np.sqrt(right_variance) * draw[3]
        state[OMEGA + 1] += np.sqrt(left_variance) * draw[4]
        for i in range(4):
            for j in range(4):
                state[PARAMETER + i] += np.sqrt(share) * root[i, j] * draw[5 + j]
        for i in range(GYRO_BIAS, STATE_SIZE):
            state[i] += np.sqrt(step * model[PROCESS + i]) * draw[i]
        body_forces(model, state, scratch)
        for axis in range(2):
            readings[k, FORCE_CHANNEL + axis] = specific_force(model, state, axis, scratch)
        readings[k, GYRO_CHANNEL] = state[2] + state[GYRO_BIAS]
        readings[k, ENCODER_CHANNEL] = state[OMEGA]
        readings[k, ENCODER_CHANNEL + 1] = state[OMEGA + 1]
        for channel in range(CHANNEL_SIZE):
            readings[k, channel] += np.sqrt(model[MEASUREMENT + channel]) * draw[STATE_SIZE + channel]
        states[k] = state


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
    root = np.linalg.cholesky(model.prior.logs(model.wheel_load)[1])
    normal = rng.standard_normal((len(drive), STATE_SIZE + CHANNEL_SIZE))
    states, readings = np.empty((len(drive), STATE_SIZE)), np.empty((len(drive), CHANNEL_SIZE))
    scratch = np.zeros((SCRATCH_ROWS, STATE_SIZE))
    _draw(model.pack(), x, root, drive, model.sample_period, normal, states, readings, scratch)
    return states, readings
