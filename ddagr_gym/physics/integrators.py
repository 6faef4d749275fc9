"""Time step of the body: a two-stage, second-order, linearly implicit W-method.

    (I - gamma h A) k1 = h f(t_n, y_n) + gamma h^2 f_t
    (I - gamma h A) k2 = h f(t_n + h, y_n + k1) - 2 k1 - gamma h^2 f_t
    y_{n+1} = y_n + 3/2 k1 + 1/2 k2

with gamma = 1 - 1/sqrt(2) (Verwer, Spee, Blom and Hundsdorfer, SIAM J. Sci. Comput. 20 (1999) 1456, eq. 2.7). It
is L-stable with the exact Jacobian A and of order two with any A, so A may be coarse and kept over steps; it acts
on the three velocities, where the stiffness is (theory: wheel model, eq. (30)). Bank speeds are solved exactly; their
change enters through f_t, without which the robot would lag behind its wheels when it creeps.

The forces at y_{n+1} that the next step starts from are extrapolated from those at y_n + k1 with the wheels'
derivatives: the two states differ by O(h^2), so the order stays, and a step costs one evaluation.

The embedded first-order solution y_n + k1 shows where a step is too long; such a step is redone in several. Near rest
friction saturates within micrometres per second and a linearised step can overshoot to the other side: there it is
redone by backward Euler, which cannot overshoot because friction is monotone in the velocity.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import kernel, stack_array
from ddagr_gym.physics.backward_euler import backward_euler_step
from ddagr_gym.physics.body_dynamics import (
    evaluate_forces,
    extrapolate_forces,
    world_rates,
)
from ddagr_gym.physics.body_jacobian import BANKS, damping_inverse, solve_body, solve_with_banks, velocity_size
from ddagr_gym.physics.callbacks import EffectActions
from ddagr_gym.physics.drivetrain import advance_motors, bank_acceleration, integral_growth, moving_entries
from ddagr_gym.physics.force_record import (
    BACKWARD_EULER,
    FOLLOWS,
    RECORDS,
    W_STEP,
    ForceRecord,
    decision_at,
    keep_decision,
    keep_entry,
    take_entry,
    take_entry_on_other_ground,
)
from ddagr_gym.physics.layout import (
    ACCELERATION,
    INTEGRAL,
    OMEGA,
    STEPPED,
    TIME,
    V_X,
    V_Y,
    WHEEL,
    WHEEL_ANGLE,
    YAW,
    YAW_RATE,
    X,
    Y,
)
from ddagr_gym.physics.numerics import StepNumerics

Array = NDArray[np.float64]

GAMMA = 1.0 - 1.0 / math.sqrt(2.0)  # L-stable (Verwer et al., eq. 2.7)
NEWTON_TOLERANCE = 1e-9  # [m/s], at rest
NEWTON_SHARE = 0.01  # of the accepted error, which is tolerated besides
DOUBLE_ERROR_SPEED = 0.33  # [m/s], at which twice Numerics.accepted_error is accepted
FULL_ERROR_SPEED = 0.02  # [m/s], below which less is accepted: a robot that stands on a slope would chatter
LEAST_ERROR = 1e-6  # [m/s], accepted at rest
OVERSHOOT = 4.0  # times the accepted error: the linearised step has failed, and not for its length


@kernel()
def _start_banks(row: Array, step: float, drive: Array, start: Array, right: Array, drift: Array) -> None:
    """The banks' part of the first stage: the exact change of ideal ones, or what dynamic ones put on the right side.

    Args:
        row: the environment.
        step: [s].
        drive: (6,) accelerations by bank speed.
        start: (9,) motion, and behind it the integral parts and their growth, written.
        right: (5,) its last two are written for dynamic banks.
        drift: (3,) gamma h^2 f_t, written.
    """
    dynamic = moving_entries(row) == 5
    for j in range(5):
        start[j] = row[V_X + j]
    if not dynamic:
        advance_motors(row, step)
    # gamma h^2 f_t, h omega_t being the exact change of the bank speeds; none where they are part of the system
    right_change = GAMMA * step * (row[OMEGA] - start[3])
    left_change = GAMMA * step * (row[OMEGA + 1] - start[4])
    for j in range(3):
        drift[j] = drive[2 * j] * right_change + drive[2 * j + 1] * left_change
    if dynamic:
        for bank in range(2):
            start[5 + bank] = row[INTEGRAL + bank]
            start[7 + bank] = integral_growth(row, bank)
            right[3 + bank] = step * bank_acceleration(row, bank)
            row[INTEGRAL + bank] += step * start[7 + bank]


@kernel()
def _finish_banks(row: Array, step: float, start: Array) -> None:
    """Heun's step for wheel angles and integral parts of dynamic banks, ``row`` being at the second stage."""
    for bank in range(2):
        row[WHEEL_ANGLE + bank] += 0.5 * step * (start[3 + bank] + row[OMEGA + bank])
        growth = integral_growth(row, bank)
        row[INTEGRAL + bank] = start[5 + bank] + 0.5 * step * (start[7 + bank] + growth)


