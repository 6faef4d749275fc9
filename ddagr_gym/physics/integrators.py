"""Time step of the body: a two-stage, second-order, linearly implicit W-method.

    (I - gamma h A) k1 = h f(t_n, y_n) + gamma h^2 f_t
    (I - gamma h A) k2 = h f(t_n + h, y_n + k1) - 2 k1 - gamma h^2 f_t
    y_{n+1} = y_n + 3/2 k1 + 1/2 k2

with gamma = 1 - 1/sqrt(2) (Verwer, Spee, Blom and Hundsdorfer, SIAM J. Sci. Comput. 20 (1999) 1456, eq. 2.7). It
is L-stable with the exact Jacobian A and of order two with any A, so A may be coarse and kept over steps; it acts
on the three velocities, where the stiffness is (physics.md section 6). Bank speeds are solved exactly; their change
enters through f_t, without which the robot would lag behind its wheels when it creeps.

Near rest friction saturates within micrometres per second and a linearised step can overshoot to the other side. The
embedded first-order solution y_n + k1 shows it; such a step is redone by backward Euler with damped Newton
iterations, which cannot overshoot because friction is monotone in the velocity.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import kernel
from ddagr_gym.physics.body_dynamics import (
    evaluate_forces,
    extra_forces,
    hub_x,
    hub_y,
    set_kinematics,
    sum_extra,
)
from ddagr_gym.physics.drivetrain import advance_motors
from ddagr_gym.physics.layout import (
    ACCELERATION,
    DERIVATIVE,
    HALF_TRACK,
    LOAD,
    MASS,
    MOTOR_RATE,
    MOTOR_TARGET,
    OMEGA,
    POINT_BODY_FORCES,
    POINT_WHEEL_FORCES,
    TIME,
    V_X,
    V_Y,
    WHEEL,
    WHEEL_V_X,
    YAW,
    YAW_INERTIA,
    YAW_RATE,
    X,
    Y,
)

Array = NDArray[np.float64]

GAMMA = 1.0 - 1.0 / math.sqrt(2.0)
NEWTON_ITERATIONS = 40
NEWTON_TOLERANCE = 1e-9  # [m/s]
HALVINGS = 12
LEAST_OMEGA = 1e-6  # [rad/s], below which a bank's drift is left out
RELATIVE_ERROR = 0.01  # of the speed, accepted besides Numerics.accepted_error
FULL_ERROR_SPEED = 0.02  # [m/s], below which less is accepted: a robot that stands on a slope would chatter
LEAST_ERROR = 1e-6  # [m/s], accepted at rest


@kernel()
def _wheel_jacobian(row: Array, jacobian: Array, drift: Array) -> None:
    """d(F_x, F_y, M_z)/d(v_x, v_y, yaw rate) of all wheels, the sinkage following its load, and their drift d/dt.

    The drift comes from the bank speeds. Forces depend on ratios of velocities only, so by Euler's theorem
    omega dF/d omega = -(v_x dF/dv_x + v_y dF/dv_y), the small part of the yaw rate left out.
    """
    jacobian[:, :] = 0.0
    drift[:3] = 0.0
    for i in range(4):
        d = DERIVATIVE + 15 * i
        stiffness = row[d + 12]
        if row[LOAD + i] <= 0.0 or stiffness <= 0.0:
            continue
        x = hub_x(row, i)
        y = hub_y(row, i)
        bank = i % 2
        omega = row[OMEGA + bank]
        change = row[MOTOR_RATE + bank] * (row[MOTOR_TARGET + bank] - omega)
        relative = -change / omega if abs(omega) > LEAST_OMEGA else 0.0
        for direction in range(2):
            settle = row[d + 5 * direction + 2] / stiffness
            f_x = row[d + 5 * direction] - settle * row[d + 10]
            f_y = row[d + 5 * direction + 1] - settle * row[d + 11]
            m_z = row[d + 5 * direction + 3] - settle * row[d + 13]
            moment = x * f_y - y * f_x + m_z
            arm = x if direction == 1 else -y
            speed = relative * row[WHEEL_V_X + 4 * direction + i]
            drift[0] += speed * f_x
            drift[1] += speed * f_y
            drift[2] += speed * moment
            jacobian[0, direction] += f_x
            jacobian[1, direction] += f_y
            jacobian[2, direction] += moment
            jacobian[0, 2] += arm * f_x
            jacobian[1, 2] += arm * f_y
            jacobian[2, 2] += arm * moment


@kernel()
def _add_effect_jacobian(
    row: Array, jacobian: Array, effect_points: NDArray[np.int64], effect_addresses: NDArray[np.int64],
    parameters: Array, memory: Array, base: Array, moved: Array,
) -> None:  # fmt: skip
    """Forward differences of the effects' forces by the three velocities."""
    active = False
    for k in range(effect_points.shape[0]):
        active = active or effect_points[k] == POINT_WHEEL_FORCES or effect_points[k] == POINT_BODY_FORCES
    if not active:
        return
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
            jacobian[j, direction] += (moved[j] - base[j]) / step
    set_kinematics(row)


