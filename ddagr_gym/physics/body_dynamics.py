"""Rigid body on a plane: wheel loads, wheel forces, accelerations (physics.md section 6)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import kernel
from ddagr_gym.parameters import STANDARD_GRAVITY
from ddagr_gym.physics.callbacks import apply_effects
from ddagr_gym.physics.contact_patch import WRENCH, wheel_wrench
from ddagr_gym.physics.contact_stress import slip_ratio
from ddagr_gym.physics.layout import (
    ACCELERATION,
    AXLE_TORQUE,
    BASE_BODY,
    BASE_WHEEL,
    BODY_FORCE,
    BOGGED,
    CENTRE_OF_MASS,
    DERIVATIVE,
    DERIVATIVE_AT,
    DERIVATIVE_VALID,
    EXTRA_AXLE_TORQUE,
    EXTRA_FORCE_X,
    EXTRA_FORCE_Y,
    EXTRA_YAW_MOMENT,
    FORCE_X,
    FORCE_Y,
    FORCE_Z,
    GRAVITY,
    HALF_TRACK,
    HALF_WHEELBASE,
    LOAD,
    MASS,
    OMEGA,
    POINT_BODY_FORCES,
    POINT_WHEEL_FORCES,
    SINKAGE,
    SLIP_RATIO,
    SLOPE,
    SOIL,
    SPECIFIC_FORCE,
    V_X,
    V_Y,
    WHEEL,
    WHEEL_OMEGA,
    WHEEL_V_X,
    WHEEL_V_Y,
    WHEEL_X,
    WHEEL_Y,
    YAW,
    YAW_INERTIA,
    YAW_MOMENT,
    YAW_RATE,
    X,
    Y,
)
from ddagr_gym.physics.sinkage import solve_sinkage

Array = NDArray[np.float64]

_EXTRAPOLATION_LIMIT = 0.1
"""Largest relative change of sinkage that the derivative is trusted for (ours)."""


@kernel(inline=True)
def hub_x(row: Array, wheel: int) -> float:
    """Hub position forward of the body origin [m]."""
    return row[HALF_WHEELBASE] if wheel < 2 else -row[HALF_WHEELBASE]


@kernel(inline=True)
def hub_y(row: Array, wheel: int) -> float:
    """Hub position to the left of the body origin [m]: odd indices are the left bank."""
    return row[HALF_TRACK] if wheel % 2 else -row[HALF_TRACK]


@kernel()
def restore_body(row: Array) -> None:
    """Undo what load effects did at the last sample."""
    for j in range(7):
        row[MASS + j] = row[BASE_BODY + j]
    for j in range(12):
        row[WHEEL + j] = row[BASE_WHEEL + j]


@kernel()
def place_wheels(row: Array) -> None:
    """World positions of the hubs."""
    cosine = math.cos(row[YAW])
    sine = math.sin(row[YAW])
    for i in range(4):
        x = hub_x(row, i)
        y = hub_y(row, i)
        row[WHEEL_X + i] = row[X] + cosine * x - sine * y
        row[WHEEL_Y + i] = row[Y] + sine * x + cosine * y


@kernel()
def tilt_gravity(row: Array) -> None:
    """Gravity in body axes on a plane of gradient SLOPE; gravity is fixed in the world, so it turns with yaw (6.3)."""
    if row[SLOPE] == 0.0 and row[SLOPE + 1] == 0.0:
        row[GRAVITY] = 0.0
        row[GRAVITY + 1] = 0.0
        row[GRAVITY + 2] = -STANDARD_GRAVITY
        return
    steepness = math.hypot(row[SLOPE], row[SLOPE + 1])
    uphill = math.atan2(row[SLOPE + 1], row[SLOPE])
    inclination = math.atan(steepness)
    along = STANDARD_GRAVITY * math.sin(inclination)
    row[GRAVITY] = -along * math.cos(row[YAW] - uphill)
    row[GRAVITY + 1] = along * math.sin(row[YAW] - uphill)
    row[GRAVITY + 2] = -STANDARD_GRAVITY * math.cos(inclination)


@kernel()
def share_load(row: Array) -> None:
    """Quasi-static wheel loads N_i = N/4 (1 +- x_p/L)(1 +- y_p/W), (x_p, y_p) where gravity's line meets the ground.

    Acceleration is left out (thesis section 2.3: constant loads). Beyond the wheels' rectangle a side is unloaded.
    """
    normal = -row[GRAVITY + 2]
    height = row[CENTRE_OF_MASS + 2]
    x = row[CENTRE_OF_MASS] + height * row[GRAVITY] / normal
    y = row[CENTRE_OF_MASS + 1] + height * row[GRAVITY + 1] / normal
    x = min(max(x / row[HALF_WHEELBASE], -1.0), 1.0)
    y = min(max(y / row[HALF_TRACK], -1.0), 1.0)
    for i in range(4):
        front = 1.0 + x if i < 2 else 1.0 - x
        side = 1.0 + y if i % 2 else 1.0 - y
        row[LOAD + i] = 0.25 * row[MASS] * normal * front * side


@kernel()
def set_kinematics(row: Array) -> None:
    """Hub velocities and slip from the body's motion (physics.md section 1)."""
    for i in range(4):
        row[WHEEL_V_X + i] = row[V_X] - row[YAW_RATE] * hub_y(row, i)
        row[WHEEL_V_Y + i] = row[V_Y] + row[YAW_RATE] * hub_x(row, i)
        row[WHEEL_OMEGA + i] = row[OMEGA + i % 2]
        rim = (row[WHEEL + i] + row[WHEEL + 8 + i]) * row[WHEEL_OMEGA + i]
        row[SLIP_RATIO + i] = slip_ratio(rim, row[WHEEL_V_X + i])


