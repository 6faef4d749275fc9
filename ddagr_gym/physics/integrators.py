"""Time step of the body: a two-stage, second-order, linearly implicit W-method.

    (I - gamma h A) k1 = h f(t_n, y_n) + gamma h^2 f_t
    (I - gamma h A) k2 = h f(t_n + h, y_n + k1) - 2 k1 - gamma h^2 f_t
    y_{n+1} = y_n + 3/2 k1 + 1/2 k2

with gamma = 1 - 1/sqrt(2) (Verwer, Spee, Blom and Hundsdorfer, SIAM J. Sci. Comput. 20 (1999) 1456, eq. 2.7). It
is L-stable with the exact Jacobian A and of order two with any A, so A may be coarse and kept over steps; it acts
on the three velocities, where the stiffness is (physics.md section 6). Bank speeds are solved exactly; their change
enters through f_t, without which the robot would lag behind its wheels when it creeps.

The forces at y_{n+1} that the next step starts from are extrapolated from those at y_n + k1 with the wheels'
derivatives: the two states differ by O(h^2), so the order stays, and a step costs one evaluation.

The embedded first-order solution y_n + k1 shows where a step is too long; such a step is redone in several. Near rest
friction saturates within micrometres per second and a linearised step can overshoot to the other side: there it is
redone by backward Euler with damped Newton iterations, which cannot overshoot because friction is monotone in the
velocity.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import kernel, stack_array
from ddagr_gym.physics.body_dynamics import (
    evaluate_forces,
    extra_forces,
    extrapolate_forces,
    hub_x,
    hub_y,
    set_kinematics,
    sum_extra,
)
from ddagr_gym.physics.drivetrain import advance_motors
from ddagr_gym.physics.layout import (
    ACCELERATION,
    HALF_TRACK,
    LOAD,
    MASS,
    OMEGA,
    OPTION_ACCEPTED_ERROR,
    OPTION_DIVISIONS,
    OPTION_EXTRAPOLATION,
    OPTION_REFRESH,
    POINT_BODY_FORCES,
    POINT_WHEEL_FORCES,
    SIZE,
    TIME,
    V_X,
    V_Y,
    WHEEL,
    YAW,
    YAW_INERTIA,
    YAW_RATE,
    X,
    Y,
)
from ddagr_gym.physics.wheel_derivatives import change_of, relative_motion, stiffness_of

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

GAMMA = 1.0 - 1.0 / math.sqrt(2.0)
NEWTON_ITERATIONS = 40
NEWTON_TOLERANCE = 1e-9  # [m/s]
HALVINGS = 12
DOUBLE_ERROR_SPEED = 0.33  # [m/s], at which twice Numerics.accepted_error is accepted
FULL_ERROR_SPEED = 0.02  # [m/s], below which less is accepted: a robot that stands on a slope would chatter
LEAST_ERROR = 1e-6  # [m/s], accepted at rest
OVERSHOOT = 4.0  # times the accepted error: the linearised step has failed, and not for its length


@kernel()
def _add_wheel_jacobian(row: Array, i: int, jacobian: Array, drive: Array) -> None:
    x = hub_x(row, i)
    y = hub_y(row, i)
    stiffness = stiffness_of(row, i)
    speed = relative_motion(row, i)[3]
    for direction in range(3):
        d_x = 1.0 / speed if direction == 0 else 0.0
        d_y = 1.0 / speed if direction == 1 else 0.0
        d_rim = (row[WHEEL + i] + row[WHEEL + 8 + i]) / speed if direction == 2 else 0.0
        settle = -change_of(row, i, 2, d_x, d_y, d_rim, 0.0) / stiffness
        f_x = change_of(row, i, 0, d_x, d_y, d_rim, settle)
        f_y = change_of(row, i, 1, d_x, d_y, d_rim, settle)
        moment = x * f_y - y * f_x + change_of(row, i, 3, d_x, d_y, d_rim, settle)
        if direction == 2:
            bank = i % 2
            drive[bank] += f_x
            drive[2 + bank] += f_y
            drive[4 + bank] += moment
            continue
        arm = x if direction == 1 else -y
        jacobian[direction] += f_x
        jacobian[3 + direction] += f_y
        jacobian[6 + direction] += moment
        jacobian[2] += arm * f_x
        jacobian[5] += arm * f_y
        jacobian[8] += arm * moment


@kernel()
def _wheel_jacobian(row: Array, jacobian: Array, drive: Array) -> None:
    """Derivatives of (F_x, F_y, M_z) of all wheels, the sinkage following its load.

    Args:
        row: reads derivatives and kinematics.
        jacobian: (9,) by v_x, v_y and yaw rate, row by row, written.
        drive: (6,) by right and left bank speed, row by row, written.
    """
    for j in range(9):
        jacobian[j] = 0.0
    for j in range(6):
        drive[j] = 0.0
    for i in range(4):
        if row[LOAD + i] > 0.0 and stiffness_of(row, i) > 0.0:
            _add_wheel_jacobian(row, i, jacobian, drive)


@kernel()
def _add_effect_jacobian(
    row: Array, jacobian: Array, effect_points: Integers, effect_addresses: Integers, parameters: Array, memory: Array
) -> None:
    """Forward differences of the effects' forces by the three velocities."""
    active = False
    for k in range(effect_points.shape[0]):
        active = active or effect_points[k] == POINT_WHEEL_FORCES or effect_points[k] == POINT_BODY_FORCES
    if not active:
        return
    base, moved = stack_array(3), stack_array(3)
    sum_extra(row, base)
    for direction in range(3):
        before = row[V_X + direction]
        step = 1e-4 * abs(before) + 1e-6
        row[V_X + direction] = before + step
        set_kinematics(row)
        extra_forces(row, effect_points, effect_addresses, parameters, memory)
        sum_extra(row, moved)
        row[V_X + direction] = before
        for j in range(3):
            jacobian[3 * j + direction] += (moved[j] - base[j]) / step
    set_kinematics(row)


