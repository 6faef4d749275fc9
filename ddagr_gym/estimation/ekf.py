"""Predict and correct: one robot, one sample, in place on the kernels' workspace (theory: filter, sections 3 to 5).

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

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.estimation.covariance import joseph_update, limit_covariance, propagate
from ddagr_gym.estimation.layout import (
    CHANNEL_SIZE,
    COLUMN,
    DEWEIGHTING,
    ENCODER_CHANNEL,
    EXCITATION,
    EXCITATION_SPEED,
    FORCE_CHANNEL,
    GAIN,
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
    PARAMETER_SIZE,
    PROCESS,
    READING,
    RESPONSE,
    SOIL_COVARIANCE,
    SOIL_RATE,
    STANDARDISED,
    STANDSTILL_SPEED,
    STANDSTILL_VARIANCE,
    STANDSTILL_WHEEL_SPEED,
    STATE_SIZE,
    STRIDE,
    UNKNOWN_COMMAND,
    P,
    X,
)
from ddagr_gym.estimation.measurement_models import entry_column, gyro_column, row_column, specific_force
from ddagr_gym.estimation.process_model import advance_state, body_forces
from ddagr_gym.jit import kernel

Array = NDArray[np.float64]

_ABSURD = 1e12
"""Standardised innovations from here on are no readings: their squares would overflow."""


@kernel()
def limit_state(model: Array, work: Array) -> None:
    """Hold the state inside the model's box."""
    for i in range(STATE_SIZE):
        work[X + i] = min(max(work[X + i], model[LOW + i]), model[HIGH + i])


@kernel(inline=True)
def bank_noise(model: Array, bank: int, lag: float, step: float) -> float:
    """Variance that one step adds to a bank speed that is ``lag`` from its command [rad^2/s^2].

    An uncertain motor rate acts while the bank lags, correlated over about 1/k_omega; a bank without known command
    (``lag`` not finite) wanders.
    """
    if not math.isfinite(lag):
        return step * model[UNKNOWN_COMMAND]
    return step * (model[PROCESS + OMEGA + bank] + 2.0 * model[MOTOR_RATE_VARIANCE] / model[MOTOR_RATE] * lag * lag)


@kernel(inline=True)
def _acceleration_noise(model: Array, rate: float, i: int, j: int, work: Array) -> float:
    """Entry i, j of ``G Q G^T / h``: white acceleration, constant over a step."""
    total = 0.0
    for k in range(3):
        total += work[RESPONSE + STRIDE * i + k] * work[RESPONSE + STRIDE * j + k] * model[PROCESS + k]
    return total * rate


@kernel()
def _step(
    model: Array, work: Array, right: float, left: float, slope_x: float, slope_y: float, step: float
) -> None:  # fmt: skip
    """One step of state and covariance with process noise."""
    lag_right, lag_left = right - work[X + OMEGA], left - work[X + OMEGA + 1]
    decay_right, decay_left = advance_state(model, work, right, left, slope_x, slope_y, step)
    propagate(work, decay_right, decay_left)
    rate = 1.0 / step
    for i in range(3):
        for j in range(3):
            work[P + STRIDE * i + j] += _acceleration_noise(model, rate, i, j, work)
    work[P + (STRIDE + 1) * OMEGA] += bank_noise(model, 0, lag_right, step)
    work[P + (STRIDE + 1) * (OMEGA + 1)] += bank_noise(model, 1, lag_left, step)
    share = step * model[SOIL_RATE]
    for i in range(PARAMETER_SIZE):
        for j in range(PARAMETER_SIZE):
            work[P + STRIDE * (PARAMETER + i) + PARAMETER + j] += (
                share * model[SOIL_COVARIANCE + PARAMETER_SIZE * i + j]
            )
    for i in range(GYRO_BIAS, STATE_SIZE):
        work[P + (STRIDE + 1) * i] += step * model[PROCESS + i]
    limit_state(model, work)


@kernel()
def predict_kernel(
    model: Array, work: Array, right: float, left: float, slope_x: float, slope_y: float, duration: float
) -> None:
    """Advance state and covariance by ``duration`` in equal steps of at most the model's maximum.

    Args:
        model: packed model.
        work: workspace with state and covariance, updated.
        right: speed command of the right bank [rad/s]; not finite: unknown, the bank may drift from its speed.
        left: of the left bank.
        slope_x: gravity along body x [m/s^2].
        slope_y: gravity along body y [m/s^2].
        duration: [s].
    """
    steps = max(math.ceil(duration / model[MAXIMUM_STEP] - 1e-9), 1)
    for _ in range(steps):
        _step(model, work, right, left, slope_x, slope_y, duration / steps)


@kernel(inline=True)
def _weighted_slip(model: Array, rim: float, speed: float) -> float:
    floor = model[EXCITATION_SPEED]
    return (rim - speed) / math.sqrt(max(rim * rim, speed * speed) + floor * floor)


