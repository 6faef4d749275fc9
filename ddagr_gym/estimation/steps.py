"""Predict and correct as pure functions of (model, state, covariance, input)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.estimation.ekf import correct_kernel, predict_kernel
from ddagr_gym.estimation.filter_model import FilterModel
from ddagr_gym.estimation.layout import (
    CHANNEL_SIZE,
    READING,
    STANDARDISED,
    STATE_SIZE,
    STRIDE,
    WORK_SIZE,
    P,
    X,
)
from ddagr_gym.parameters import STANDARD_GRAVITY

Array = NDArray[np.float64]


class Prediction(NamedTuple):
    """State (12,) and covariance (12, 12)."""

    state: Array
    covariance: Array


class Correction(NamedTuple):
    """State (12,), covariance (12, 12) and standardised innovations (5,), NaN where there was no reading."""

    state: Array
    covariance: Array
    standardised: Array


def predict(
    model: FilterModel,
    state: ArrayLike,
    covariance: ArrayLike,
    command: tuple[float, float],
    duration: float | None = None,
    attitude: tuple[float, float] = (0.0, 0.0),
) -> Prediction:
    """State and covariance after driving by one command.

    Args:
        model: filter model.
        state: (12,), see :mod:`ddagr_gym.estimation`.
        covariance: (12, 12).
        command: speed commands of the right and left bank [rad/s]; NaN: unknown, the bank holds its speed with
            growing doubt.
        duration: [s]; the model's sample period by default.
        attitude: roll and pitch [rad], REP 103: roll right side down, pitch nose down positive.

    Raises:
        InputError: wrong shapes, or a duration that is not positive.
    """
    work = _loaded(state, covariance)
    time = model.sample_period if duration is None else positive_duration(duration)
    slope = gravity_along_body(*attitude)
    predict_kernel(model.pack(), work, command[0], command[1], float(slope[0]), float(slope[1]), time)
    return Prediction(*_unloaded(work))


def correct(model: FilterModel, state: ArrayLike, covariance: ArrayLike, reading: ArrayLike) -> Correction:
    """State and covariance after one sample, and its standardised innovations.

    Args:
        model: filter model.
        state: (12,).
        covariance: (12, 12).
        reading: (5,) specific force x, y [m/s^2], yaw rate [rad/s], encoder right, left [rad/s]; NaN: no sample.

    Raises:
        InputError: wrong shapes.
    """
    z = np.asarray(reading, dtype=np.float64)
    if z.shape != (CHANNEL_SIZE,):
        raise InputError(f"reading has shape {z.shape}: give ({CHANNEL_SIZE},), NaN for a channel without sample.")
    work = _loaded(state, covariance)
    work[READING : READING + CHANNEL_SIZE] = z
    correct_kernel(model.pack(), work, False)
    return Correction(*_unloaded(work), work[STANDARDISED : STANDARDISED + CHANNEL_SIZE].copy())


def gravity_along_body(roll: ArrayLike, pitch: ArrayLike) -> Array:
    """Gravity along body x and y [m/s^2], shape ``roll.shape + (2,)``; (6.3) in z-up axes. Angles in rad."""
    roll, pitch = np.asarray(roll, dtype=np.float64), np.asarray(pitch, dtype=np.float64)
    return STANDARD_GRAVITY * np.stack([np.sin(pitch), -np.sin(roll) * np.cos(pitch)], axis=-1)


def positive_duration(duration: float) -> float:
    """``duration`` [s] as a float; an InputError unless it is positive and finite."""
    if not 0.0 < duration < math.inf:
        raise InputError(f"duration is {duration:g} s: give a positive time.")
    return float(duration)


def _loaded(state: ArrayLike, covariance: ArrayLike) -> Array:
    x, p = np.asarray(state, dtype=np.float64), np.asarray(covariance, dtype=np.float64)
    if x.shape != (STATE_SIZE,) or p.shape != (STATE_SIZE, STATE_SIZE):
        raise InputError(
            f"state and covariance have shapes {x.shape} and {p.shape}: give ({STATE_SIZE},) and "
            f"({STATE_SIZE}, {STATE_SIZE})."
        )
    work = np.zeros(WORK_SIZE)
    work[X : X + STATE_SIZE] = x
    work[P : P + STATE_SIZE * STRIDE].reshape(STATE_SIZE, STRIDE)[:, :STATE_SIZE] = p
    return work


def _unloaded(work: Array) -> tuple[Array, Array]:
    matrix = work[P : P + STATE_SIZE * STRIDE].reshape(STATE_SIZE, STRIDE)[:, :STATE_SIZE]
    return work[X : X + STATE_SIZE].copy(), matrix.copy()