@kernel(inline=True)
def _invert(matrix: Array, inverse: Array) -> None:
    """Inverse of a 3 x 3 matrix, row by row, by cofactors."""
    a, b, c, d, e, f, g, h, i = (
        matrix[0], matrix[1], matrix[2], matrix[3], matrix[4], matrix[5], matrix[6], matrix[7], matrix[8]
    )  # fmt: skip
    scale = 1.0 / (a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g))
    inverse[0], inverse[1], inverse[2] = (e * i - f * h) * scale, (c * h - b * i) * scale, (b * f - c * e) * scale
    inverse[3], inverse[4], inverse[5] = (f * g - d * i) * scale, (a * i - c * g) * scale, (c * d - a * f) * scale
    inverse[6], inverse[7], inverse[8] = (d * h - e * g) * scale, (b * g - a * h) * scale, (a * e - b * d) * scale


@kernel(inline=True)
def _solve(inverse: Array, right: Array, solution: Array) -> None:
    for j in range(3):
        solution[j] = inverse[3 * j] * right[0] + inverse[3 * j + 1] * right[1] + inverse[3 * j + 2] * right[2]


@kernel()
def _damping_inverse(
    row: Array, step: float, inverse: Array, drive: Array, effect_points: Integers, effect_addresses: Integers,
    parameters: Array, memory: Array,
) -> None:  # fmt: skip
    """(I - step A)^-1, A from the forces' Jacobian and the Coriolis terms, and the accelerations by bank speed.

    Args:
        row: the environment.
        step: [s].
        inverse: (9,) row by row, written.
        drive: (6,) d(acceleration)/d(right, left bank speed), row by row, written.
        effect_points: as in :func:`apply_effects`, and the following.
        effect_addresses: see there.
        parameters: see there.
        memory: see there.
    """
    jacobian = stack_array(9)
    _wheel_jacobian(row, jacobian, drive)
    _add_effect_jacobian(row, jacobian, effect_points, effect_addresses, parameters, memory)
    for j in range(3):
        inertia = row[YAW_INERTIA] if j == 2 else row[MASS]
        for k in range(3):
            jacobian[3 * j + k] /= inertia
        drive[2 * j] /= inertia
        drive[2 * j + 1] /= inertia
    jacobian[1] += row[YAW_RATE]
    jacobian[2] += row[V_Y]
    jacobian[3] -= row[YAW_RATE]
    jacobian[5] -= row[V_X]
    for j in range(9):
        jacobian[j] *= -step
    for j in range(3):
        jacobian[4 * j] += 1.0
    _invert(jacobian, inverse)


