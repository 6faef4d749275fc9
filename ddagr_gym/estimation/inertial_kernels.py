"""Predict and correct of the inertial filter, in place on its workspace (theory: filter, section 9).

The velocities follow the accelerometer, not the force law: what it reads, less its bias, plus gravity, which is a
state that is fixed in the world. The force law is a measurement, every few samples: the wheels' forces by the law are
those that the accelerometer felt since, up to what the law misses. So the blend of both is that of their covariances,
gravity is told from motion, and a soil that changes may move the law's parameters without moving the velocities.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.estimation.ekf import at_rest, bank_noise, limit_state
from ddagr_gym.estimation.inertial_covariance import (
    limit_inertial_covariance,
    propagate_inertial,
)
from ddagr_gym.estimation.inertial_layout import (
    ADDED_LIMIT,
    BALANCE,
    BALANCE_INTERVAL,
    BALANCE_LEARNING,
    FIRST_DURATION,
    GRAVITY,
    GRAVITY_WALK,
    INERTIAL_STATE_SIZE,
    KNOWN_PULL,
    KNOWN_PUSH,
    LARGEST_ACCELERATION,
    LAST_RATE,
    LAUNCH_FLOOR,
    LAUNCH_SLIP,
    LAUNCH_SPEED,
    MEAN_FORCE,
    PATCH_AHEAD,
    PATCH_MEAN,
    PATCH_RATE,
    PATCH_VARIANCE,
    POSE,
    POSE_SIZE,
    PULL_KNOWN,
    SUMMED,
    UNEVEN_DURATION,
    UNKNOWN_ACCELERATION,
    Q,
)
from ddagr_gym.estimation.inertial_pose import add_pose_noise, advance_pose
from ddagr_gym.estimation.inertial_update import (
    entry_column,
    gyro_column,
    row_column,
    use_innovation,
)
from ddagr_gym.estimation.inertial_vibration import reading_deviation, rim_advance, rim_speed, watch_vibration
from ddagr_gym.estimation.layout import (
    ACCELEROMETER_BIAS,
    CHANNEL_SIZE,
    ENCODER_CHANNEL,
    FORCE,
    FORCE_CHANNEL,
    GRADIENT,
    GYRO_BIAS,
    GYRO_CHANNEL,
    IMU_POSITION,
    MEASUREMENT,
    MOTION_SIZE,
    OMEGA,
    OUTER_RADIUS,
    PARAMETER,
    PARAMETER_SIZE,
    PROCESS,
    READING,
    ROW,
    SOIL_COVARIANCE,
    SOIL_RATE,
    STANDARDISED,
    STANDSTILL_VARIANCE,
    STATE_SIZE,
    STRIDE,
    X,
)
from ddagr_gym.estimation.process_model import advance_banks, body_forces, half_decay
from ddagr_gym.jit import kernel

Array = NDArray[np.float64]


@kernel()
def _felt(model: Array, work: Array, axis: int) -> float:
    """Specific force at the body origin [m/s^2], by the sample in READING; of the lever arm the centripetal part."""
    turn = work[X + 2]
    return work[READING + FORCE_CHANNEL + axis] + turn * turn * model[IMU_POSITION + axis]


@kernel()
def _believed(model: Array, work: Array) -> bool:
    """Whether both axes of the accelerometer have a reading that a robot can feel."""
    along = work[READING + FORCE_CHANNEL] - work[X + ACCELEROMETER_BIAS] + work[X + GRAVITY]
    across = work[READING + FORCE_CHANNEL + 1] - work[X + ACCELEROMETER_BIAS + 1] + work[X + GRAVITY + 1]
    return abs(along) < model[LARGEST_ACCELERATION] and abs(across) < model[LARGEST_ACCELERATION]


@kernel()
def _advance(model: Array, work: Array, right: float, left: float, f_x: float, f_y: float, step: float) -> None:
    """One step of state and covariance under a specific force, without process noise."""
    half_right, half_left = half_decay(model, right, step), half_decay(model, left, step)
    kept_right, kept_left = half_right * half_right, half_left * half_left
    advance_banks(work, right, left, kept_right, kept_left)
    angle = step * work[X + 2]
    sine, cosine = math.sin(angle), math.cos(angle)
    along, across = work[X + GRAVITY], work[X + GRAVITY + 1]
    v_x = work[X] + step * (f_x - work[X + ACCELEROMETER_BIAS] + along)
    v_y = work[X + 1] + step * (f_y - work[X + ACCELEROMETER_BIAS + 1] + across)
    work[X], work[X + 1] = cosine * v_x + sine * v_y, cosine * v_y - sine * v_x
    work[X + GRAVITY], work[X + GRAVITY + 1] = cosine * along + sine * across, cosine * across - sine * along
    kept = math.exp(-model[PATCH_RATE] * step)
    work[X + PATCH_AHEAD] = model[PATCH_MEAN] + kept * (work[X + PATCH_AHEAD] - model[PATCH_MEAN])
    propagate_inertial(
        work, (work[X], work[X + 1]), (work[X + GRAVITY], work[X + GRAVITY + 1]), (cosine, sine),
        (kept_right, kept_left, kept), step,
    )  # fmt: skip


@kernel()
def _add_noise(model: Array, work: Array, lag_right: float, lag_left: float, acceleration: float, step: float) -> None:
    for i in range(2):
        work[Q + (STRIDE + 1) * i] += acceleration
        work[Q + (STRIDE + 1) * (GRAVITY + i)] += step * model[GRAVITY_WALK]
    work[Q + (STRIDE + 1) * 2] += step * model[PROCESS + 2]
    work[Q + (STRIDE + 1) * OMEGA] += bank_noise(model, 0, lag_right, step)
    work[Q + (STRIDE + 1) * (OMEGA + 1)] += bank_noise(model, 1, lag_left, step)
    share = step * model[SOIL_RATE]
    for i in range(PARAMETER_SIZE):
        for j in range(PARAMETER_SIZE):
            work[Q + STRIDE * (PARAMETER + i) + PARAMETER + j] += (
                share * model[SOIL_COVARIANCE + PARAMETER_SIZE * i + j]
            )
    for i in range(GYRO_BIAS, STATE_SIZE):
        work[Q + (STRIDE + 1) * i] += step * model[PROCESS + i]
    work[Q + (STRIDE + 1) * PATCH_AHEAD] += model[PATCH_VARIANCE] * (1.0 - math.exp(-2.0 * model[PATCH_RATE] * step))


@kernel()
def _limit(model: Array, work: Array) -> None:
    limit_state(model, work)
    for i in range(INERTIAL_STATE_SIZE - STATE_SIZE):
        high = model[ADDED_LIMIT + i]
        work[X + STATE_SIZE + i] = min(max(work[X + STATE_SIZE + i], -high), high)


@kernel()
def predict_inertial(model: Array, work: Array, right: float, left: float, duration: float) -> None:
    """Advance state and covariance by ``duration`` [s] up to the sample in READING, which says how it accelerated.

    Args:
        model: packed model.
        work: workspace, updated.
        right: speed command of the right bank [rad/s]; not finite: unknown, the bank may drift from its speed.
        left: of the left bank.
        duration: [s].
    """
    before = work[X], work[X + 1], work[X + 2]
    lag_right, lag_left = right - work[X + OMEGA], left - work[X + OMEGA + 1]
    believed = _believed(model, work)
    if believed:
        f_x, f_y = _felt(model, work, 0), _felt(model, work, 1)
        work[MEAN_FORCE] += f_x
        work[MEAN_FORCE + 1] += f_y
        work[SUMMED] += 1.0
        deviation = reading_deviation(model, work, rim_speed(model, work))
        noise = deviation * deviation * duration * duration + model[PROCESS] * duration
    else:
        f_x = work[X + ACCELEROMETER_BIAS] - work[X + GRAVITY]
        f_y = work[X + ACCELEROMETER_BIAS + 1] - work[X + GRAVITY + 1] + work[X + 2] * work[X]
        noise = model[UNKNOWN_ACCELERATION] * duration
    _advance(model, work, right, left, f_x, f_y, duration)
    advance_pose(work, before, duration)
    _add_noise(model, work, lag_right, lag_left, noise, duration)
    add_pose_noise(work, noise, duration * model[PROCESS + 2], duration)
    _limit(model, work)
    watch_vibration(model, work, believed, duration)


@kernel()
def shifted_forces(model: Array, work: Array) -> None:
    """:func:`~process_model.body_forces` with lateral forces ahead of the hubs, and the derivative by that distance."""
    ahead, turn, v_y = work[X + PATCH_AHEAD], work[X + 2], work[X + 1]
    work[X + 1] = v_y + ahead * turn
    body_forces(model, work)
    work[X + 1] = v_y
    for i in range(3):
        base = GRADIENT + STRIDE * i
        for j in range(MOTION_SIZE, STRIDE):
            work[base + j] = 0.0
        work[base + PATCH_AHEAD] = turn * work[base + 1]
        work[base + 2] += ahead * work[base + 1]


@kernel()
def balance_forces(model: Array, work: Array, duration: float) -> None:
    """Measure that the wheels' forces are those that were felt since the last time (``duration`` [s] ago)."""
    count = work[SUMMED]
    turned = (work[X + 2] - work[LAST_RATE]) / duration
    for axis in range(3):
        if axis < 2 and count == 0.0:
            continue
        shifted_forces(model, work)
        for j in range(STRIDE):
            work[ROW + j] = work[GRADIENT + STRIDE * axis + j]
        felt = turned
        if axis < 2:
            work[ROW + ACCELEROMETER_BIAS + axis] = 1.0
            felt = work[MEAN_FORCE + axis] / count - work[X + ACCELEROMETER_BIAS + axis]
        innovation = felt - work[KNOWN_PUSH + axis] - work[FORCE + axis]
        variance = model[BALANCE + axis]
        use_innovation(model, work, innovation, row_column(work), variance, model[BALANCE_LEARNING])
    work[MEAN_FORCE] = work[MEAN_FORCE + 1] = work[SUMMED] = 0.0
    work[LAST_RATE] = work[X + 2]