@kernel()
def _load_wheel(row: Array, i: int, wheel: Array) -> None:
    for j in range(3):
        wheel[j] = row[WHEEL + 4 * j + i]


@kernel()
def _refresh_derivative(
    row: Array, i: int, wheel: Array, shear_rate: float, rest_speed: float, section: Array, coarse: Array,
    workspace: Array, base: Array, moved: Array,
) -> None:  # fmt: skip
    """Forward differences of the wrench by v_x, v_y and sinkage on the coarse rule."""
    v_x = row[WHEEL_V_X + i]
    v_y = row[WHEEL_V_Y + i]
    omega = row[WHEEL_OMEGA + i]
    sinkage = row[SINKAGE + i]
    soil = row[SOIL + 9 * i : SOIL + 9 * i + 9]
    speed_step = 1e-4 * max(abs(v_x), abs((wheel[0] + wheel[2]) * omega)) + 1e-6
    sinkage_step = -1e-4 * sinkage
    wheel_wrench(
        wheel, soil, v_x, v_y, omega, row[YAW_RATE], sinkage, shear_rate, rest_speed, section, coarse, workspace, base
    )  # fmt: skip
    for direction in range(3):
        d_x = speed_step if direction == 0 else 0.0
        d_y = speed_step if direction == 1 else 0.0
        d_z = sinkage_step if direction == 2 else 0.0
        wheel_wrench(
            wheel, soil, v_x + d_x, v_y + d_y, omega, row[YAW_RATE], sinkage + d_z, shear_rate, rest_speed, section,
            coarse, workspace, moved,
        )  # fmt: skip
        for j in range(WRENCH):
            row[DERIVATIVE + 15 * i + 5 * direction + j] = (moved[j] - base[j]) / (d_x + d_y + d_z)
    row[DERIVATIVE_AT + i] = v_x
    row[DERIVATIVE_AT + 4 + i] = v_y
    row[DERIVATIVE_AT + 8 + i] = omega
    row[DERIVATIVE_AT + 12 + i] = sinkage