@kernel(inline=True)
def _world_rates(row: Array) -> tuple[float, float]:
    """d/dt of X and Y."""
    cosine = math.cos(row[YAW])
    sine = math.sin(row[YAW])
    return row[V_X] * cosine - row[V_Y] * sine, row[V_X] * sine + row[V_Y] * cosine


@kernel()
def _w_step(
    row: Array, step: float, options: Array, section: Array, contact: Array, coarse: Array, effect_points: Integers,
    effect_addresses: Integers, parameters: Array, memory: Array,
) -> float:  # fmt: skip
    """One W-step; returns the size of the embedded error estimate [m/s]. Arguments as :func:`advance_body`."""
    inverse, drive, drift = stack_array(9), stack_array(6), stack_array(3)
    start, first, second, right = stack_array(3), stack_array(3), stack_array(3), stack_array(3)
    _damping_inverse(row, GAMMA * step, inverse, drive, effect_points, effect_addresses, parameters, memory)
    x, y, yaw, yaw_rate = row[X], row[Y], row[YAW], row[YAW_RATE]
    rate_x, rate_y = _world_rates(row)
    right_omega, left_omega = row[OMEGA], row[OMEGA + 1]
    advance_motors(row, step)
    # gamma h^2 f_t, h omega_t being the exact change of the bank speeds
    right_change = GAMMA * step * (row[OMEGA] - right_omega)
    left_change = GAMMA * step * (row[OMEGA + 1] - left_omega)
    for j in range(3):
        drift[j] = drive[2 * j] * right_change + drive[2 * j + 1] * left_change
        start[j] = row[V_X + j]
        right[j] = step * row[ACCELERATION + j] + drift[j]
    _solve(inverse, right, first)
    for j in range(3):
        row[V_X + j] = start[j] + first[j]
    row[YAW] = yaw + step * yaw_rate
    row[TIME] += step
    refresh = options[OPTION_REFRESH] if options[OPTION_EXTRAPOLATION] > 0.0 else -1.0
    evaluate_forces(
        row, refresh, options, section, contact, coarse, effect_points, effect_addresses, parameters,
        memory,
    )  # fmt: skip
    for j in range(3):
        right[j] = step * row[ACCELERATION + j] - 2.0 * first[j] - drift[j]
    _solve(inverse, right, second)
    # with A = 0 the method is Heun's
    end_x, end_y = _world_rates(row)
    row[X] = x + 0.5 * step * (rate_x + end_x)
    row[Y] = y + 0.5 * step * (rate_y + end_y)
    row[YAW] = yaw + 0.5 * step * (yaw_rate + row[YAW_RATE])
    estimate = 0.0
    for j in range(3):
        row[V_X + j] = start[j] + 1.5 * first[j] + 0.5 * second[j]
        weight = row[HALF_TRACK] if j == 2 else 1.0
        estimate = max(estimate, 0.5 * weight * abs(first[j] + second[j]))
    if not extrapolate_forces(row, options[OPTION_EXTRAPOLATION], effect_points, effect_addresses, parameters, memory):
        evaluate_forces(
            row, options[OPTION_REFRESH], options, section, contact, coarse, effect_points, effect_addresses,
            parameters, memory,
        )  # fmt: skip
    return estimate


@kernel(inline=True)
def _defect(row: Array, start: Array, step: float, defect: Array) -> float:
    """v - v_n - h f(v) of backward Euler, and its size [m/s]."""
    for j in range(3):
        defect[j] = row[V_X + j] - start[j] - step * row[ACCELERATION + j]
    return max(max(abs(defect[0]), abs(defect[1])), row[HALF_TRACK] * abs(defect[2]))