@kernel()
def _forces_at_stage(
    row: Array,
    refresh: float,
    extrapolation: float,
    numerics: StepNumerics,
    actions: EffectActions,
    record: ForceRecord | None,
) -> None:
    """Forces at the motion in ``row``: evaluated, or extrapolated from recorded ones or from the last ones.

    Args:
        row: the environment.
        refresh: relative change of motion that renews a wheel's derivative.
        extrapolation: change of a wheel's velocity over its speed up to which forces are extrapolated.
        numerics: accuracy.
        actions: effects on this environment.
        record: of this environment, if it has one; its limit is 0 where the ground is another one.
    """
    if record is None:
        if not extrapolate_forces(row, extrapolation, actions):
            evaluate_forces(row, refresh, numerics, actions)
        return
    follows = record.state[0] == FOLLOWS
    if follows and record.limit > 0.0:
        take_entry(row, record)
    elif follows:
        take_entry_on_other_ground(row, record)
    if not extrapolate_forces(row, record.limit if follows else extrapolation, actions):
        evaluate_forces(row, -1.0 if follows else refresh, numerics, actions)
    if record.state[0] == RECORDS:
        keep_entry(row, record)


@kernel()
def _w_step(
    row: Array, step: float, numerics: StepNumerics, actions: EffectActions, record: ForceRecord | None
) -> float:
    """One W-step; returns the size of the embedded error estimate [m/s]. Arguments as :func:`advance_body`."""
    inverse, drive, banks, drift = stack_array(9), stack_array(6), stack_array(BANKS), stack_array(3)
    start, first, second, right = stack_array(9), stack_array(5), stack_array(5), stack_array(5)
    damping_inverse(row, GAMMA * step, inverse, drive, banks, actions)
    x, y, yaw, yaw_rate = row[X], row[Y], row[YAW], row[YAW_RATE]
    rate_x, rate_y = world_rates(row)
    dynamic = moving_entries(row) == 5
    _start_banks(row, step, drive, start, right, drift)
    for j in range(3):
        right[j] = step * row[ACCELERATION + j] + drift[j]
    if dynamic:
        solve_with_banks(GAMMA * step, inverse, drive, banks, right, first)
        row[OMEGA], row[OMEGA + 1] = start[3] + first[3], start[4] + first[4]
    else:
        solve_body(inverse, right, first)
    for j in range(3):
        row[V_X + j] = start[j] + first[j]
    row[YAW] = yaw + step * yaw_rate
    row[TIME] += step
    refresh = numerics.jacobian_refresh if numerics.force_extrapolation > 0.0 else -1.0
    _forces_at_stage(row, refresh, 0.0, numerics, actions, record)
    for j in range(3):
        right[j] = step * row[ACCELERATION + j] - 2.0 * first[j] - drift[j]
    if dynamic:
        for bank in range(2):
            right[3 + bank] = step * bank_acceleration(row, bank) - 2.0 * first[3 + bank]
        _finish_banks(row, step, start)
        solve_with_banks(GAMMA * step, inverse, drive, banks, right, second)
    else:
        solve_body(inverse, right, second)
    # with A = 0 the method is Heun's
    end_x, end_y = world_rates(row)
    row[X] = x + 0.5 * step * (rate_x + end_x)
    row[Y] = y + 0.5 * step * (rate_y + end_y)
    row[YAW] = yaw + 0.5 * step * (yaw_rate + row[YAW_RATE])
    for j in range(moving_entries(row)):
        row[V_X + j] = start[j] + 1.5 * first[j] + 0.5 * second[j]
        right[j] = 0.5 * (first[j] + second[j])
    estimate = velocity_size(row, right)
    _forces_at_stage(row, numerics.jacobian_refresh, numerics.force_extrapolation, numerics, actions, record)
    return estimate


