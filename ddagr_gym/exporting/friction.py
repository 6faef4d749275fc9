"""Sliding friction by direction with which a robot on rigid wheels turns as ours does on its soil."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from ddagr_gym.parameters import STANDARD_GRAVITY

Array = NDArray[np.float64]

_SOFTENING = 1e-3
"""Of the sliding speed over the rim speed, so that friction has a derivative at rest (ours)."""

_WIDEST = 5.0
"""Largest logarithm of a friction and of the ratio of both."""

_TOLERANCE = 1e-6
"""Largest imbalance of forces and moment over load at which the friction is found [-]."""


def sliding_forces(
    sliding_x: Array, sliding_y: Array, load: Array, ratio: float, rim_speed: float
) -> tuple[Array, Array]:
    """Forces on wheels that slide, by an elliptic cone with friction 1 along the wheel.

    ``(F_x, F_y) = -N (s_x, ratio^2 s_y) / sqrt(s_x^2 + ratio^2 s_y^2)``: of all forces inside the ellipse
    ``F_x^2 + (F_y/ratio)^2 <= N^2`` the one that takes the most power (maximum dissipation; Goyal, Ruina and
    Papadopoulos, Wear 143 (1991) 307), as MuJoCo's elliptic cone has it.

    Args:
        sliding_x: (4,) velocity of the contact along the wheel [m/s].
        sliding_y: (4,) across [m/s].
        load: (4,) [N].
        ratio: friction across over friction along [-].
        rim_speed: that the softening refers to [m/s].
    """
    size = np.sqrt(sliding_x**2 + (ratio * sliding_y) ** 2 + (_SOFTENING * rim_speed) ** 2)
    return -load * sliding_x / size, -load * ratio**2 * sliding_y / size


def friction_of_turn(
    wheel_x: Array, wheel_y: Array, load: Array, rim: Array, yaw_rate: float, along: float
) -> tuple[float, float]:
    """Friction along and across the wheels with which a steady turn has a given yaw rate.

    Forces and moment balance the centripetal force for unknown velocities and frictions ``(v_x, v_y, mu_x, mu_y)``:
    ``sum F_x = -m r v_y``, ``sum F_y = m r v_x``, ``sum (x F_y - y F_x) = 0``, ``sum |F_x| = along sum N``.

    Args:
        wheel_x: (4,) positions forward of the centre of mass [m].
        wheel_y: (4,) to the left of it [m].
        load: (4,) [N].
        rim: (4,) rim speeds by the rolling radius [m/s].
        yaw_rate: that the turn has [rad/s].
        along: sum of the absolute forces along the wheels over the load that the turn has [-].

    Returns:
        Friction along and across [-]; NaN where none turns so, as for an effective track below the geometric one.
    """
    fast, total = float(np.abs(rim).max()), float(load.sum())
    mass, reach = total / STANDARD_GRAVITY, float(np.abs(wheel_y).max())

    def imbalance(unknown: Array) -> Array:
        v_x, v_y = fast * unknown[0], fast * unknown[1]
        ratio, size = np.exp(np.clip(unknown[2:], -_WIDEST, _WIDEST))
        f_x, f_y = sliding_forces(v_x - yaw_rate * wheel_y - rim, v_y + yaw_rate * wheel_x, size * load, ratio, fast)
        moment = (wheel_x * f_y - wheel_y * f_x).sum() / reach
        sums = (f_x.sum() + mass * yaw_rate * v_y, f_y.sum() - mass * yaw_rate * v_x, moment)
        return np.array([*sums, np.abs(f_x).sum() - along * total]) / total

    start = [float(rim.mean()) / fast, 0.0, 0.0, math.log(max(2.0 * along, 1e-3))]
    solved = root(imbalance, start, method="hybr", tol=1e-10)
    if np.abs(imbalance(solved.x)).max() > _TOLERANCE or np.abs(solved.x[2:]).max() >= _WIDEST:
        return math.nan, math.nan
    ratio, size = np.exp(solved.x[2:])
    return float(size), float(size * ratio)