@kernel()
def _derivative_is_stale(row: Array, i: int, outer_radius: float, refresh: float) -> bool:
    speed = refresh * max(abs(row[WHEEL_V_X + i]), abs(outer_radius * row[WHEEL_OMEGA + i]))
    return (
        row[DERIVATIVE_VALID] == 0.0
        or abs(row[WHEEL_V_X + i] - row[DERIVATIVE_AT + i]) > speed
        or abs(row[WHEEL_V_Y + i] - row[DERIVATIVE_AT + 4 + i]) > speed
        or abs(row[WHEEL_OMEGA + i] - row[DERIVATIVE_AT + 8 + i]) * outer_radius > speed
        or abs(row[SINKAGE + i] - row[DERIVATIVE_AT + 12 + i]) > refresh * row[SINKAGE + i]
    )


@kernel()
def _carry_load(
    row: Array, i: int, wheel: Array, tolerance: float, shear_rate: float, rest_speed: float, section: Array,
    contact: Array, workspace: Array, wrench: Array,
) -> None:  # fmt: skip
    """Wrench at the sinkage that carries the wheel's load, warm-started at the last one.

    While the load error at the last sinkage is small the wrench is extrapolated with the derivative by sinkage
    (its error is of second order); otherwise the sinkage is iterated.
    """
    load = row[LOAD + i]
    soil = row[SOIL + 9 * i : SOIL + 9 * i + 9]
    row[BOGGED + i] = 0.0
    if load <= 0.0:
        row[SINKAGE + i] = 0.0
        wrench[:WRENCH] = 0.0
        return
    sinkage = row[SINKAGE + i]
    stiffness = row[DERIVATIVE + 15 * i + 12]
    if row[DERIVATIVE_VALID] == 1.0 and stiffness > 0.0 and sinkage > 0.0:
        wheel_wrench(
            wheel, soil, row[WHEEL_V_X + i], row[WHEEL_V_Y + i], row[WHEEL_OMEGA + i], row[YAW_RATE], sinkage,
            shear_rate, rest_speed, section, contact, workspace, wrench,
        )  # fmt: skip
        step = (load - wrench[2]) / stiffness
        within = abs(load - wrench[2]) <= tolerance * load and abs(step) <= _EXTRAPOLATION_LIMIT * sinkage
        if within and sinkage + step <= wheel[0]:
            for j in range(WRENCH):
                wrench[j] += step * row[DERIVATIVE + 15 * i + 10 + j]
            row[SINKAGE + i] = sinkage + step
            return
        sinkage += min(max(step, -0.5 * sinkage), 0.5 * sinkage)
    elif sinkage <= 0.0:
        sinkage = 0.3 * wheel[0]
    # Half the extrapolation error that is accepted above, so that the next step can extrapolate again.
    row[SINKAGE + i], bogged = solve_sinkage(
        wheel, soil, row[WHEEL_V_X + i], row[WHEEL_V_Y + i], row[WHEEL_OMEGA + i], row[YAW_RATE], load, sinkage,
        0.05 * tolerance, shear_rate, rest_speed, section, contact, workspace, wrench,
    )  # fmt: skip
    row[BOGGED + i] = 1.0 if bogged else 0.0


@kernel()
def extra_forces(
    row: Array, effect_points: NDArray[np.int64], effect_addresses: NDArray[np.int64], parameters: Array, memory: Array
) -> None:
    """Forces that effects add to wheels and body."""
    for i in range(4):
        row[EXTRA_FORCE_X + i] = 0.0
        row[EXTRA_FORCE_Y + i] = 0.0
        row[EXTRA_YAW_MOMENT + i] = 0.0
        row[EXTRA_AXLE_TORQUE + i] = 0.0
    for j in range(3):
        row[BODY_FORCE + j] = 0.0
    apply_effects(POINT_WHEEL_FORCES, row, effect_points, effect_addresses, parameters, memory)
    apply_effects(POINT_BODY_FORCES, row, effect_points, effect_addresses, parameters, memory)


@kernel()
def sum_extra(row: Array, total: Array) -> None:
    """Sum of the effects' forces as F_x, F_y at the body origin and M_z about it."""
    for j in range(3):
        total[j] = row[BODY_FORCE + j]
    for i in range(4):
        total[0] += row[EXTRA_FORCE_X + i]
        total[1] += row[EXTRA_FORCE_Y + i]
        total[2] += (
            hub_x(row, i) * row[EXTRA_FORCE_Y + i] - hub_y(row, i) * row[EXTRA_FORCE_X + i] + row[EXTRA_YAW_MOMENT + i]
        )


