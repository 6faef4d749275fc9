"""Accelerometer and gyro. The accelerometer feels specific force: no gravity on the flat, none in its model (5.5).

It reads the mean over the sample period, as a device with a digital low-pass filter does. The instantaneous force at
a sample would be ill-conditioned where the robot creeps to rest: there force over speed exceeds 1e4 1/s.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import kernel
from ddagr_gym.parameters import STANDARD_GRAVITY
from ddagr_gym.physics.layout import (
    ACCELEROMETER_BIAS,
    ACCELEROMETER_NOISE,
    ACCELEROMETER_RANGE,
    ACCELEROMETER_RESOLUTION,
    ACCELEROMETER_SCALE,
    ACCELEROMETER_VIBRATION,
    FELT_DEPTH,
    GYRO_BIAS,
    GYRO_NOISE,
    GYRO_RANGE,
    GYRO_RESOLUTION,
    GYRO_SCALE,
    HALF_TRACK,
    HALF_WHEELBASE,
    IMU_MOUNTING_YAW,
    IMU_POSITION,
    MEAN_SPECIFIC_FORCE,
    MEAN_YAW_ACCELERATION,
    READING,
    SINKAGE,
    SINKAGE_TILT,
    V_X,
    V_Y,
    YAW_RATE,
)


@kernel(inline=True)
def digitise(value: float, resolution: float, limit: float) -> float:
    """Nearest multiple of ``resolution`` (0: none) inside +-limit."""
    if resolution > 0.0:
        value = math.floor(value / resolution + 0.5) * resolution
    return min(max(value, -limit), limit)


@kernel(inline=True)
def gravity_of_lean(
    right_front: float, left_front: float, right_rear: float, left_rear: float,
    half_wheelbase: float, half_track: float,
) -> tuple[float, float]:  # fmt: skip
    """Gravity [m/s^2] along x and y of a body whose wheels stand at these depths [m]: it leans to the deeper ones.

    Theory: wheel model, eq. (35a); heights in place of depths give what the accelerometer reads.
    """
    nose_down = (right_front + left_front - right_rear - left_rear) / (4.0 * half_wheelbase)
    left_down = (left_front + left_rear - right_front - right_rear) / (4.0 * half_track)
    return STANDARD_GRAVITY * nose_down, STANDARD_GRAVITY * left_down


@kernel(inline=True)
def gravity_by_sinkage(row: NDArray[np.float64]) -> tuple[float, float]:
    """Gravity along x and y [m/s^2] of a body that leans as its sinkages say, as far as it is felt."""
    along_x, along_y = gravity_of_lean(
        row[FELT_DEPTH] * row[SINKAGE], row[FELT_DEPTH + 1] * row[SINKAGE + 1],
        row[FELT_DEPTH + 2] * row[SINKAGE + 2], row[FELT_DEPTH + 3] * row[SINKAGE + 3],
        row[HALF_WHEELBASE], row[HALF_TRACK],
    )  # fmt: skip
    return row[SINKAGE_TILT] * along_x, row[SINKAGE_TILT] * along_y


@kernel()
def read_imu(row: NDArray[np.float64], noise: NDArray[np.float64]) -> None:
    """Write READING[0:3]. ``noise``: standard normal draws for specific force x, y and yaw rate.

    Theory: wheel model, eq. (35).
    """
    rate = row[YAW_RATE]
    turn = row[MEAN_YAW_ACCELERATION]
    x = row[IMU_POSITION]
    y = row[IMU_POSITION + 1]
    force_x = row[MEAN_SPECIFIC_FORCE] - turn * y - rate * rate * x
    force_y = row[MEAN_SPECIFIC_FORCE + 1] + turn * x - rate * rate * y
    if row[SINKAGE_TILT] != 0.0:
        along_x, along_y = gravity_by_sinkage(row)
        force_x -= along_x
        force_y -= along_y
    cosine = math.cos(row[IMU_MOUNTING_YAW])
    sine = math.sin(row[IMU_MOUNTING_YAW])
    speed = math.sqrt(row[V_X] * row[V_X] + row[V_Y] * row[V_Y])
    deviation = row[ACCELEROMETER_NOISE] + row[ACCELEROMETER_VIBRATION] * speed
    along = row[ACCELEROMETER_SCALE] * (cosine * force_x + sine * force_y) + row[ACCELEROMETER_BIAS]
    across = row[ACCELEROMETER_SCALE + 1] * (cosine * force_y - sine * force_x) + row[ACCELEROMETER_BIAS + 1]
    turning = row[GYRO_SCALE] * rate + row[GYRO_BIAS] + row[GYRO_NOISE] * noise[2]
    resolution = row[ACCELEROMETER_RESOLUTION]
    limit = row[ACCELEROMETER_RANGE]
    row[READING] = digitise(along + deviation * noise[0], resolution, limit)
    row[READING + 1] = digitise(across + deviation * noise[1], resolution, limit)
    row[READING + 2] = digitise(turning, row[GYRO_RESOLUTION], row[GYRO_RANGE])
