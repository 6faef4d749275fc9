"""How the state moves: rigid body on the plane, bank speeds, constant logs and biases.

    dv_x/dt      = F_x/m + yaw_rate v_y + slope_x
    dv_y/dt      = F_y/m - yaw_rate v_x + slope_y
    dyaw_rate/dt = M/I
    domega/dt    = k_omega (command - omega)           per bank (4.11)

with ``F_x, F_y, M`` the sums over the wheels of :mod:`~ddagr_gym.estimation.force_laws` (4.6), (4.7), (4.10) in
consistent signs (theory: filter, eq. (5)), the centre of mass at the body origin, and slope the gravity along the body
axes (6.3).

Integration. Damping reaches 1e3 1/s near a locked wheel, so that a step of 8 ms must not be explicit. The bank speeds
have an exact solution. For the velocities v, with f and A = df/dv at the start of a step h and the bank speeds at its
middle, and g = 1 - 1/sqrt(2),

    v+ = v + h psi(hA) f,   psi(z) = (1 - g^2 z)/(1 - g z)^2

is second order and L-stable (1 + z psi(z) is the stability function of ROS2). The same ``G = h psi(hA)`` gives the
transition matrix (``I + G A``, and ``G`` times the derivative of f by bank speeds and parameters) and the effect of an
acceleration that is constant over the step: state, covariance and process noise share one scheme. The derivatives of
A are left out of the transition matrix, as in any extended Kalman filter. Theory: filter, eq. (6), (7).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.estimation.force_laws import LawParameters, wheel_law
from ddagr_gym.estimation.layout import (
    FORCE,
    GRADIENT,
    HALF_TRACK,
    HALF_WHEELBASE,
    LAW,
    MASS,
    MOTOR_RATE,
    OMEGA,
    OUTER_RADIUS,
    PARAMETER,
    RESPONSE,
    REST_SPEED,
    REVERSAL_SPEED,
    STATE_SIZE,
    STRIDE,
    TRANSITION,
    YAW_INERTIA,
    X,
)
from ddagr_gym.jit import kernel

Array = NDArray[np.float64]

_GAMMA = 1.0 - 1.0 / math.sqrt(2.0)  # L-stable: theory: filter, eq. (6)
_LEAST_DETERMINANT = 1e-9  # of I - gamma h A, which is 1 without damping and grows with it (ours: no division by 0)

_Bank = tuple[
    float, float, float, float, float, float, float, float, float, float, float, float, float, float,
    float, float, float, float, float, float, float, float, float, float, float, float, float,
]  # fmt: skip


@kernel(inline=True)
def _bank_forces(
    model: Array, v_x: float, v_front: float, v_rear: float, rim: float, y: float,
    limit: float, rate: float, stiffness: float, resistance: float,
) -> _Bank:  # fmt: skip
    """Force x, force y, moment of one bank, and their derivatives by v_x, v_y, yaw rate, rim and four logs.

    The hubs stand at (+-L, y) and move with v_x = v_x,body - yaw_rate y and v_y = v_y,body +- yaw_rate L.
    """
    length = model[HALF_WHEELBASE]
    parameters = LawParameters(limit, rate, stiffness, resistance, model[REST_SPEED], model[REVERSAL_SPEED])
    a = wheel_law(model[LAW], v_x, v_front, rim, parameters)
    b = wheel_law(model[LAW], v_x, v_rear, rim, parameters)
    x_v, y_v = a[1] + b[1], a[9] + b[9]
    x_w, y_w = a[2] + b[2], a[10] + b[10]
    x_turn = length * (a[2] - b[2]) - y * x_v
    y_turn = length * (a[10] - b[10]) - y * y_v
    moment_v = length * (a[9] - b[9]) - y * x_v
    moment_w = length * (a[10] - b[10]) - y * x_w
    moment_turn = length * (length * y_w - y * (a[9] - b[9])) - y * x_turn
    return (
        a[0] + b[0], x_v, x_w, x_turn, a[3] + b[3], a[4] + b[4], a[5] + b[5], a[6] + b[6], a[7] + b[7],
        a[8] + b[8], y_v, y_w, y_turn, a[11] + b[11], a[12] + b[12], a[13] + b[13], a[14] + b[14], a[15] + b[15],
        length * (a[8] - b[8]) - y * (a[0] + b[0]), moment_v, moment_w, moment_turn,
        length * (a[11] - b[11]) - y * (a[3] + b[3]), length * (a[12] - b[12]) - y * (a[4] + b[4]),
        length * (a[13] - b[13]) - y * (a[5] + b[5]), length * (a[14] - b[14]) - y * (a[6] + b[6]),
        length * (a[15] - b[15]) - y * (a[7] + b[7]),
    )  # fmt: skip


@kernel()
def body_forces(model: Array, work: Array) -> None:
    """Specific force and yaw acceleration, and their derivatives by the motion entries of the state.

    Args:
        model: packed model.
        work: workspace with the state; FORCE holds force x, y per mass [m/s^2] and moment per inertia [rad/s^2]
            afterwards, the rows of GRADIENT their derivatives by state entries 0 to MOTION_SIZE - 1.
    """
    length, width, radius = model[HALF_WHEELBASE], model[HALF_TRACK], model[OUTER_RADIUS]
    limit, rate = math.exp(work[X + PARAMETER]), math.exp(work[X + PARAMETER + 1])
    stiffness, resistance = math.exp(work[X + PARAMETER + 2]), math.exp(work[X + PARAMETER + 3])
    v_x, turn = work[X], work[X + 2]
    front, rear = work[X + 1] + turn * length, work[X + 1] - turn * length
    right = _bank_forces(
        model, v_x + turn * width, front, rear, radius * work[X + OMEGA], -width, limit, rate, stiffness, resistance
    )
    left = _bank_forces(
        model, v_x - turn * width, front, rear, radius * work[X + OMEGA + 1], width, limit, rate, stiffness, resistance
    )
    for row in range(3):
        scale = 1.0 / (model[YAW_INERTIA] if row == 2 else model[MASS])
        first = 9 * row
        work[FORCE + row] = scale * (right[first] + left[first])
        base = GRADIENT + STRIDE * row
        work[base] = scale * (right[first + 1] + left[first + 1])
        work[base + 1] = scale * (right[first + 2] + left[first + 2])
        work[base + 2] = scale * (right[first + 3] + left[first + 3])
        work[base + 3] = scale * radius * right[first + 4]
        work[base + 4] = scale * radius * left[first + 4]
        work[base + 5] = scale * (right[first + 5] + left[first + 5])
        work[base + 6] = scale * (right[first + 6] + left[first + 6])
        work[base + 7] = scale * (right[first + 7] + left[first + 7])
        work[base + 8] = scale * (right[first + 8] + left[first + 8])


@kernel(inline=True)
def _respond(step: float, work: Array) -> None:
    """Write ``G = h psi(hA)`` to RESPONSE, from A in the first three columns of GRADIENT."""
    h = _GAMMA * step
    a, b, c = GRADIENT, GRADIENT + STRIDE, GRADIENT + 2 * STRIDE
    m00, m01, m02 = 1.0 - h * work[a], -h * work[a + 1], -h * work[a + 2]
    m10, m11, m12 = -h * work[b], 1.0 - h * work[b + 1], -h * work[b + 2]
    m20, m21, m22 = -h * work[c], -h * work[c + 1], 1.0 - h * work[c + 2]
    c0, c1, c2 = m11 * m22 - m12 * m21, m12 * m20 - m10 * m22, m10 * m21 - m11 * m20
    determinant = m00 * c0 + m01 * c1 + m02 * c2
    if abs(determinant) < _LEAST_DETERMINANT:
        determinant = math.copysign(_LEAST_DETERMINANT, determinant)
    scale = 1.0 / determinant
    i00, i01, i02 = scale * c0, scale * (m02 * m21 - m01 * m22), scale * (m01 * m12 - m02 * m11)
    i10, i11, i12 = scale * c1, scale * (m00 * m22 - m02 * m20), scale * (m02 * m10 - m00 * m12)
    i20, i21, i22 = scale * c2, scale * (m01 * m20 - m00 * m21), scale * (m00 * m11 - m01 * m10)
    # psi = W^-1 ((1 - g) W^-1 + g) with W = 1 - g h A
    twice, once = step * (1.0 - _GAMMA), step * _GAMMA
    a, b, c = RESPONSE, RESPONSE + STRIDE, RESPONSE + 2 * STRIDE
    work[a] = twice * (i00 * i00 + i01 * i10 + i02 * i20) + once * i00
    work[a + 1] = twice * (i00 * i01 + i01 * i11 + i02 * i21) + once * i01
    work[a + 2] = twice * (i00 * i02 + i01 * i12 + i02 * i22) + once * i02
    work[b] = twice * (i10 * i00 + i11 * i10 + i12 * i20) + once * i10
    work[b + 1] = twice * (i10 * i01 + i11 * i11 + i12 * i21) + once * i11
    work[b + 2] = twice * (i10 * i02 + i11 * i12 + i12 * i22) + once * i12
    work[c] = twice * (i20 * i00 + i21 * i10 + i22 * i20) + once * i20
    work[c + 1] = twice * (i20 * i01 + i21 * i11 + i22 * i21) + once * i21
    work[c + 2] = twice * (i20 * i02 + i21 * i12 + i22 * i22) + once * i22


@kernel(inline=True)
def half_decay(model: Array, command: float, step: float) -> float:
    """Factor of a bank's deviation from its command over half a step; 1 where the command is not known."""
    return math.exp(-0.5 * model[MOTOR_RATE] * step) if math.isfinite(command) else 1.0


