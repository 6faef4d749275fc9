"""Predict and correct: one robot, one sample, in place.

The Python functions :func:`predict` and :func:`correct` are pure; the kernels behind them are what the filters run.

Ours, beyond the textbook:

- *De-weighting.* A gain may see more noise than the reading has. The covariance follows by the Joseph form with the
  noise it has, so that the filter stays consistent with any gain; it merely uses less of the channel. The accelerometer
  is de-weighted as a whole: fully trusted it is a slip sensor of millimetres whose scale is the unknown soil. The
  gain rows of the parameters are de-weighted in all channels: one turn fixes one combination of them so
  sharply that the curvature of that combination, which a Kalman filter does not know, breaks the covariance.
- *Consider update* (Schmidt). Unless the two banks slip differently by more than ``excitation``, the gain rows of the
  parameters are zero: a straight teaches nothing about soil, and the covariance stays. Gyro and encoders never
  change the common scale of a1, b and Rc either: a motion of given velocities is the same at twice all forces but for
  inertia, which lasts milliseconds. The scale is left to the accelerometer.
- *Gate.* A reading beyond ``gate`` standard deviations is taken as noisier, by ``|nu|/gate`` in variance, so that it
  moves the state as far as one at the gate does (Huber's influence): outliers cannot throw the filter, and a
  filter that is wrong still gets back.
- *Standstill.* With commands and wheels at rest the velocities are measured as zero, which teaches the gyro's bias.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.estimation.covariance import joseph_update, limit_covariance, propagate
from ddagr_gym.estimation.filter_model import FilterModel
from ddagr_gym.estimation.layout import (
    CHANNEL_SIZE,
    COLUMN_ROW,
    DEWEIGHTING,
    ENCODER_CHANNEL,
    EXCITATION,
    EXCITATION_SPEED,
    FORCE_CHANNEL,
    GAIN_ROW,
    GATE,
    GYRO_BIAS,
    GYRO_CHANNEL,
    HALF_TRACK,
    HIGH,
    LEARNING,
    LOW,
    MAXIMUM_STEP,
    MEASUREMENT,
    MOTOR_RATE,
    MOTOR_RATE_VARIANCE,
    OMEGA,
    OUTER_RADIUS,
    PARAMETER,
    PROCESS,
    PRODUCT_ROW,
    ROW_ROW,
    SCRATCH_ROWS,
    SOIL_AGITATION,
    SOIL_COVARIANCE,
    SOIL_RATE,
    STANDSTILL_SPEED,
    STANDSTILL_VARIANCE,
    STANDSTILL_WHEEL_SPEED,
    STATE_SIZE,
)
from ddagr_gym.estimation.measurement_models import specific_force
from ddagr_gym.estimation.process_model import advance_state, body_forces
from ddagr_gym.jit import kernel
from ddagr_gym.parameters import STANDARD_GRAVITY

Array = NDArray[np.float64]

_PARAMETERS = 4


@kernel()
def _limit_state(model: Array, state: Array) -> None:
    for i in range(STATE_SIZE):
        state[i] = min(max(state[i], model[LOW + i]), model[HIGH + i])


@kernel(inline=True)
def step_noise(
    model: Array, lag_right: float, lag_left: float, bank_decay: float, step: float
) -> tuple[float, float, float]:
    """Variances that one step adds to the bank speeds [rad^2/s^2], and the share of the prior it adds to the logs.

    An uncertain motor rate acts while a bank lags behind its command, correlated over about 1/k_omega.
    """
    motor = 2.0 * step * model[MOTOR_RATE_VARIANCE] / model[MOTOR_RATE]
    change = (1.0 - bank_decay) * model[OUTER_RADIUS] * (abs(lag_right) + abs(lag_left))
    return (
        step * model[PROCESS + OMEGA] + motor * lag_right * lag_right,
        step * model[PROCESS + OMEGA + 1] + motor * lag_left * lag_left,
        step * model[SOIL_RATE] + change * model[SOIL_AGITATION],
    )


@kernel()
def _step(
    model: Array, state: Array, covariance: Array, right: float, left: float, slope_x: float, slope_y: float,
    step: float, scratch: Array,
) -> None:  # fmt: skip
    """One step of state and covariance with process noise."""
    lag_right, lag_left = right - state[OMEGA], left - state[OMEGA + 1]
    bank_decay = advance_state(model, state, right, left, slope_x, slope_y, step, scratch)
    g = scratch[PRODUCT_ROW : PRODUCT_ROW + 3]
    noise = model[PROCESS : PROCESS + STATE_SIZE]
    q_x, q_y, q_turn = noise[0] / step, noise[1] / step, noise[2] / step
    n00 = g[0, 0] * g[0, 0] * q_x + g[0, 1] * g[0, 1] * q_y + g[0, 2] * g[0, 2] * q_turn
    n01 = g[0, 0] * g[1, 0] * q_x + g[0, 1] * g[1, 1] * q_y + g[0, 2] * g[1, 2] * q_turn
    n02 = g[0, 0] * g[2, 0] * q_x + g[0, 1] * g[2, 1] * q_y + g[0, 2] * g[2, 2] * q_turn
    n11 = g[1, 0] * g[1, 0] * q_x + g[1, 1] * g[1, 1] * q_y + g[1, 2] * g[1, 2] * q_turn
    n12 = g[1, 0] * g[2, 0] * q_x + g[1, 1] * g[2, 1] * q_y + g[1, 2] * g[2, 2] * q_turn
    n22 = g[2, 0] * g[2, 0] * q_x + g[2, 1] * g[2, 1] * q_y + g[2, 2] * g[2, 2] * q_turn
    propagate(covariance, bank_decay, scratch)
    covariance[0, 0] += n00
    covariance[1, 1] += n11
    covariance[2, 2] += n22
    covariance[0, 1] += n01
    covariance[1, 0] += n01
    covariance[0, 2] += n02
    covariance[2, 0] += n02
    covariance[1, 2] += n12
    covariance[2, 1] += n12
    right_variance, left_variance, share = step_noise(model, lag_right, lag_left, bank_decay, step)
    covariance[OMEGA, OMEGA] += right_variance
    covariance[OMEGA + 1, OMEGA + 1] += left_variance
    for i in range(_PARAMETERS):
        for j in range(_PARAMETERS):
            covariance[PARAMETER + i, PARAMETER + j] += share * model[SOIL_COVARIANCE + _PARAMETERS * i + j]
    for i in range(GYRO_BIAS, STATE_SIZE):
        covariance[i, i] += step * noise[i]
    _limit_state(model, state)


@kernel()
def predict_kernel(
    model: Array, state: Array, covariance: Array, right: float, left: float, slope_x: float, slope_y: float,
    duration: float, scratch: Array,
) -> None:  # fmt: skip
    """Advance state and covariance by ``duration`` in equal steps of at most the model's maximum."""
    steps = max(math.ceil(duration / model[MAXIMUM_STEP] - 1e-9), 1)
    command_right = right if math.isfinite(right) else state[OMEGA]
    command_left = left if math.isfinite(left) else state[OMEGA + 1]
    for _ in range(steps):
        _step(
            model, state, covariance, command_right, command_left, slope_x, slope_y, duration / steps, scratch
        )  # fmt: skip


