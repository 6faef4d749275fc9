"""Speed estimates without a filter: the yardsticks that a filter must beat."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.parameters import Robot

Array = NDArray[np.float64]


class PlanarMotion(NamedTuple):
    """Forward speed [m/s] and yaw rate [rad/s]."""

    v_x: Array
    yaw_rate: Array


def encoder_motion(
    robot: Robot, omega_right: ArrayLike, omega_left: ArrayLike, track_factor: float = 1.0
) -> PlanarMotion:
    """Motion of wheels that do not slip forward: encoders alone.

    Args:
        robot: wheel radius and track.
        omega_right: right bank speed [rad/s].
        omega_left: left bank speed [rad/s].
        track_factor: effective over geometric track; 1.3-1.85 on soils (theory: wheel model, section 9).

    Raises:
        InputError: a factor that is not positive.
    """
    if not track_factor > 0.0:
        raise InputError(f"track_factor is {track_factor:g}: give a positive ratio.")
    radius = robot.outer_radius
    right, left = np.asarray(omega_right, dtype=np.float64), np.asarray(omega_left, dtype=np.float64)
    turning = radius * (right - left) / (2.0 * robot.half_track * track_factor)
    return PlanarMotion(0.5 * radius * (right + left), turning)


def symmetric_forward_speed(robot: Robot, yaw_rate: ArrayLike, omega_right: ArrayLike, omega_left: ArrayLike) -> Array:
    """Forward speed [m/s] from gyro and encoders for any soil alike under both banks and without resistance.

    Force balance asks for opposite slips of the banks, ``v_out/A = B/v_in = y`` with ``A = R0 omega_out``,
    ``B = R0 omega_in``; with ``q = v_out - v_in = 2 W |yaw rate|`` follows ``A y^2 - q y - B = 0``:

        y = (q + sqrt(q^2 + 4 A B))/(2 A),   v_x = (A y + B/y)/2.

    Exact for every force law in the slip ratio that is odd in it. NaN where its premise fails: outer bank not
    rolling forward, inner bank rolling backward, no motion. Theory: filter, eq. (11).

    Args:
        robot: wheel radius and track.
        yaw_rate: [rad/s].
        omega_right: right bank speed [rad/s].
        omega_left: left bank speed [rad/s].
    """
    radius = robot.outer_radius
    turning = np.asarray(yaw_rate, dtype=np.float64)
    right, left = radius * np.asarray(omega_right, dtype=np.float64), radius * np.asarray(omega_left, dtype=np.float64)
    outer, inner = np.where(turning >= 0.0, right, left), np.where(turning >= 0.0, left, right)
    q = 2.0 * robot.half_track * np.abs(turning)
    with np.errstate(invalid="ignore", divide="ignore"):
        y = (q + np.sqrt(q * q + 4.0 * outer * inner)) / (2.0 * outer)
        speed = 0.5 * (outer * y + inner / y)
    return np.asarray(np.where((outer > 0.0) & (inner >= 0.0) & (y > 0.0), speed, np.nan))
