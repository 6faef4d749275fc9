"""Rigid body on a plane: wheel loads, wheel forces, accelerations (theory: wheel model, section 6)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import kernel, stack_array
from ddagr_gym.parameters import STANDARD_GRAVITY
from ddagr_gym.physics.callbacks import EffectActions, apply_effects
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
    SIDE_SLIP_LEAD,
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
from ddagr_gym.physics.numerics import PatchNumerics, StepNumerics
from ddagr_gym.physics.sinkage import solve_sinkage
from ddagr_gym.physics.wheel_derivatives import (
    change_of,
    is_stale,
    motion_of,
    predict_sinkage,
    refresh_derivative,
    relative_motion,
    stiffness_of,
)

Array = NDArray[np.float64]

_EXTRAPOLATION_LIMIT = 0.1
"""Largest relative change of sinkage that the derivative is trusted for (ours)."""

_REST_TRAVEL = 0.01
"""Sum of rim speed and hub velocity below which the direction of travel turns gradually [m/s] (ours)."""


@kernel(inline=True)
def hub_x(row: Array, wheel: int) -> float:
    """Hub position forward of the body origin [m]."""
    return row[HALF_WHEELBASE] if wheel < 2 else -row[HALF_WHEELBASE]


@kernel(inline=True)
def hub_y(row: Array, wheel: int) -> float:
    """Hub position to the left of the body origin [m]: odd indices are the left bank."""
    return row[HALF_TRACK] if wheel % 2 else -row[HALF_TRACK]


@kernel(inline=True)
def side_slip_x(row: Array, wheel: int) -> float:
    """Where a wheel's sideways velocity counts, forward of the body origin [m] (theory: wheel model, eq. (1a))."""
    x = hub_x(row, wheel)
    if row[SIDE_SLIP_LEAD] == 0.0:
        return x
    rim = (row[WHEEL + wheel] + row[WHEEL + 8 + wheel]) * row[OMEGA + wheel % 2]
    travel = rim + row[V_X] - row[YAW_RATE] * hub_y(row, wheel)
    return x + row[SIDE_SLIP_LEAD] * travel / math.sqrt(travel * travel + _REST_TRAVEL * _REST_TRAVEL)


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


@kernel(inline=True)
def world_rates(row: Array) -> tuple[float, float]:
    """d/dt of X and Y."""
    cosine = math.cos(row[YAW])
    sine = math.sin(row[YAW])
    return row[V_X] * cosine - row[V_Y] * sine, row[V_X] * sine + row[V_Y] * cosine


@kernel()
def tilt_gravity(row: Array) -> None:
    """Gravity in body axes on a plane of gradient SLOPE; gravity is fixed in the world, so it turns with yaw (6.3).

    Theory: wheel model, eq. (23).
    """
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

    Theory: wheel model, eq. (24).
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


@kernel(inline=True, fused=False)
def _set_wheel_kinematics(row: Array, i: int) -> None:
    """Not fused: effects compute it again, and the next evaluation starts from the motion of the last one."""
    row[WHEEL_V_X + i] = row[V_X] - row[YAW_RATE] * hub_y(row, i)
    row[WHEEL_V_Y + i] = row[V_Y] + row[YAW_RATE] * side_slip_x(row, i)
    row[WHEEL_OMEGA + i] = row[OMEGA + i % 2]
    rim = (row[WHEEL + i] + row[WHEEL + 8 + i]) * row[WHEEL_OMEGA + i]
    row[SLIP_RATIO + i] = slip_ratio(rim, row[WHEEL_V_X + i])


@kernel()
def set_kinematics(row: Array) -> None:
    """Hub velocities and slip from the body's motion (theory: wheel model, eq. (1), (8))."""
    for i in range(4):
        _set_wheel_kinematics(row, i)


@kernel(inline=True)
def _load_wheel(row: Array, i: int, wheel: Array, soil: Array) -> None:
    for j in range(3):
        wheel[j] = row[WHEEL + 4 * j + i]
    for j in range(9):
        soil[j] = row[SOIL + 9 * i + j]


@kernel()
def _carry_load(
    row: Array, i: int, wheel: Array, soil: Array, tolerance: float, numerics: PatchNumerics, wrench: Array
) -> None:
    """Wrench at the sinkage that carries the wheel's load, warm-started at the one in ``row``.

    While the load error there is small the wrench is extrapolated with the derivative by sinkage (its error is of
    second order); otherwise the sinkage is iterated.
    """
    load = row[LOAD + i]
    row[BOGGED + i] = 0.0
    if load <= 0.0:
        row[SINKAGE + i] = 0.0
        for j in range(WRENCH):
            wrench[j] = 0.0
        return
    motion = motion_of(row, i)
    sinkage = row[SINKAGE + i]
    stiffness = stiffness_of(row, i)
    if stiffness > 0.0 and sinkage > 0.0:
        wheel_wrench(wheel, soil, motion, sinkage, numerics, wrench)
        step = (load - wrench[2]) / stiffness
        within = abs(load - wrench[2]) <= tolerance * load and abs(step) <= _EXTRAPOLATION_LIMIT * sinkage
        if within and sinkage + step <= wheel[0]:
            for j in range(WRENCH):
                wrench[j] += change_of(row, i, j, 0.0, 0.0, 0.0, step)
            row[SINKAGE + i] = sinkage + step
            return
        sinkage += min(max(step, -0.5 * sinkage), 0.5 * sinkage)
    elif sinkage <= 0.0:
        sinkage = 0.3 * wheel[0]
    # Half the extrapolation error that is accepted above, so that the next step can extrapolate again.
    row[SINKAGE + i], bogged = solve_sinkage(wheel, soil, motion, load, sinkage, 0.05 * tolerance, numerics, wrench)
    row[BOGGED + i] = 1.0 if bogged else 0.0