@kernel()
def _invert(matrix: Array, inverse: Array) -> None:
    """Inverse of a 3 x 3 matrix by cofactors."""
    a, b, c = matrix[0, 0], matrix[0, 1], matrix[0, 2]
    d, e, f = matrix[1, 0], matrix[1, 1], matrix[1, 2]
    g, h, i = matrix[2, 0], matrix[2, 1], matrix[2, 2]
    scale = 1.0 / (a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g))
    inverse[0, 0], inverse[0, 1], inverse[0, 2] = (
        (e * i - f * h) * scale,
        (c * h - b * i) * scale,
        (b * f - c * e) * scale,
    )
    inverse[1, 0], inverse[1, 1], inverse[1, 2] = (
        (f * g - d * i) * scale,
        (a * i - c * g) * scale,
        (c * d - a * f) * scale,
    )
    inverse[2, 0], inverse[2, 1], inverse[2, 2] = (
        (d * h - e * g) * scale,
        (b * g - a * h) * scale,
        (a * e - b * d) * scale,
    )


@kernel()
def _damping_inverse(row: Array, step: float, jacobian: Array, inverse: Array) -> None:
    """(I - step A)^-1, A from the force Jacobian and the Coriolis terms."""
    for direction in range(3):
        jacobian[0, direction] /= row[MASS]
        jacobian[1, direction] /= row[MASS]
        jacobian[2, direction] /= row[YAW_INERTIA]
    jacobian[0, 1] += row[YAW_RATE]
    jacobian[0, 2] += row[V_Y]
    jacobian[1, 0] -= row[YAW_RATE]
    jacobian[1, 2] -= row[V_X]
    for j in range(3):
        for k in range(3):
            jacobian[j, k] *= -step
        jacobian[j, j] += 1.0
    _invert(jacobian, inverse)


@kernel()
def _w_step(
    row: Array, step: float, refresh: float, tolerance: float, shear_rate: float, rest_speed: float, section: Array,
    contact: Array, coarse: Array, workspace: Array, scratch: Array, jacobian: Array, inverse: Array,
    effect_points: NDArray[np.int64], effect_addresses: NDArray[np.int64], parameters: Array, memory: Array,
) -> float:  # fmt: skip
    """One W-step; returns the size of the embedded error estimate [m/s]. Arguments as :func:`advance_body`."""
    start, first, second = scratch[4], scratch[5], scratch[6]
    drift = scratch[3]
    _wheel_jacobian(row, jacobian, drift)
    _add_effect_jacobian(
        row, jacobian, effect_points, effect_addresses, parameters, memory, scratch[6], scratch[7]
    )  # fmt: skip
    _damping_inverse(row, GAMMA * step, jacobian, inverse)
    drift_x = GAMMA * step * step * drift[0] / row[MASS]
    drift_y = GAMMA * step * step * drift[1] / row[MASS]
    drift_yaw = GAMMA * step * step * drift[2] / row[YAW_INERTIA]
    right_x = step * row[ACCELERATION] + drift_x
    right_y = step * row[ACCELERATION + 1] + drift_y
    right_yaw = step * row[ACCELERATION + 2] + drift_yaw
    for j in range(3):
        start[j] = row[V_X + j]
        first[j] = inverse[j, 0] * right_x + inverse[j, 1] * right_y + inverse[j, 2] * right_yaw
    start[3], start[4], start[5] = row[X], row[Y], row[YAW]
    first[3] = step * (row[V_X] * math.cos(row[YAW]) - row[V_Y] * math.sin(row[YAW]))
    first[4] = step * (row[V_X] * math.sin(row[YAW]) + row[V_Y] * math.cos(row[YAW]))
    first[5] = step * row[YAW_RATE]
    for j in range(3):
        row[V_X + j] = start[j] + first[j]
    row[YAW] = start[5] + first[5]
    advance_motors(row, step)
    row[TIME] += step
    evaluate_forces(
        row, -1.0, tolerance, shear_rate, rest_speed, section, contact, coarse, workspace, scratch, effect_points,
        effect_addresses, parameters, memory,
    )  # fmt: skip
    second[0] = step * row[ACCELERATION] - 2.0 * first[0] - drift_x
    second[1] = step * row[ACCELERATION + 1] - 2.0 * first[1] - drift_y
    second[2] = step * row[ACCELERATION + 2] - 2.0 * first[2] - drift_yaw
    rate_x = row[V_X] * math.cos(row[YAW]) - row[V_Y] * math.sin(row[YAW])
    rate_y = row[V_X] * math.sin(row[YAW]) + row[V_Y] * math.cos(row[YAW])
    rate_yaw = row[YAW_RATE]
    estimate = 0.0
    for j in range(3):
        second_j = inverse[j, 0] * second[0] + inverse[j, 1] * second[1] + inverse[j, 2] * second[2]
        row[V_X + j] = start[j] + 1.5 * first[j] + 0.5 * second_j
        weight = row[HALF_TRACK] if j == 2 else 1.0
        estimate = max(estimate, 0.5 * weight * abs(first[j] + second_j))
    # with A = 0 the method is Heun's
    row[X] = start[3] + 0.5 * (first[3] + step * rate_x)
    row[Y] = start[4] + 0.5 * (first[4] + step * rate_y)
    row[YAW] = start[5] + 0.5 * (first[5] + step * rate_yaw)
    evaluate_forces(
        row, refresh, tolerance, shear_rate, rest_speed, section, contact, coarse, workspace, scratch, effect_points,
        effect_addresses, parameters, memory,
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
    row: Array, step: float, tolerance: float, shear_rate: float, rest_speed: float, section: Array, contact: Array,
    coarse: Array, workspace: Array, scratch: Array, jacobian: Array, inverse: Array,
    effect_points: NDArray[np.int64], effect_addresses: NDArray[np.int64], parameters: Array, memory: Array,
) -> None:  # fmt: skip
    """One backward Euler step with damped Newton iterations. Arguments as :func:`advance_body`."""
    start, defect, change, before = scratch[4], scratch[5], scratch[6], scratch[7]
    for j in range(3):
        start[j] = row[V_X + j]
    advance_motors(row, step)
    row[TIME] += step
    for _ in range(NEWTON_ITERATIONS):
        evaluate_forces(
            row, 0.0, tolerance, shear_rate, rest_speed, section, contact, coarse, workspace, scratch, effect_points,
            effect_addresses, parameters, memory,
        )  # fmt: skip
        size = _defect(row, start, step, defect)
        if size <= NEWTON_TOLERANCE:
            break
        _wheel_jacobian(row, jacobian, change)
        _add_effect_jacobian(
            row, jacobian, effect_points, effect_addresses, parameters, memory, change, before
        )  # fmt: skip
        _damping_inverse(row, step, jacobian, inverse)
        for j in range(3):
            change[j] = inverse[j, 0] * defect[0] + inverse[j, 1] * defect[1] + inverse[j, 2] * defect[2]
            before[j] = row[V_X + j]
        damping = 1.0
        for _ in range(HALVINGS):
            for j in range(3):
                row[V_X + j] = before[j] - damping * change[j]
            evaluate_forces(
                row, -1.0, tolerance, shear_rate, rest_speed, section, contact, coarse, workspace, scratch,
                effect_points, effect_addresses, parameters, memory,
            )  # fmt: skip
            if _defect(row, start, step, defect) < size:
                break
            damping *= 0.5
    cosine = math.cos(row[YAW])
    sine = math.sin(row[YAW])
    row[X] += step * (row[V_X] * cosine - row[V_Y] * sine)
    row[Y] += step * (row[V_X] * sine + row[V_Y] * cosine)
    row[YAW] += step * row[YAW_RATE]
    evaluate_forces(
        row, 0.0, tolerance, shear_rate, rest_speed, section, contact, coarse, workspace, scratch, effect_points,
        effect_addresses, parameters, memory,
    )  # fmt: skip


