"""Backward Euler steps of the body, for where the linearised step overshoots (theory: wheel model, eq. (32), (33)).

Friction is monotone in the velocity, so the work of the defect along a Newton step falls with the length of the step
(exactly so with the centre of mass at the origin), and the length at which it vanishes is sought: a Newton step as such
is far too long across a change of friction's sign, and far too short where the derivative was taken across one.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import kernel, stack_array
from ddagr_gym.physics.body_dynamics import evaluate_forces, world_rates
from ddagr_gym.physics.body_jacobian import BANKS, damping_inverse, solve_body, solve_with_banks, velocity_size
from ddagr_gym.physics.callbacks import EffectActions
from ddagr_gym.physics.drivetrain import (
    advance_motors,
    bank_acceleration,
    bank_inertia,
    integral_growth,
    moving_entries,
)
from ddagr_gym.physics.layout import (
    ACCELERATION,
    INTEGRAL,
    MASS,
    OMEGA,
    TIME,
    V_X,
    WHEEL_ANGLE,
    YAW,
    YAW_INERTIA,
    YAW_RATE,
    X,
    Y,
)
from ddagr_gym.physics.numerics import StepNumerics

Array = NDArray[np.float64]

NEWTON_ITERATIONS = 15  # at most (ours): each leaves at most half of the work along its step
LENGTHS = 12  # of a Newton step that are tried
LEFT_WORK = 0.5  # share of the work before a Newton step that may be left after it
LONGEST = 30.0  # length of a Newton step that is tried
STUCK = 0.01  # of the tolerance (ours): a step that moves by less leads nowhere


@kernel(inline=True)
def _set_defect(row: Array, start: Array, step: float, defect: Array) -> None:
    """v - v_n - h f(v) of backward Euler."""
    for j in range(3):
        defect[j] = row[V_X + j] - start[j] - step * row[ACCELERATION + j]
    if moving_entries(row) == 5:
        for bank in range(2):
            defect[3 + bank] = row[OMEGA + bank] - start[3 + bank] - step * bank_acceleration(row, bank)


@kernel(inline=True)
def _work(row: Array, defect: Array, change: Array) -> float:
    """Inertia times velocity of the defect along a change of the motion."""
    work = row[MASS] * (defect[0] * change[0] + defect[1] * change[1]) + row[YAW_INERTIA] * defect[2] * change[2]
    if moving_entries(row) == 5:
        for bank in range(2):
            work += bank_inertia(row) * defect[3 + bank] * change[3 + bank]
    return work


@kernel()
def _newton_step(
    row: Array, start: Array, defect: Array, change: Array, step: float, numerics: StepNumerics, actions: EffectActions
) -> float:
    """Move along ``change`` until the residual, ``defect``, is orthogonal to it (false position, Illinois).

    Returns the length of the move in steps, 0 where none has finite forces.

    Args:
        row: the environment; moved.
        start: (5,) motion at the start of the time step, the bank speeds last.
        defect: (5,) at the present motion, overwritten.
        change: (5,) what is taken off the motion; the defect does work along it.
        step: h [s].
        numerics: accuracy.
        actions: effects on this environment.
    """
    before, moving = stack_array(5), moving_entries(row)
    for j in range(moving):
        before[j] = row[V_X + j]
    whole = _work(row, defect, change)
    low, at_low, high, at_high, length, work = 0.0, whole, 0.0, 0.0, 1.0, whole
    for _ in range(LENGTHS):
        for j in range(moving):
            row[V_X + j] = before[j] - length * change[j]
        evaluate_forces(row, -1.0, numerics, actions)
        _set_defect(row, start, step, defect)
        work = _work(row, defect, change)
        if abs(work) <= LEFT_WORK * whole:
            break
        if math.isfinite(work) and work > 0.0 and high == 0.0:
            if length >= LONGEST:
                break
            further = work * (length - low) / (at_low - work) if at_low > work else LONGEST
            low, at_low = length, work
            length = min(length + further, LONGEST)
            continue
        if not math.isfinite(work):
            high, at_high = length, -at_low
        elif work > 0.0:
            low, at_low, at_high = length, work, 0.5 * at_high
        else:
            high, at_high, at_low = length, work, 0.5 * at_low
        length = (low * at_high - high * at_low) / (at_high - at_low)
    if not math.isfinite(work):
        for j in range(moving):
            row[V_X + j] = before[j]
        return 0.0
    return length


@kernel()
def backward_euler_step(
    row: Array, step: float, tolerance: float, numerics: StepNumerics, actions: EffectActions
) -> None:
    """One backward Euler step.

    Args:
        row: of the environment, with the forces at its present state; left with those at the new one.
        step: h [s].
        tolerance: of the defect [m/s], above which the iteration goes on.
        numerics: accuracy.
        actions: effects on this environment.
    """
    inverse, drive, banks = stack_array(9), stack_array(6), stack_array(BANKS)
    start, defect, right, change = stack_array(5), stack_array(5), stack_array(5), stack_array(5)
    moving = moving_entries(row)
    for j in range(5):
        start[j] = row[V_X + j]
    if moving == 3:
        advance_motors(row, step)
    row[TIME] += step
    stuck = False
    for _ in range(NEWTON_ITERATIONS):
        evaluate_forces(row, 0.0, numerics, actions)
        _set_defect(row, start, step, defect)
        if velocity_size(row, defect) <= tolerance:
            break
        damping_inverse(row, step, inverse, drive, banks, actions)
        for j in range(moving):
            right[j] = defect[j]
        if moving == 5:
            solve_with_banks(step, inverse, drive, banks, right, change)
        else:
            solve_body(inverse, right, change)
        if stuck or not _work(row, defect, change) > 0.0:
            for j in range(moving):
                change[j] = defect[j]  # which does work whatever the derivative says
        length = _newton_step(row, start, defect, change, step, numerics, actions)
        before, stuck = stuck, length * velocity_size(row, change) <= STUCK * tolerance
        if before and stuck:
            break
    rate_x, rate_y = world_rates(row)
    row[X] += step * rate_x
    row[Y] += step * rate_y
    row[YAW] += step * row[YAW_RATE]
    if moving == 5:
        for bank in range(2):
            row[WHEEL_ANGLE + bank] += step * row[OMEGA + bank]
            row[INTEGRAL + bank] += step * integral_growth(row, bank)
    evaluate_forces(row, 0.0, numerics, actions)
