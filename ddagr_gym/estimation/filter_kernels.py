"""Compiled loops of the filter over robots and samples."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.estimation.ekf import at_rest, correct_kernel, predict_kernel
from ddagr_gym.estimation.layout import (
    ACCELEROMETER_INTERVAL,
    CHANNEL_SIZE,
    FORCE_CHANNEL,
    READING,
    STANDARDISED,
    STATE_SIZE,
    STRIDE,
    P,
    X,
)
from ddagr_gym.estimation.process_model import advance_state
from ddagr_gym.jit import kernel

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@kernel()
def _load(state: Array, covariance: Array, work: Array) -> None:
    for i in range(STATE_SIZE):
        work[X + i] = state[i]
        for j in range(STATE_SIZE):
            work[P + STRIDE * i + j] = covariance[i, j]


@kernel()
def _store(work: Array, state: Array, covariance: Array) -> None:
    for i in range(STATE_SIZE):
        state[i] = work[X + i]
        for j in range(STATE_SIZE):
            covariance[i, j] = work[P + STRIDE * i + j]


@kernel()
def _filter_sample(
    model: Array, work: Array, command: Array, reading: Array, slope: Array, duration: float, use_accelerometer: bool,
    standardised: Array,
) -> None:  # fmt: skip
    predict_kernel(model, work, command[0], command[1], slope[0], slope[1], duration)
    for channel in range(CHANNEL_SIZE):
        work[READING + channel] = reading[channel]
    if not use_accelerometer:
        work[READING + FORCE_CHANNEL] = math.nan
        work[READING + FORCE_CHANNEL + 1] = math.nan
    correct_kernel(model, work, at_rest(model, work, command[0], command[1]))
    for channel in range(CHANNEL_SIZE):
        standardised[channel] = work[STANDARDISED + channel]


@kernel()
def filter_rows(
    model: Array, states: Array, covariances: Array, counts: Integers, commands: Array, readings: Array, slopes: Array,
    durations: Array, standardised: Array, work: Array,
) -> None:  # fmt: skip
    """Predict and correct every robot through all its samples.

    Args:
        model: packed model.
        states: (N, 12), updated.
        covariances: (N, 12, 12), updated.
        counts: (N,) samples seen, updated; sets which samples use the accelerometer.
        commands: (N, K or 1, 2) [rad/s]; a single one for all samples.
        readings: (N, K, 5).
        slopes: (N or 1, K or 1, 2) gravity along the body [m/s^2].
        durations: (K or 1,) since the sample before [s].
        standardised: (N, K, 5) innovations, written.
        work: (WORK_SIZE,).
    """
    interval = int(model[ACCELEROMETER_INTERVAL])
    for n in range(states.shape[0]):
        _load(states[n], covariances[n], work)
        for k in range(readings.shape[1]):
            counts[n] += 1
            _filter_sample(
                model, work, commands[n, min(k, commands.shape[1] - 1)], readings[n, k],
                slopes[min(n, slopes.shape[0] - 1), min(k, slopes.shape[1] - 1)],
                durations[min(k, durations.shape[0] - 1)], counts[n] % interval == 0, standardised[n, k],
            )  # fmt: skip
        _store(work, states[n], covariances[n])


@kernel()
def filter_series(
    model: Array, state: Array, covariance: Array, commands: Array, readings: Array, slopes: Array, durations: Array,
    states: Array, covariances: Array, standardised: Array, work: Array,
) -> None:  # fmt: skip
    """One robot through a series, keeping every posterior.

    Args:
        model: packed model.
        state: (12,) initial.
        covariance: (12, 12) initial.
        commands: (T, 2) [rad/s].
        readings: (T, 5).
        slopes: (T, 2) [m/s^2].
        durations: (T,) [s].
        states: (T, 12), written.
        covariances: (T, 12, 12), written.
        standardised: (T, 5), written.
        work: (WORK_SIZE,).
    """
    interval = int(model[ACCELEROMETER_INTERVAL])
    _load(state, covariance, work)
    for k in range(readings.shape[0]):
        _filter_sample(
            model, work, commands[k], readings[k], slopes[k], durations[k], (k + 1) % interval == 0, standardised[k]
        )
        _store(work, states[k], covariances[k])


@kernel()
def roll_out_kernel(
    model: Array, state: Array, commands: Array, slopes: Array, step: float, states: Array, work: Array
) -> None:
    """State (12,) through commands (T, 2) without measurements; ``states`` (T, 12) is written."""
    for i in range(STATE_SIZE):
        work[X + i] = state[i]
    for k in range(commands.shape[0]):
        slope = slopes[min(k, slopes.shape[0] - 1)]
        advance_state(model, work, commands[k, 0], commands[k, 1], slope[0], slope[1], step)
        for i in range(STATE_SIZE):
            states[k, i] = work[X + i]