@kernel()
def accelerate(row: Array, total: Array) -> None:
    """Newton-Euler at the body origin for forces that act there (2.10), with an offset centre of mass."""
    x = row[CENTRE_OF_MASS]
    y = row[CENTRE_OF_MASS + 1]
    rate = row[YAW_RATE]
    specific_x = total[0] / row[MASS]
    specific_y = total[1] / row[MASS]
    yaw_acceleration = (total[2] - x * total[1] + y * total[0]) / row[YAW_INERTIA]
    # from the centre of mass to the origin: a_o = a_c - alpha x r + rate^2 r
    specific_x += yaw_acceleration * y + rate * rate * x
    specific_y += -yaw_acceleration * x + rate * rate * y
    row[SPECIFIC_FORCE] = specific_x
    row[SPECIFIC_FORCE + 1] = specific_y
    row[ACCELERATION] = rate * row[V_Y] + specific_x + row[GRAVITY]
    row[ACCELERATION + 1] = -rate * row[V_X] + specific_y + row[GRAVITY + 1]
    row[ACCELERATION + 2] = yaw_acceleration


@kernel()
def evaluate_forces(
    row: Array, refresh: float, tolerance: float, shear_rate: float, rest_speed: float, section: Array,
    contact: Array, coarse: Array, workspace: Array, scratch: Array, effect_points: NDArray[np.int64],
    effect_addresses: NDArray[np.int64], parameters: Array, memory: Array,
) -> None:  # fmt: skip
    """Wheel forces, sinkages and accelerations for the motion in ``row``.

    Args:
        row: reads motion, loads, soil; writes kinematics, forces, ACCELERATION, SPECIFIC_FORCE.
        refresh: relative change of motion that renews a wheel's derivative; negative: leave it alone.
        tolerance: relative load error that is extrapolated.
        shear_rate: nu_min [rad/s].
        rest_speed: blending width [m/s].
        section: section rule.
        contact: contact rule.
        coarse: contact rule of the derivative.
        workspace: of the kernel.
        scratch: (4, 8) small vectors.
        effect_points: as in :func:`apply_effects`, and the following.
        effect_addresses: see there.
        parameters: see there.
        memory: see there.
    """
    tilt_gravity(row)
    share_load(row)
    set_kinematics(row)
    wheel, wrench, moved, total = scratch[0], scratch[1], scratch[2], scratch[3]
    for i in range(4):
        _load_wheel(row, i, wheel)
        _carry_load(row, i, wheel, tolerance, shear_rate, rest_speed, section, contact, workspace, wrench)
        row[FORCE_X + i] = wrench[0]
        row[FORCE_Y + i] = wrench[1]
        row[FORCE_Z + i] = wrench[2]
        row[YAW_MOMENT + i] = wrench[3]
        row[AXLE_TORQUE + i] = wrench[4]
        if refresh >= 0.0 and row[LOAD + i] > 0.0 and _derivative_is_stale(row, i, wheel[0] + wheel[2], refresh):
            _refresh_derivative(
                row, i, wheel, shear_rate, rest_speed, section, coarse, workspace, wrench, moved
            )  # fmt: skip
    if refresh >= 0.0:
        row[DERIVATIVE_VALID] = 1.0
    extra_forces(row, effect_points, effect_addresses, parameters, memory)
    sum_extra(row, total)
    for i in range(4):
        total[0] += row[FORCE_X + i]
        total[1] += row[FORCE_Y + i]
        total[2] += hub_x(row, i) * row[FORCE_Y + i] - hub_y(row, i) * row[FORCE_X + i] + row[YAW_MOMENT + i]
        row[FORCE_X + i] += row[EXTRA_FORCE_X + i]
        row[FORCE_Y + i] += row[EXTRA_FORCE_Y + i]
        row[YAW_MOMENT + i] += row[EXTRA_YAW_MOMENT + i]
        row[AXLE_TORQUE + i] += row[EXTRA_AXLE_TORQUE + i]
    accelerate(row, total)
