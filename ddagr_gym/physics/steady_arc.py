"""Bank speeds of a steady arc by the simulator's own soil, for the upper bound that knows it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.parameters import STANDARD_GRAVITY, Robot, Soil
from ddagr_gym.physics.layout import SOIL_PARAMETERS
from ddagr_gym.physics.wheel_forces import equilibrium_sinkage, wheel_force

Array = NDArray[np.float64]

_ITERATIONS = 12  # of a damped Newton search (ours): each bank may move a third of the speed a step, four speeds in all
_TOLERANCE = 2e-3
"""Largest imbalance over the robot's weight at which the arc counts as steady [-]."""


def soil_of(vector: Array) -> Soil:
    """Soil from nine parameters in the order of ``layout.SOIL_PARAMETERS``."""
    values = dict(zip(SOIL_PARAMETERS, map(float, vector), strict=True))
    return Soil(friction_angle=math.atan(values.pop("friction_tangent")), **values)


def _imbalance(robot: Robot, soil: Soil, unknown: Array, speed: float, rate: float) -> Array:
    """Sums of F_x, F_y, M_z/W over weight less what the arc needs, (K, 3) for rim speeds and v_y ``unknown`` (K, 3)."""
    x, y = np.array(robot.wheel_x), np.array(robot.wheel_y)
    wheel, weight = robot.wheels[0], robot.mass * STANDARD_GRAVITY
    v_x = np.broadcast_to(speed - rate * y, (len(unknown), 4))
    v_y = unknown[:, 2:3] + rate * x
    omega = np.where(y < 0.0, unknown[:, 0:1], unknown[:, 1:2]) / wheel.outer_radius
    sinkage, _ = equilibrium_sinkage(wheel, soil, v_x, v_y, omega, rate, weight / 4.0)
    found = wheel_force(wheel, soil, v_x, v_y, omega, rate, np.minimum(sinkage, wheel.minor_radius))
    f_x, f_y = found.force[..., 0], found.force[..., 1]
    moment = (x * f_y - y * f_x + found.yaw_moment).sum(axis=1)
    along = f_x.sum(axis=1) + robot.mass * rate * unknown[:, 2]
    across = f_y.sum(axis=1) - robot.mass * rate * speed
    return np.column_stack([along, across, moment / robot.half_track]) / weight


def steady_bank_speeds(robot: Robot, soil: Soil, speed: float, curvature: float) -> tuple[float, float] | None:
    """Right and left bank speeds [rad/s] of a steady arc on a soil, or None where it carries none within the limits.

    Args:
        robot: the robot.
        soil: under all wheels.
        speed: v_x [m/s].
        curvature: yaw rate over speed [1/m].
    """
    rate, radius = speed * curvature, robot.wheels[0].outer_radius
    spread = 1.4 * robot.half_track * curvature
    unknown = np.array([1.1 * speed * (1.0 + spread), 1.1 * speed * (1.0 - spread), 0.0])
    limit = robot.maximum_wheel_speed * radius
    for _ in range(_ITERATIONS):
        shifts = 1e-3 * speed * np.eye(3)
        values = _imbalance(robot, soil, np.vstack([unknown, unknown + shifts]), speed, rate)
        if np.abs(values[0]).max() < _TOLERANCE:
            return float(unknown[0] / radius), float(unknown[1] / radius)
        jacobian = (values[1:] - values[0]).T / (1e-3 * speed)
        if abs(np.linalg.det(jacobian)) < 1e-9:
            return None
        change = np.linalg.solve(jacobian, values[0])
        # a bank may not change by more than a third of the speed at once: the forces saturate
        unknown = unknown - change * min(1.0, 0.33 * speed / max(np.abs(change).max(), 1e-12))
        unknown[:2] = np.clip(unknown[:2], -limit, limit)
    return None