@kernel()
def _excited(model: Array, state: Array) -> bool:
    """Whether the banks slip differently enough to tell about the soil."""
    radius, turning = model[OUTER_RADIUS], state[2] * model[HALF_TRACK]
    rest = model[EXCITATION_SPEED]
    rim, speed = radius * state[OMEGA], state[0] + turning
    right = (rim - speed) / math.sqrt(max(rim * rim, speed * speed) + rest * rest)
    rim, speed = radius * state[OMEGA + 1], state[0] - turning
    left = (rim - speed) / math.sqrt(max(rim * rim, speed * speed) + rest * rest)
    return abs(right - left) > model[EXCITATION]


@kernel()
def _update(
    model: Array, state: Array, covariance: Array, innovation: float, expected: float, variance: float,
    deweighting: float, learning: float, learn: bool, scaled: bool, scratch: Array,
) -> float:  # fmt: skip
    """Use one innovation.

    Args:
        model: packed model.
        state: (12,), updated.
        covariance: (12, 12), updated.
        innovation: reading less prediction.
        expected: h P h^T; COLUMN_ROW of ``scratch`` holds P h^T.
        variance: of the reading.
        deweighting: further variance that the gain sees.
        learning: the same for the gain rows of the parameters, instead.
        learn: whether parameters may change.
        scaled: whether the channel tells the common scale of all forces.
        scratch: of the kernels.

    Returns:
        The standardised innovation.
    """
    total = max(expected, 0.0) + variance
    standardised = innovation / math.sqrt(total)
    excess = abs(standardised) / model[GATE]
    if excess > 1.0:
        variance += total * (excess - 1.0)
        total *= excess
    gain, column = scratch[GAIN_ROW], scratch[COLUMN_ROW]
    scale = 1.0 / (total + deweighting)
    for i in range(STATE_SIZE):
        gain[i] = column[i] * scale
    for i in range(PARAMETER, PARAMETER + _PARAMETERS):
        gain[i] = column[i] / (total + learning) if learn else 0.0
    if learn and not scaled:
        common = gain[PARAMETER]
        gain[PARAMETER] = 0.0
        gain[PARAMETER + 2] -= common
        gain[PARAMETER + 3] -= common
    for i in range(STATE_SIZE):
        state[i] += gain[i] * innovation
    joseph_update(covariance, expected, variance, scratch)
    return standardised


