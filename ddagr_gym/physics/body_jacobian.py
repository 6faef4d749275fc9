"""Damping of the body's velocities and the bank speeds by the wheels' forces: the linear systems of the time step.

Where the bank speeds depend on the ground (:func:`moving_entries` is 5), they are eliminated: each bank's speed is
damped by itself and by the body's three velocities only, so that a 3 x 3 system is left (theory: wheel model, section
6.3; theory: drivetrain, eq. (6)).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import kernel, stack_array
from ddagr_gym.physics.body_dynamics import extra_forces, hub_x, hub_y, set_kinematics, side_slip_x, sum_extra
from ddagr_gym.physics.callbacks import EffectActions
from ddagr_gym.physics.drivetrain import bank_damping, felt_compliance, moving_entries
from ddagr_gym.physics.layout import (
    HALF_TRACK,
    LOAD,
    MASS,
    POINT_BODY_FORCES,
    POINT_WHEEL_FORCES,
    V_X,
    V_Y,
    WHEEL,
    YAW_INERTIA,
    YAW_RATE,
)
from ddagr_gym.physics.wheel_derivatives import change_of, relative_motion, stiffness_of

Array = NDArray[np.float64]

BANKS = 8
"""Of :func:`damping_inverse`'s ``banks``: d(bank acceleration)/d(v_x, v_y, yaw rate) right, left; own damping of both
(after the elimination 1/(1 - step damping))."""


@kernel()
def _add_torque_jacobian(row: Array, i: int, banks: Array) -> None:
    """Add how the torque of wheel ``i`` changes with the velocities and with its bank's speed [N m per their unit]."""
    x, y, bank = side_slip_x(row, i), hub_y(row, i), i % 2
    stiffness, speed = stiffness_of(row, i), relative_motion(row, i)[3]
    for direction in range(3):
        d_x = 1.0 / speed if direction == 0 else 0.0
        d_y = 1.0 / speed if direction == 1 else 0.0
        d_rim = (row[WHEEL + i] + row[WHEEL + 8 + i]) / speed if direction == 2 else 0.0
        settle = -change_of(row, i, 2, d_x, d_y, d_rim, 0.0) / stiffness
        torque = change_of(row, i, 4, d_x, d_y, d_rim, settle)
        if direction == 2:
            banks[6 + bank] += torque
            continue
        banks[3 * bank + direction] += torque
        banks[3 * bank + 2] += (x if direction == 1 else -y) * torque


@kernel()
def _eliminate_banks(row: Array, step: float, system: Array, drive: Array, banks: Array) -> None:
    """Take the bank speeds' part into the body's system ``I - step A`` (9,), and leave ``banks`` ready for use.

    Args:
        row: the environment.
        step: [s].
        system: (9,) row by row, changed.
        drive: (6,) accelerations by bank speed.
        banks: (BANKS,), written.
    """
    for j in range(BANKS):
        banks[j] = 0.0
    for i in range(4):
        if row[LOAD + i] > 0.0 and stiffness_of(row, i) > 0.0:
            _add_torque_jacobian(row, i, banks)
    for bank in range(2):
        compliance = felt_compliance(row, bank)
        for k in range(3):
            banks[3 * bank + k] *= compliance
        banks[6 + bank] *= compliance
        damping = min(banks[6 + bank], 0.0) + bank_damping(row, bank)
        banks[6 + bank] = 1.0 / (1.0 - step * damping)
        for j in range(3):
            for k in range(3):
                system[3 * j + k] -= step * step * drive[2 * j + bank] * banks[6 + bank] * banks[3 * bank + k]


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
        arm = side_slip_x(row, i) if direction == 1 else -y
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
def _add_effect_jacobian(row: Array, jacobian: Array, actions: EffectActions) -> None:
    """Forward differences of the effects' forces by the three velocities."""
    active = False
    for point in actions.points:
        active = active or point in (POINT_WHEEL_FORCES, POINT_BODY_FORCES)
    if not active:
        return
    base, moved = stack_array(3), stack_array(3)
    sum_extra(row, base)
    for direction in range(3):
        before = row[V_X + direction]
        step = 1e-4 * abs(before) + 1e-6
        row[V_X + direction] = before + step
        set_kinematics(row)
        extra_forces(row, actions)
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
def velocity_size(row: Array, motion: Array) -> float:
    """Largest velocity at the wheels of a (5,) motion, or of a change of one [m/s] (theory: wheel model, eq. (31))."""
    size = max(max(abs(motion[0]), abs(motion[1])), row[HALF_TRACK] * abs(motion[2]))
    if moving_entries(row) == 5:
        for bank in range(2):
            size = max(size, (row[WHEEL + bank] + row[WHEEL + 8 + bank]) * abs(motion[3 + bank]))
    return size


@kernel(inline=True)
def solve_body(inverse: Array, right: Array, solution: Array) -> None:
    """Inverse (9,), row by row, times a right side (3,), written to ``solution`` (3,)."""
    for j in range(3):
        solution[j] = inverse[3 * j] * right[0] + inverse[3 * j + 1] * right[1] + inverse[3 * j + 2] * right[2]


@kernel()
def solve_with_banks(step: float, inverse: Array, drive: Array, banks: Array, right: Array, solution: Array) -> None:
    """Solve (I - step A) solution = right for the velocities of the body and the speeds of dynamic banks.

    Args:
        step: that of :func:`damping_inverse` [s].
        inverse: (9,) from there.
        drive: (6,) from there.
        banks: (BANKS,) from there.
        right: (5,); of the first three, the banks' part is taken in.
        solution: (5,), written.
    """
    for bank in range(2):
        for j in range(3):
            right[j] += step * drive[2 * j + bank] * banks[6 + bank] * right[3 + bank]
    solve_body(inverse, right, solution)
    for bank in range(2):
        coupled = right[3 + bank]
        for j in range(3):
            coupled += step * banks[3 * bank + j] * solution[j]
        solution[3 + bank] = banks[6 + bank] * coupled


@kernel()
def damping_inverse(
    row: Array, step: float, inverse: Array, drive: Array, banks: Array, actions: EffectActions
) -> None:
    """(I - step A)^-1 of the body, A from the forces' Jacobian and the Coriolis terms, dynamic banks eliminated.

    Args:
        row: the environment.
        step: [s].
        inverse: (9,) row by row, written.
        drive: (6,) d(acceleration)/d(right, left bank speed), row by row, written.
        banks: (BANKS,), written where the banks are dynamic.
        actions: effects on this environment.
    """
    jacobian = stack_array(9)
    _wheel_jacobian(row, jacobian, drive)
    _add_effect_jacobian(row, jacobian, actions)
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
    if moving_entries(row) == 5:
        _eliminate_banks(row, step, jacobian, drive, banks)
    _invert(jacobian, inverse)
