"""The pieces of one integration step: forces of a wheel and their derivative, loads, the linear solve."""

from __future__ import annotations

import math

from .ground import gradient
from .jit import kernel
from .plant import GRAVITY
from .soil import Soil
from .wheel import shear_forces

EPSILON = 1e-6
"""Step of the differences [m/s] or [rad/s]."""
LATERAL_YIELD = 0.1
"""Slip angle at which the soil beside a wheel has yielded halfway [rad]."""


@kernel
def local_soil(soil, strength, stiffness):  # type: ignore[no-untyped-def]
    """Soil with its strength and stiffness multiplied."""
    return Soil(
        soil.cohesion,
        soil.friction_angle,
        soil.cohesive_bearing,
        soil.unit_weight,
        soil.frictional_bearing,
        soil.exponent,
        soil.shear_length,
        soil.exit_ratio,
        soil.peak_0,
        soil.peak_1,
        soil.rate_gain,
        soil.stiffness * stiffness,
        soil.strength * strength,
        soil.pressure_law,
        soil.shear_law,
        soil.hump,
        soil.hump_length,
    )


@kernel
def wheel_wrench(soil, profile, mode, motion, out):  # type: ignore[no-untyped-def]
    """Shear and side forces of one wheel in the body frame into ``out`` (f_x, f_y, f_z, yaw moment, axle moment).

    ``mode`` is (direction, radius, toe, free, side resistance, lateral gain); ``motion`` is the hub's (v_x, v_y),
    yaw rate and bank speed.
    """
    cosine, sine = math.cos(mode[2]), math.sin(mode[2])
    v_x, v_y = cosine * motion[0] + sine * motion[1], -sine * motion[0] + cosine * motion[1]
    spin = v_x / mode[1] if mode[3] > 0.5 else motion[3]
    shear_forces(soil, profile, mode[0], v_x, v_y, spin, motion[2], mode[1], out)
    side = mode[5] * out[1] - mode[4] * v_y / math.sqrt(v_y * v_y + (LATERAL_YIELD * v_x) ** 2 + 4e-6)
    forward = out[0]
    out[0], out[1] = cosine * forward - sine * side, sine * forward + cosine * side
    if mode[3] > 0.5:
        out[4] = 0.0


@kernel
def add_derivative(soil, profile, mode, motion, base, arm, bank, shifted, system):  # type: ignore[no-untyped-def]
    """Add one wheel's force derivative to ``system`` (5, 5), rows (F_x, F_y, M_z, -axle right, -axle left)."""
    for k in range(4):
        kept = motion[k]
        motion[k] = kept + EPSILON
        wheel_wrench(soil, profile, mode, motion, shifted)
        motion[k] = kept
        d_x, d_y = (shifted[0] - base[0]) / EPSILON, (shifted[1] - base[1]) / EPSILON
        d_m = (shifted[3] - base[3]) / EPSILON + arm[0] * d_y - arm[1] * d_x
        d_t = -(shifted[4] - base[4]) / EPSILON
        column = 3 + bank if k == 3 else k
        system[0, column] += d_x
        system[1, column] += d_y
        system[2, column] += d_m
        system[3 + bank, column] += d_t
        if k < 2:  # hub velocity also follows the yaw rate
            lever = -arm[1] if k == 0 else arm[0]
            system[0, 2] += lever * d_x
            system[1, 2] += lever * d_y
            system[2, 2] += lever * d_m
            system[3 + bank, 2] += lever * d_t


@kernel
def solve_in_place(matrix, vector):  # type: ignore[no-untyped-def]
    """Gaussian elimination with row pivoting; ``vector`` becomes the solution."""
    size = vector.shape[0]
    for k in range(size):
        best = k
        for i in range(k + 1, size):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        if best != k:
            for j in range(size):
                matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
            vector[k], vector[best] = vector[best], vector[k]
        for i in range(k + 1, size):
            factor = matrix[i, k] / matrix[k, k]
            for j in range(k, size):
                matrix[i, j] -= factor * matrix[k, j]
            vector[i] -= factor * vector[k]
    for k in range(size - 1, -1, -1):
        for j in range(k + 1, size):
            vector[k] -= matrix[k, j] * vector[j]
        vector[k] /= matrix[k, k]


@kernel
def wheel_loads(body, wheels, specific, heights, angles, loads):  # type: ignore[no-untyped-def]
    """Vertical load of each wheel [N]: static share, lagged transfer, frame twist, imbalance."""
    weight = body.mass * GRAVITY
    twist = 0.25 * (heights[0] - heights[1] - heights[2] + heights[3])
    for i in range(4):
        front = 1.0 if i < 2 else -1.0
        left = 1.0 if i % 2 == 1 else -1.0
        share = (1.0 + front * body.mass_x / body.half_wheelbase) * (1.0 + left * body.mass_y / body.half_track)
        pitch = front * specific[0] / (4.0 * body.half_wheelbase)
        roll = left * specific[1] / (4.0 * body.half_track)
        load = 0.25 * weight * share - body.mass * body.mass_height * (pitch + roll)
        load -= front * left * body.torsion * twist
        loads[i] = max(load * (1.0 + wheels.bounce[i] * math.cos(angles[i % 2])), 0.0)


@kernel
def gravity_in_plane(plant, state, h):  # type: ignore[no-untyped-def]
    """Gravity in the plane of four heights ``h`` on the field's slope, body frame (x, y) [m/s^2]."""
    body = plant.body
    g_x, g_y = gradient(plant.ground, state.pose[0], state.pose[1])
    cosine, sine = math.cos(state.pose[2]), math.sin(state.pose[2])
    climb = cosine * g_x + sine * g_y + (h[0] + h[1] - h[2] - h[3]) / (4.0 * body.half_wheelbase)
    bank_up = -sine * g_x + cosine * g_y + (h[1] + h[3] - h[0] - h[2]) / (4.0 * body.half_track)
    level = math.sqrt(1.0 + climb * climb + bank_up * bank_up)
    return -GRAVITY * climb / level, -GRAVITY * bank_up / level


@kernel
def passive_pressure(soil, sinkage, contact):  # type: ignore[no-untyped-def]
    """Rankine's passive earth pressure on a wheel's side of length ``contact`` [m], in N."""
    passive = math.tan(math.pi / 4.0 + soil.friction_angle / 2.0)
    return contact * (0.5 * soil.unit_weight * (sinkage * passive) ** 2 + 2.0 * soil.cohesion * sinkage * passive)