@kernel()
def _hold_still(model: Array, state: Array, covariance: Array, scratch: Array) -> None:
    """Measure the three velocities as zero."""
    column = scratch[COLUMN_ROW]
    for axis in range(3):
        for i in range(STATE_SIZE):
            column[i] = covariance[axis, i]
        _update(
            model,
            state,
            covariance,
            -state[axis],
            column[axis],
            model[STANDSTILL_VARIANCE + axis],
            0.0,
            0.0,
            False,
            False,
            scratch,
        )


@kernel()
def at_rest(model: Array, state: Array, right: float, left: float) -> bool:
    """Whether commands, banks and body are all at rest."""
    wheel, speed = model[STANDSTILL_WHEEL_SPEED], model[STANDSTILL_SPEED]
    commands = max(abs(right), abs(left))
    banks = max(abs(state[OMEGA]), abs(state[OMEGA + 1]))
    return commands < wheel and banks < wheel and abs(state[0]) < speed and abs(state[1]) < speed


@kernel()
def correct_kernel(
    model: Array, state: Array, covariance: Array, reading: Array, standardised: Array, standing: bool, scratch: Array
) -> None:
    """Use one sample, channel by channel, all linearised at the predicted state; see :func:`correct`."""
    learn = _excited(model, state)
    row, column = scratch[ROW_ROW], scratch[COLUMN_ROW]
    for channel in range(CHANNEL_SIZE):
        standardised[channel] = math.nan
    if math.isfinite(reading[GYRO_CHANNEL]):
        for i in range(STATE_SIZE):
            column[i] = covariance[2, i] + covariance[GYRO_BIAS, i]
        standardised[GYRO_CHANNEL] = _update(
            model, state, covariance, reading[GYRO_CHANNEL] - state[2] - state[GYRO_BIAS],
            column[2] + column[GYRO_BIAS], model[MEASUREMENT + GYRO_CHANNEL], model[DEWEIGHTING + GYRO_CHANNEL],
            model[LEARNING + GYRO_CHANNEL], learn, False, scratch,
        )  # fmt: skip
    for bank in range(2):
        channel = ENCODER_CHANNEL + bank
        if math.isfinite(reading[channel]):
            for i in range(STATE_SIZE):
                column[i] = covariance[OMEGA + bank, i]
            standardised[channel] = _update(
                model, state, covariance, reading[channel] - state[OMEGA + bank], column[OMEGA + bank],
                model[MEASUREMENT + channel], model[DEWEIGHTING + channel], model[LEARNING + channel], learn, False,
                scratch,
            )  # fmt: skip
    for axis in range(2):
        channel = FORCE_CHANNEL + axis
        if math.isfinite(reading[channel]):
            body_forces(model, state, scratch)
            predicted = specific_force(model, state, axis, scratch)
            expected = 0.0
            for i in range(STATE_SIZE):
                total = 0.0
                for j in range(STATE_SIZE):
                    total += covariance[i, j] * row[j]
                column[i] = total
                expected += total * row[i]
            standardised[channel] = _update(
                model, state, covariance, reading[channel] - predicted, expected, model[MEASUREMENT + channel],
                model[DEWEIGHTING + channel], model[LEARNING + channel], learn, True, scratch,
            )  # fmt: skip
    if standing:
        _hold_still(model, state, covariance, scratch)
    _limit_state(model, state)
    limit_covariance(model, covariance)