@kernel(inline=True)
def _fastest(row: Array) -> float:
    """Largest of the body's and the rims' speeds [m/s]."""
    speed = max(abs(row[V_X]), abs(row[V_Y]))
    for bank in range(2):
        speed = max(speed, abs(row[OMEGA + bank]) * (row[WHEEL + bank] + row[WHEEL + 8 + bank]))
    return speed


@kernel()
def advance_body(
    row: Array, step: float, refresh: float, tolerance: float, shear_rate: float, rest_speed: float,
    accepted_error: float, section: Array, contact: Array, coarse: Array, workspace: Array, scratch: Array,
    jacobian: Array, inverse: Array, saved: Array, effect_points: NDArray[np.int64],
    effect_addresses: NDArray[np.int64], parameters: Array, memory: Array,
) -> None:  # fmt: skip
    """One step. Needs the forces at the present state in ``row`` and leaves those at the new one.

    Args:
        row: the environment.
        step: h [s].
        refresh: as in :func:`evaluate_forces`, and the following up to ``scratch``.
        tolerance: see there.
        shear_rate: see there.
        rest_speed: see there.
        accepted_error: embedded error estimate of a moving robot above which the step is redone [m/s].
        section: see there.
        contact: see there.
        coarse: see there.
        workspace: see there.
        scratch: (8, 8): four vectors for the forces, four for this step.
        jacobian: (3, 3), overwritten.
        inverse: (3, 3), overwritten.
        saved: (layout.SIZE,), overwritten.
        effect_points: as in :func:`apply_effects`, and the following.
        effect_addresses: see there.
        parameters: see there.
        memory: see there.
    """
    saved[:] = row
    estimate = _w_step(
        row, step, refresh, tolerance, shear_rate, rest_speed, section, contact, coarse, workspace, scratch, jacobian,
        inverse, effect_points, effect_addresses, parameters, memory,
    )  # fmt: skip
    speed = _fastest(row)
    accepted = accepted_error * min(speed / FULL_ERROR_SPEED, 1.0) + RELATIVE_ERROR * speed + LEAST_ERROR
    if not estimate <= accepted:
        row[:] = saved
        _backward_euler_step(
            row, step, tolerance, shear_rate, rest_speed, section, contact, coarse, workspace, scratch, jacobian,
            inverse, effect_points, effect_addresses, parameters, memory,
        )  # fmt: skip