@kernel()
def extra_forces(row: Array, actions: EffectActions) -> None:
    """Forces that effects add to wheels and body."""
    for i in range(4):
        row[EXTRA_FORCE_X + i] = 0.0
        row[EXTRA_FORCE_Y + i] = 0.0
        row[EXTRA_YAW_MOMENT + i] = 0.0
        row[EXTRA_AXLE_TORQUE + i] = 0.0
    for j in range(3):
        row[BODY_FORCE + j] = 0.0
    apply_effects(POINT_WHEEL_FORCES, row, actions)
    apply_effects(POINT_BODY_FORCES, row, actions)


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
    """Newton-Euler at the body origin for forces that act there (2.10), with an offset centre of mass.

    Theory: wheel model, eq. (26), (27).
    """
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
def _gather_forces(row: Array, actions: EffectActions) -> None:
    """Add the effects' forces to those of the wheels, which are in ``row`` without them, and accelerate the body."""
    total = stack_array(3)
    extra_forces(row, actions)
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


@kernel()
def evaluate_forces(row: Array, refresh: float, numerics: StepNumerics, actions: EffectActions) -> None:
    """Wheel forces, sinkages and accelerations for the motion in ``row``.

    Args:
        row: reads motion, loads, soil; writes kinematics, forces, ACCELERATION, SPECIFIC_FORCE.
        refresh: relative change of motion that renews a wheel's derivative; negative: leave it alone.
        numerics: accuracy.
        actions: effects on this environment.
    """
    forces, derivative = numerics.forces, numerics.derivative  # here, since taking arrays out costs
    tilt_gravity(row)
    share_load(row)
    wheel, soil, wrench = stack_array(3), stack_array(9), stack_array(WRENCH)
    for i in range(4):
        v_x, v_y, rim, _ = relative_motion(row, i)
        _set_wheel_kinematics(row, i)
        predict_sinkage(row, i, v_x, v_y, rim)
        _load_wheel(row, i, wheel, soil)
        _carry_load(row, i, wheel, soil, numerics.sinkage_tolerance, forces, wrench)
        row[FORCE_X + i] = wrench[0]
        row[FORCE_Y + i] = wrench[1]
        row[FORCE_Z + i] = wrench[2]
        row[YAW_MOMENT + i] = wrench[3]
        row[AXLE_TORQUE + i] = wrench[4]
        if refresh >= 0.0 and row[LOAD + i] > 0.0 and is_stale(row, i, refresh):
            refresh_derivative(row, i, wheel, soil, derivative)
    if refresh >= 0.0:
        row[DERIVATIVE_VALID] = 1.0
    _gather_forces(row, actions)


@kernel()
def _may_extrapolate(row: Array, limit: float) -> bool:
    """Whether no wheel's velocity has changed by more than a share of its speed; never where that share is 0."""
    if limit <= 0.0:
        return False
    for i in range(4):
        v_x, _, rim, speed = relative_motion(row, i)
        change = limit * max(abs(v_x), abs(rim)) * speed
        d_x = row[V_X] - row[YAW_RATE] * hub_y(row, i) - row[WHEEL_V_X + i]
        d_y = row[V_Y] + row[YAW_RATE] * side_slip_x(row, i) - row[WHEEL_V_Y + i]
        d_rim = (row[WHEEL + i] + row[WHEEL + 8 + i]) * (row[OMEGA + i % 2] - row[WHEEL_OMEGA + i])
        carried = row[LOAD + i] > 0.0 and row[BOGGED + i] == 0.0 and stiffness_of(row, i) > 0.0
        if not (carried and abs(d_x) <= change and abs(d_y) <= change and abs(d_rim) <= change):
            return False
    return True


@kernel()
def extrapolate_forces(row: Array, limit: float, actions: EffectActions) -> bool:
    """Forces for a motion close to that of the last evaluation, by the wheels' derivatives (error of second order).

    Args:
        row: as in :func:`evaluate_forces`.
        limit: change of a wheel's velocity over its speed up to which this is done.
        actions: effects on this environment.

    Returns:
        Whether it was done; otherwise ``row`` is as before.
    """
    if not _may_extrapolate(row, limit):
        return False
    tilt_gravity(row)
    share_load(row)
    for i in range(4):
        v_x, v_y, rim, _ = relative_motion(row, i)
        _set_wheel_kinematics(row, i)
        new_x, new_y, new_rim, _ = relative_motion(row, i)
        d_x, d_y, d_rim = new_x - v_x, new_y - v_y, new_rim - rim
        d_z = (row[LOAD + i] - row[FORCE_Z + i] - change_of(row, i, 2, d_x, d_y, d_rim, 0.0)) / stiffness_of(row, i)
        row[SINKAGE + i] = min(row[SINKAGE + i] + d_z, row[WHEEL + i])
        row[FORCE_X + i] += change_of(row, i, 0, d_x, d_y, d_rim, d_z) - row[EXTRA_FORCE_X + i]
        row[FORCE_Y + i] += change_of(row, i, 1, d_x, d_y, d_rim, d_z) - row[EXTRA_FORCE_Y + i]
        row[FORCE_Z + i] += change_of(row, i, 2, d_x, d_y, d_rim, d_z)
        row[YAW_MOMENT + i] += change_of(row, i, 3, d_x, d_y, d_rim, d_z) - row[EXTRA_YAW_MOMENT + i]
        row[AXLE_TORQUE + i] += change_of(row, i, 4, d_x, d_y, d_rim, d_z) - row[EXTRA_AXLE_TORQUE + i]
    _gather_forces(row, actions)
    return True