@kernel()
def _hold_slip(model: Array, work: Array, speed: float) -> float:
    """Measure that the robot goes at a mean rim speed [m/s] with little slip; returns the deviation of it [m/s]."""
    deviation = model[LAUNCH_FLOOR] + model[LAUNCH_SLIP] * abs(speed)
    half = 0.5 * model[OUTER_RADIUS]
    for j in range(STRIDE):
        work[ROW + j] = 0.0
    work[ROW] = 1.0
    work[ROW + OMEGA] = work[ROW + OMEGA + 1] = -half
    use_innovation(model, work, speed - work[X], row_column(work), deviation * deviation)
    return deviation


@kernel()
def _roll(model: Array, work: Array, speed: float) -> None:
    """Measure that the robot rolls with little slip at a mean rim speed [m/s]: the law's forces are stiff near rest."""
    deviation = _hold_slip(model, work, speed)
    use_innovation(model, work, -work[X + 1], entry_column(work, 1), deviation * deviation)
    work[MEAN_FORCE] = work[MEAN_FORCE + 1] = work[SUMMED] = 0.0
    work[LAST_RATE] = work[X + 2]


@kernel(inline=True)
def _pull_known(model: Array, work: Array) -> bool:
    """Whether gravity along the robot, less the accelerometer's bias, has been known since it stood or drove off."""
    pull, bias = Q + STRIDE * GRAVITY, Q + STRIDE * ACCELEROMETER_BIAS
    variance = work[pull + GRAVITY] + work[bias + ACCELEROMETER_BIAS] - 2.0 * work[pull + ACCELEROMETER_BIAS]
    if variance < model[KNOWN_PULL]:
        work[PULL_KNOWN] = 1.0
    return work[PULL_KNOWN] > 0.0