@kernel(inline=True)
def _fastest(row: Array) -> float:
    """Largest of the body's and the rims' speeds [m/s]."""
    speed = max(abs(row[V_X]), abs(row[V_Y]))
    for bank in range(2):
        speed = max(speed, abs(row[OMEGA + bank]) * (row[WHEEL + bank] + row[WHEEL + 8 + bank]))
    return speed


@kernel(inline=True)
def _accepted(row: Array, accepted_error: float) -> float:
    """Error of a step that is accepted at the present speed [m/s]."""
    speed = _fastest(row)
    return accepted_error * (min(speed / FULL_ERROR_SPEED, 1.0) + speed / DOUBLE_ERROR_SPEED)


@kernel(inline=True)
def _copy(source: Array, target: Array) -> None:
    for j in range(STEPPED):
        target[j] = source[j]


@kernel()
def _follow(row: Array, step: float, numerics: StepNumerics, actions: EffectActions, record: ForceRecord) -> None:
    """One step divided and made as the recorded one was. Arguments as :func:`advance_body`."""
    divisions = decision_at(record, 0)
    for part in range(divisions):
        if decision_at(record, 1 + part) == W_STEP:
            _w_step(row, step / divisions, numerics, actions, record)
        else:
            tolerance = NEWTON_TOLERANCE + NEWTON_SHARE * _accepted(row, numerics.accepted_error)
            backward_euler_step(row, step / divisions, tolerance, numerics, actions)
    record.state[2] += 1 + divisions


@kernel()
def advance_body(
    row: Array, step: float, numerics: StepNumerics, actions: EffectActions, record: ForceRecord | None
) -> None:
    """One step. Needs the forces at the present state in ``row`` and leaves those at the new one.

    Args:
        row: the environment.
        step: h [s].
        numerics: accuracy.
        actions: effects on this environment.
        record: of this environment; None where it neither records nor follows, which is a kernel of its own.
    """
    if record is not None and record.state[0] == FOLLOWS:
        _follow(row, step, numerics, actions, record)
    else:
        _controlled_step(row, step, numerics, actions, record)


@kernel()
def _controlled_step(
    row: Array, step: float, numerics: StepNumerics, actions: EffectActions, record: ForceRecord | None
) -> None:
    """One step divided and made as its errors ask for. Arguments as :func:`advance_body`."""
    saved, entries = stack_array(STEPPED), _entries(record)
    _copy(row, saved)
    tolerance = NEWTON_TOLERANCE + NEWTON_SHARE * _accepted(row, numerics.accepted_error)
    divisions = 1
    done = 0
    while done < divisions:
        estimate = _w_step(row, step / divisions, numerics, actions, record)
        speed, accepted = _fastest(row), _accepted(row, numerics.accepted_error)
        if divisions == 1 and speed > FULL_ERROR_SPEED and not estimate <= accepted + LEAST_ERROR:
            _copy(saved, row)
            _back_to(record, entries)
            divisions = numerics.launch_substeps
            if divisions > 1:
                continue
        made = W_STEP
        if not estimate <= OVERSHOOT * accepted + LEAST_ERROR:
            _copy(saved, row)
            _back_to(record, entries)
            backward_euler_step(row, step / divisions, tolerance, numerics, actions)
            made = BACKWARD_EULER
        done += 1
        _keep(record, done, made)
        if done < divisions:
            _copy(row, saved)
            entries = _entries(record)
    _keep(record, 0, divisions)
    _count(record, 1 + divisions)


@kernel(inline=True)
def _entries(record: ForceRecord | None) -> int:
    """Evaluations that have been kept."""
    return 0 if record is None else record.state[1]


@kernel(inline=True)
def _back_to(record: ForceRecord | None, entries: int) -> None:
    """Forget the evaluations after so many."""
    if record is not None:
        record.state[1] = entries


@kernel(inline=True)
def _keep(record: ForceRecord | None, place: int, decision: int) -> None:
    if record is not None and record.state[0] == RECORDS:
        keep_decision(record, place, decision)


@kernel(inline=True)
def _count(record: ForceRecord | None, decisions: int) -> None:
    """Go on behind so many decisions that were kept."""
    if record is not None and record.state[0] == RECORDS:
        record.state[2] += decisions
