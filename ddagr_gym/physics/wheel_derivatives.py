"""How a wheel's forces change with its motion: what predicts sinkages, forces and the integrator's Jacobian.

Forces depend on ratios of velocities only (theory: wheel model, eq. (29)). Derivatives are therefore kept by velocity
over speed, the speed of a wheel being the larger of |v_x| and |R0 omega|: they stay good while the robot gains speed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import kernel, stack_array
from ddagr_gym.physics.contact_patch import WRENCH, WheelMotion, wheel_wrench
from ddagr_gym.physics.layout import (
    BY_RIM,
    BY_SINKAGE,
    BY_V_X,
    BY_V_Y,
    DERIVATIVE,
    DERIVATIVE_AT,
    DERIVATIVE_SIZE,
    DERIVATIVE_VALID,
    SINKAGE,
    WHEEL,
    WHEEL_OMEGA,
    WHEEL_V_X,
    WHEEL_V_Y,
    YAW_RATE,
)
from ddagr_gym.physics.numerics import PatchNumerics

Array = NDArray[np.float64]

_SLOWEST = 1e-3  # [m/s], ours: below it forces depend on velocities, not on their ratios
_STEP = 1e-4  # of the speed and of the sinkage
_LARGEST_CHANGE = 0.1  # of the sinkage in one prediction, ours


@kernel(inline=True)
def motion_of(row: Array, i: int) -> WheelMotion:
    """Motion of wheel ``i`` as the last evaluation left it."""
    return WheelMotion(row[WHEEL_V_X + i], row[WHEEL_V_Y + i], row[WHEEL_OMEGA + i], row[YAW_RATE])


@kernel(inline=True)
def relative_motion(row: Array, i: int) -> tuple[float, float, float, float]:
    """(v_x, v_y, R0 omega)/speed of wheel ``i``, and its speed [m/s], from the kinematics in ``row``."""
    rim = (row[WHEEL + i] + row[WHEEL + 8 + i]) * row[WHEEL_OMEGA + i]
    speed = max(max(abs(row[WHEEL_V_X + i]), abs(rim)), _SLOWEST)
    return row[WHEEL_V_X + i] / speed, row[WHEEL_V_Y + i] / speed, rim / speed, speed


@kernel(inline=True)
def stiffness_of(row: Array, i: int) -> float:
    """d F_z / d sinkage [N/m]; 0 where unknown."""
    return row[DERIVATIVE + DERIVATIVE_SIZE * i + BY_SINKAGE + 2] * row[DERIVATIVE_VALID]


@kernel(inline=True)
def change_of(row: Array, i: int, component: int, d_x: float, d_y: float, d_rim: float, d_sinkage: float) -> float:
    """First-order change of a component of the wrench with relative motion and sinkage [m]."""
    d = DERIVATIVE + DERIVATIVE_SIZE * i + component
    return row[d + BY_V_X] * d_x + row[d + BY_V_Y] * d_y + row[d + BY_RIM] * d_rim + row[d + BY_SINKAGE] * d_sinkage


@kernel()
def predict_sinkage(row: Array, i: int, v_x: float, v_y: float, rim: float) -> None:
    """Move the sinkage, which belongs to the relative motion given, to where it carries the same load now."""
    stiffness = stiffness_of(row, i)
    if not stiffness > 0.0:
        return
    new_x, new_y, new_rim, _ = relative_motion(row, i)
    limit = _LARGEST_CHANGE * row[SINKAGE + i]
    change = -change_of(row, i, 2, new_x - v_x, new_y - v_y, new_rim - rim, 0.0) / stiffness
    row[SINKAGE + i] += min(max(change, -limit), limit)


@kernel()
def is_stale(row: Array, i: int, refresh: float) -> bool:
    """Whether relative motion or sinkage has changed by more than ``refresh`` since the derivative was taken."""
    v_x, v_y, rim, _ = relative_motion(row, i)
    at = DERIVATIVE_AT + 4 * i
    limit = refresh * max(abs(v_x), abs(rim))
    return (
        row[DERIVATIVE_VALID] == 0.0
        or abs(v_x - row[at]) > limit
        or abs(v_y - row[at + 1]) > limit
        or abs(rim - row[at + 2]) > limit
        or abs(row[SINKAGE + i] - row[at + 3]) > refresh * row[SINKAGE + i]
    )


@kernel()
def refresh_derivative(row: Array, i: int, wheel: Array, soil: Array, numerics: PatchNumerics) -> None:
    """Forward differences of wheel ``i``'s wrench.

    Args:
        row: reads kinematics and sinkage, writes the derivative.
        i: wheel.
        wheel: (3,) its geometry.
        soil: (9,) under it.
        numerics: quadrature; a coarse one is enough.
    """
    motion = motion_of(row, i)
    sinkage = row[SINKAGE + i]
    x, y, rim, speed = relative_motion(row, i)
    base = stack_array(WRENCH)
    moved = stack_array(WRENCH)
    wheel_wrench(wheel, soil, motion, sinkage, numerics, base)
    first = DERIVATIVE + DERIVATIVE_SIZE * i
    for direction in (BY_V_X, BY_V_Y, BY_RIM, BY_SINKAGE):
        d_x = _STEP * speed if direction == BY_V_X else 0.0
        d_y = _STEP * speed if direction == BY_V_Y else 0.0
        d_omega = _STEP * speed / (wheel[0] + wheel[2]) if direction == BY_RIM else 0.0
        d_sinkage = -_STEP * sinkage if direction == BY_SINKAGE else 0.0
        changed = WheelMotion(motion.v_x + d_x, motion.v_y + d_y, motion.omega + d_omega, motion.yaw_rate)
        wheel_wrench(wheel, soil, changed, sinkage + d_sinkage, numerics, moved)
        scale = 1.0 / (d_sinkage if direction == BY_SINKAGE else _STEP)
        for j in range(WRENCH):
            row[first + direction + j] = scale * (moved[j] - base[j])
    at = DERIVATIVE_AT + 4 * i
    row[at], row[at + 1], row[at + 2], row[at + 3] = x, y, rim, sinkage