@kernel(inline=True)
def advance_banks(work: Array, right: float, left: float, decay_right: float, decay_left: float) -> None:
    """Bank speeds after a time over which their lag shrinks by the decays; 1 where the command is not known."""
    if decay_right < 1.0:
        work[X + OMEGA] = right + (work[X + OMEGA] - right) * decay_right
    if decay_left < 1.0:
        work[X + OMEGA + 1] = left + (work[X + OMEGA + 1] - left) * decay_left


@kernel()
def advance_state(
    model: Array, work: Array, right: float, left: float, slope_x: float, slope_y: float, step: float
) -> tuple[float, float]:
    """Advance the state by one step and leave its transition behind.

    Args:
        model: packed model.
        work: workspace with the state, which is updated; TRANSITION holds the velocities' transition by the motion
            entries afterwards, RESPONSE the response G.
        right: speed command of the right bank [rad/s]; not finite: unknown, the bank keeps its speed.
        left: of the left bank.
        slope_x: gravity along body x [m/s^2].
        slope_y: gravity along body y [m/s^2].
        step: h [s].

    Returns:
        Factors by which deviations of the bank speeds shrink over the step, right and left.
    """
    half_right, half_left = half_decay(model, right, step), half_decay(model, left, step)
    advance_banks(work, right, left, half_right, half_left)
    body_forces(model, work)
    v_x, v_y, turn = work[X], work[X + 1], work[X + 2]
    f_x = work[FORCE] + turn * v_y + slope_x
    f_y = work[FORCE + 1] - turn * v_x + slope_y
    f_turn = work[FORCE + 2]
    work[GRADIENT + 1] += turn
    work[GRADIENT + 2] += v_y
    work[GRADIENT + STRIDE] -= turn
    work[GRADIENT + STRIDE + 2] -= v_x
    _respond(step, work)
    for i in range(3):
        base = RESPONSE + STRIDE * i
        g_x, g_y, g_turn = work[base], work[base + 1], work[base + 2]
        work[X + i] += g_x * f_x + g_y * f_y + g_turn * f_turn
        base = TRANSITION + STRIDE * i
        for j in range(STATE_SIZE):
            work[base + j] = (
                g_x * work[GRADIENT + j] + g_y * work[GRADIENT + STRIDE + j] + g_turn * work[GRADIENT + 2 * STRIDE + j]
            )
        work[base + i] += 1.0
        work[base + OMEGA] *= half_right
        work[base + OMEGA + 1] *= half_left
    advance_banks(work, right, left, half_right, half_left)
    return half_right * half_right, half_left * half_left