@kernel()
def correct_inertial(model: Array, work: Array, standing: bool) -> None:
    """Use gyro and encoders of the sample in READING; innovations go to STANDARDISED, NaN where there are none.

    Args:
        model: packed model.
        work: workspace, updated.
        standing: whether the robot is known to stand.
    """
    for channel in range(CHANNEL_SIZE):
        work[STANDARDISED + channel] = math.nan
    if math.isfinite(work[READING + GYRO_CHANNEL]):
        innovation = work[READING + GYRO_CHANNEL] - work[X + 2] - work[X + GYRO_BIAS]
        work[STANDARDISED + GYRO_CHANNEL] = use_innovation(
            model, work, innovation, gyro_column(work), model[MEASUREMENT + GYRO_CHANNEL]
        )
    for bank in range(2):
        channel = ENCODER_CHANNEL + bank
        if math.isfinite(work[READING + channel]):
            innovation = work[READING + channel] - work[X + OMEGA + bank]
            expected = entry_column(work, OMEGA + bank)
            work[STANDARDISED + channel] = use_innovation(
                model, work, innovation, expected, model[MEASUREMENT + channel]
            )
    if standing:
        for axis in range(3):
            use_innovation(model, work, -work[X + axis], entry_column(work, axis), model[STANDSTILL_VARIANCE + axis])