@kernel()
def _backward_euler_step(
    row: Array, step: float, options: Array, section: Array, contact: Array, coarse: Array, effect_points: Integers,
    effect_addresses: Integers, parameters: Array, memory: Array,
) -> None:  # fmt: skip
    """One backward Euler step with damped Newton iterations. Arguments as :func:`advance_body`."""
    inverse, drive = stack_array(9), stack_array(6)
    start, defect, change, before = stack_array(3), stack_array(3), stack_array(3), stack_array(3)
    for j in range(3):
        start[j] = row[V_X + j]
    advance_motors(row, step)
    row[TIME] += step
    for _ in range(NEWTON_ITERATIONS):
        evaluate_forces(
            row, 0.0, options, section, contact, coarse, effect_points, effect_addresses, parameters, memory
        )  # fmt: skip
        size = _defect(row, start, step, defect)
        if size <= NEWTON_TOLERANCE:
            break
        _damping_inverse(row, step, inverse, drive, effect_points, effect_addresses, parameters, memory)
        _solve(inverse, defect, change)
        for j in range(3):
            before[j] = row[V_X + j]
        damping = 1.0
        for _ in range(HALVINGS):
            for j in range(3):
                row[V_X + j] = before[j] - damping * change[j]
            evaluate_forces(
                row, -1.0, options, section, contact, coarse, effect_points, effect_addresses, parameters, memory
            )  # fmt: skip
            if _defect(row, start, step, defect) < size:
                break
            damping *= 0.5
    rate_x, rate_y = _world_rates(row)
    row[X] += step * rate_x
    row[Y] += step * rate_y
    row[YAW] += step * row[YAW_RATE]
    evaluate_forces(
        row, 0.0, options, section, contact, coarse, effect_points, effect_addresses, parameters, memory
    )  # fmt: skip


@kernel(inline=True)
def _fastest(row: Array) -> float:
    """Largest of the body's and the rims' speeds [m/s]."""
    speed = max(abs(row[V_X]), abs(row[V_Y]))
    for bank in range(2):
        speed = max(speed, abs(row[OMEGA + bank]) * (row[WHEEL + bank] + row[WHEEL + 8 + bank]))
    return speed


@kernel(inline=True)
def _copy(source: Array, target: Array) -> None:
    for j in range(SIZE):
        target[j] = source[j]


@kernel()
def advance_body(
    row: Array, step: float, options: Array, section: Array, contact: Array, coarse: Array, effect_points: Integers,
    effect_addresses: Integers, parameters: Array, memory: Array,
) -> None:  # fmt: skip
    """One step. Needs the forces at the present state in ``row`` and leaves those at the new one.

    Args:
        row: the environment.
        step: h [s].
        options: as in :func:`evaluate_forces`, and the following.
        section: see there.
        contact: see there.
        coarse: see there.
        effect_points: as in :func:`apply_effects`, and the following.
        effect_addresses: see there.
        parameters: see there.
        memory: see there.
    """
    saved = stack_array(SIZE)
    _copy(row, saved)
    divisions = 1
    done = 0
    while done < divisions:
        estimate = _w_step(
            row, step / divisions, options, section, contact, coarse, effect_points, effect_addresses, parameters,
            memory,
        )  # fmt: skip
        speed = _fastest(row)
        accepted = options[OPTION_ACCEPTED_ERROR] * (min(speed / FULL_ERROR_SPEED, 1.0) + speed / DOUBLE_ERROR_SPEED)
        if divisions == 1 and speed > FULL_ERROR_SPEED and not estimate <= accepted + LEAST_ERROR:
            _copy(saved, row)
            divisions = int(options[OPTION_DIVISIONS])
            if divisions > 1:
                continue
        if not estimate <= OVERSHOOT * accepted + LEAST_ERROR:
            _copy(saved, row)
            _backward_euler_step(
                row, step / divisions, options, section, contact, coarse, effect_points, effect_addresses, parameters,
                memory,
            )  # fmt: skip
        done += 1
        _copy(row, saved)