class Prediction(NamedTuple):
    """State (12,) and covariance (12, 12)."""

    state: Array
    covariance: Array


class Correction(NamedTuple):
    """State (12,), covariance (12, 12) and standardised innovations (5,), NaN where there was no reading."""

    state: Array
    covariance: Array
    standardised: Array

    @property
    def normalised_squared(self) -> Array:
        """Contribution of each channel to the NIS, (5,)."""
        return self.standardised**2


def predict(
    model: FilterModel,
    state: ArrayLike,
    covariance: ArrayLike,
    command: tuple[float, float],
    duration: float | None = None,
    attitude: tuple[float, float] = (0.0, 0.0),
) -> Prediction:
    """State and covariance after driving by one command. Pure.

    Args:
        model: filter model.
        state: (12,), see :mod:`ddagr_gym.estimation`.
        covariance: (12, 12).
        command: speed commands of the right and left bank [rad/s]; NaN holds the bank's speed.
        duration: [s]; the model's sample period by default.
        attitude: roll and pitch [rad], REP 103: roll right side down, pitch nose down positive.

    Raises:
        InputError: wrong shapes, or a duration that is not positive.
    """
    x, p = _checked(state, covariance)
    time = model.sample_period if duration is None else float(duration)
    if not 0.0 < time < math.inf:
        raise InputError(f"duration is {time:g} s: give a positive time.")
    slope = gravity_along_body(*attitude)
    scratch = np.zeros((SCRATCH_ROWS, STATE_SIZE))
    predict_kernel(model.pack(), x, p, command[0], command[1], float(slope[0]), float(slope[1]), time, scratch)
    return Prediction(x, p)


def correct(model: FilterModel, state: ArrayLike, covariance: ArrayLike, reading: ArrayLike) -> Correction:
    """State and covariance after one sample, and its standardised innovations. Pure.

    Args:
        model: filter model.
        state: (12,).
        covariance: (12, 12).
        reading: (5,) specific force x, y [m/s^2], yaw rate [rad/s], encoder right, left [rad/s]; NaN: no sample.

    Raises:
        InputError: wrong shapes.
    """
    x, p = _checked(state, covariance)
    z = np.array(reading, dtype=np.float64)
    if z.shape != (CHANNEL_SIZE,):
        raise InputError(f"reading has shape {z.shape}: give ({CHANNEL_SIZE},), NaN for a channel without sample.")
    standardised = np.empty(CHANNEL_SIZE)
    correct_kernel(model.pack(), x, p, z, standardised, False, np.zeros((SCRATCH_ROWS, STATE_SIZE)))
    return Correction(x, p, standardised)


def gravity_along_body(roll: ArrayLike, pitch: ArrayLike) -> Array:
    """Gravity along body x and y [m/s^2], shape ``roll.shape + (2,)``; (6.3) in z-up axes."""
    roll, pitch = np.asarray(roll, dtype=np.float64), np.asarray(pitch, dtype=np.float64)
    return STANDARD_GRAVITY * np.stack([np.sin(pitch), -np.sin(roll) * np.cos(pitch)], axis=-1)


def _checked(state: ArrayLike, covariance: ArrayLike) -> tuple[Array, Array]:
    x, p = np.array(state, dtype=np.float64), np.array(covariance, dtype=np.float64)
    if x.shape != (STATE_SIZE,) or p.shape != (STATE_SIZE, STATE_SIZE):
        raise InputError(
            f"state and covariance have shapes {x.shape} and {p.shape}: give ({STATE_SIZE},) and "
            f"({STATE_SIZE}, {STATE_SIZE})."
        )
    return x, p