@kernel(inline=True)
def since_balance(work: Array, place: int, interval: int, duration: float) -> float:
    """Time since the last balance [s]; of even samples to the bit so many times their duration.

    Args:
        work: workspace, updated.
        place: of the sample since the last balance, from 1.
        interval: samples from balance to balance.
        duration: of the sample [s].
    """
    if place == 1:
        work[FIRST_DURATION] = duration
        work[UNEVEN_DURATION] = 0.0
    work[UNEVEN_DURATION] += duration - work[FIRST_DURATION]
    return interval * work[FIRST_DURATION] + work[UNEVEN_DURATION]


@kernel()
def inertial_sample(
    model: Array, work: Array, command: Array, reading: Array, number: int, duration: float, standardised: Array
) -> None:
    """Predict up to one sample and correct by it.

    Args:
        model: packed model.
        work: workspace, updated.
        command: (2,) [rad/s].
        reading: (5,).
        number: of the sample since the start, from 1; sets when forces are balanced.
        duration: since the sample before [s].
        standardised: (5,) innovations, written.
    """
    for channel in range(CHANNEL_SIZE):
        work[READING + channel] = reading[channel]
    predict_inertial(model, work, command[0], command[1], duration)
    correct_inertial(model, work, at_rest(model, work, command[0], command[1]))
    interval = int(model[BALANCE_INTERVAL])
    since = since_balance(work, 1 + (number - 1) % interval, interval, duration)
    if number % interval == 0:
        speed = rim_advance(model, work)
        known = _pull_known(model, work)
        if abs(speed) < model[LAUNCH_SPEED]:
            _roll(model, work, speed)
        else:
            balance_forces(model, work, since)
            if not known:
                _hold_slip(model, work, speed)
    _limit(model, work)
    limit_inertial_covariance(model, work)
    for channel in range(CHANNEL_SIZE):
        standardised[channel] = work[STANDARDISED + channel]


@kernel()
def inertial_series(
    model: Array, first: int, commands: Array, readings: Array, durations: Array, states: Array, poses: Array,
    standardised: Array, work: Array,
) -> None:  # fmt: skip
    """One robot through a series, from the state and covariance in its workspace.

    Args:
        model: packed model.
        first: samples seen before.
        commands: (T or 1, 2) [rad/s]; a single one for all samples.
        readings: (T, 5).
        durations: (T or 1,) since the sample before [s].
        states: (T, 15), written.
        poses: (T, 12) pose and its covariance by rows, written.
        standardised: (T, 5), written.
        work: (WORK_SIZE,), updated.
    """
    for k in range(readings.shape[0]):
        inertial_sample(
            model, work, commands[min(k, commands.shape[0] - 1)], readings[k], first + k + 1,
            durations[min(k, durations.shape[0] - 1)], standardised[k],
        )  # fmt: skip
        for i in range(INERTIAL_STATE_SIZE):
            states[k, i] = work[X + i]
        for i in range(POSE_SIZE * (POSE_SIZE + 1)):
            poses[k, i] = work[POSE + i]


@kernel()
def inertial_rows(
    model: Array, counts: NDArray[np.int64], commands: Array, readings: Array, duration: float, standardised: Array,
    works: Array,
) -> None:  # fmt: skip
    """Every robot through all its samples.

    Args:
        model: packed model.
        counts: (N,) samples seen, updated.
        commands: (N, 2) [rad/s].
        readings: (N, K, 5).
        duration: between samples [s].
        standardised: (N, K, 5), written.
        works: (N, WORK_SIZE), updated.
    """
    for n in range(readings.shape[0]):
        for k in range(readings.shape[1]):
            counts[n] += 1
            inertial_sample(model, works[n], commands[n], readings[n, k], counts[n], duration, standardised[n, k])