@kernel(inline=True)
def _excited(model: Array, work: Array) -> bool:
    """Whether the banks slip differently enough to tell about the soil."""
    radius, turning = model[OUTER_RADIUS], work[X + 2] * model[HALF_TRACK]
    right = _weighted_slip(model, radius * work[X + OMEGA], work[X] + turning)
    left = _weighted_slip(model, radius * work[X + OMEGA + 1], work[X] - turning)
    return abs(right - left) > model[EXCITATION]


@kernel(inline=True)
def _set_gain(total: float, deweighting: float, learning: float, learn: bool, scaled: bool, work: Array) -> None:
    """Gain of one channel from COLUMN: de-weighted, and only what the channel can teach of the parameters."""
    scale = 1.0 / (total + deweighting)
    for i in range(STATE_SIZE):
        work[GAIN + i] = work[COLUMN + i] * scale
    slower = 1.0 / (total + learning) if learn else 0.0
    for i in range(PARAMETER, PARAMETER + PARAMETER_SIZE):
        work[GAIN + i] = work[COLUMN + i] * slower
    if not scaled:
        common = work[GAIN + PARAMETER]
        work[GAIN + PARAMETER] = 0.0
        work[GAIN + PARAMETER + 2] -= common
        work[GAIN + PARAMETER + 3] -= common


@kernel()
def update(
    model: Array, work: Array, innovation: float, expected: float, variance: float, deweighting: float,
    learning: float, learn: bool, scaled: bool,
) -> float:  # fmt: skip
    """Use one innovation (theory: filter, eq. (8), (9)).

    Args:
        model: packed model.
        work: workspace with P h^T in COLUMN; state and covariance are updated.
        innovation: reading less prediction.
        expected: h P h^T.
        variance: of the reading.
        deweighting: further variance that the gain sees.
        learning: the same for the gain rows of the parameters, instead.
        learn: whether parameters may change.
        scaled: whether the channel tells the common scale of all forces.

    Returns:
        The standardised innovation; NaN where the reading is no number of this world and was not used.
    """
    total = max(expected, 0.0) + variance
    standardised = innovation / math.sqrt(total)
    if not abs(standardised) < _ABSURD:
        return math.nan
    excess = abs(standardised) / model[GATE]
    if excess > 1.0:
        variance += total * (excess - 1.0)
        total *= excess
    _set_gain(total, deweighting, learning, learn, scaled, work)
    for i in range(STATE_SIZE):
        work[X + i] += work[GAIN + i] * innovation
    joseph_update(work, expected, variance)
    return standardised


@kernel()
def _correct_channel(
    model: Array, work: Array, channel: int, predicted: float, expected: float, learn: bool, scaled: bool
) -> None:
    work[STANDARDISED + channel] = update(
        model, work, work[READING + channel] - predicted, expected, model[MEASUREMENT + channel],
        model[DEWEIGHTING + channel], model[LEARNING + channel], learn, scaled,
    )  # fmt: skip


@kernel()
def _hold_still(model: Array, work: Array) -> None:
    """Measure the three velocities as zero."""
    for axis in range(3):
        expected = entry_column(work, axis)
        update(model, work, -work[X + axis], expected, model[STANDSTILL_VARIANCE + axis], 0.0, 0.0, False, False)


@kernel()
def at_rest(model: Array, work: Array, right: float, left: float) -> bool:
    """Whether commands, banks and body are all at rest."""
    wheel, speed = model[STANDSTILL_WHEEL_SPEED], model[STANDSTILL_SPEED]
    commands = max(abs(right), abs(left))
    banks = max(abs(work[X + OMEGA]), abs(work[X + OMEGA + 1]))
    return commands < wheel and banks < wheel and abs(work[X]) < speed and abs(work[X + 1]) < speed


@kernel()
def correct_kernel(model: Array, work: Array, standing: bool) -> None:
    """Use the sample in READING, channel by channel; innovations go to STANDARDISED, NaN without a finite reading.

    Gyro and encoders first: they are linear, and the accelerometer is linearised at what they leave.

    Args:
        model: packed model.
        work: workspace, updated.
        standing: whether the robot is known to stand.
    """
    learn = _excited(model, work)
    for channel in range(CHANNEL_SIZE):
        work[STANDARDISED + channel] = math.nan
    if math.isfinite(work[READING + GYRO_CHANNEL]):
        expected = gyro_column(work)
        _correct_channel(model, work, GYRO_CHANNEL, work[X + 2] + work[X + GYRO_BIAS], expected, learn, False)
    for bank in range(2):
        if math.isfinite(work[READING + ENCODER_CHANNEL + bank]):
            expected = entry_column(work, OMEGA + bank)
            _correct_channel(model, work, ENCODER_CHANNEL + bank, work[X + OMEGA + bank], expected, learn, False)
    for axis in range(2):
        if math.isfinite(work[READING + FORCE_CHANNEL + axis]):
            body_forces(model, work)
            predicted = specific_force(model, work, axis)
            expected = row_column(work)
            _correct_channel(model, work, FORCE_CHANNEL + axis, predicted, expected, learn, True)
    if standing:
        _hold_still(model, work)
    limit_state(model, work)
    limit_covariance(model, work)
