"""The model: two banks, each with a speed loop within limits, a vehicle that they move, and a load that resists.

Set point: command, after the delay, with turning and speed clamped, then ramped. Torque: proportional and integral part
on the speed error, within the limits. Wheel: inertia share e, friction, and the force f of the ground, which saturates
in the slip speed. Vehicle: mean speed v and yaw rate y (as a difference of the banks), moved by f. Turning is resisted
by a saturating load,

    e w' = u - b w - R g(w / w0) - f,   f = F g((w - v -+ y/2) / s),   g(x) = x / sqrt(1 + x^2),
    (1 - e) v' = (f_right + f_left) / 2,   (1 - e) k y' = f_right - f_left - 2 M g(y / y0).

All of it is ours; the simulator has the wheel and body models of the thesis instead of F, M and R.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from benchmarks.drivetrain.parameters import ANTI_WINDUP, NAMES, parameter_vector
from benchmarks.drivetrain.stretches import Stretch

Array = NDArray[np.float64]

STEP = 0.02
"""Time step [s]: halving it changes predictions by 0.04 rad/s r.m.s., a sixth of the median residual."""
ROLLING_SPEED = 0.5
"""Speed at which rolling load is 71 % of its full size [rad/s]; only smooths the sign (ours)."""
(
    DELAY,
    TURNING_LIMIT,
    MEAN_RAMP,
    TURNING_RAMP,
    RAMP,
    TOP_SPEED,
    PROPORTIONAL,
    INTEGRAL,
    INTEGRAL_LIMIT,
    POWER,
    ASYMMETRY,
    VISCOUS,
    WHEEL_SHARE,
    YAW_INERTIA,
    GAIN,
    LAG,
    DEAD_BAND,
    SLOWING_RAMP,
    TORQUE_LIMIT,
    STALL_TORQUE,
    NO_LOAD_SPEED,
    COUPLING,
    START_DELAY,
    AVERAGING,
    TURNING_LOAD,
    TURNING_SPEED,
    ROLLING_LOAD,
    TRACTION,
    SLIP_SPEED,
) = range(len(NAMES))
"""Places in the vector of parameters; a test compares them with NAMES."""
REST = 1.0
"""Speed below which power limits nothing [rad/s]."""


@njit(cache=True)
def _saturating(x: float) -> float:
    """g(x) of the module, from -1 to 1 with slope 1 at 0."""
    return float(x / np.sqrt(1.0 + x * x))


@njit(cache=True)
def _slope(g: float) -> float:
    """Slope of g(x) where it has the value ``g``."""
    rest = 1.0 - g * g
    return float(rest * np.sqrt(rest))


@njit(cache=True)
def _ask(p: Array, command: Array, wanted: Array) -> None:
    """What a command asks of the set points, into wanted (2,)."""
    top, gain, dead, limit = p[TOP_SPEED], p[GAIN], p[DEAD_BAND], p[TURNING_LIMIT]
    middle, half = 0.5 * (command[0] + command[1]), 0.5 * (command[0] - command[1])
    half = min(max(half, -limit), limit)
    for i in range(2):
        value = gain * (middle + half if i == 0 else middle - half)
        wanted[i] = 0.0 if abs(value) < dead else min(max(value, -top), top)


@njit(cache=True)
def _approached(before: float, target: float, most: float, slowing: float) -> float:
    """A value that goes towards its target by at most so much, or ``slowing`` times that where it comes nearer to 0."""
    away = abs(target) > abs(before) and target * before >= 0.0
    most *= 1.0 if away else slowing
    return before + min(max(target - before, -most), most)


@njit(cache=True)
def _set_points(
    p: Array, wanted: Array, smooth: Array, point: Array, mean: Array, duration: float, step: float
) -> None:
    """Move the set points (2,) in place, lag, then ramps; mean (2,) gathers what the loop sees of them in a step."""
    slowing = p[SLOWING_RAMP]
    follow = 1.0 - np.exp(-duration / p[LAG])
    for i in range(2):
        smooth[i] += follow * (wanted[i] - smooth[i])
    middle, asked = 0.5 * (point[0] + point[1]), 0.5 * (smooth[0] + smooth[1])
    half = _approached(point[0] - middle, smooth[0] - asked, duration * p[TURNING_RAMP], slowing)
    middle = _approached(middle, asked, duration * p[MEAN_RAMP], slowing)
    for i in range(2):
        target = middle + half if i == 0 else middle - half
        point[i] = _approached(point[i], target, duration * p[RAMP], 1.0)
        mean[i] += duration / step * point[i]


@njit(cache=True)
def _torque_limit(p: Array, speed: float, side: float, other_power: float) -> float:
    """Largest torque in the sense of rotation ``speed`` > 0 of a bank; speed < 0 brakes."""
    power, asymmetry, torque, stall, no_load, coupling = (
        p[POWER],
        p[ASYMMETRY],
        p[TORQUE_LIMIT],
        p[STALL_TORQUE],
        p[NO_LOAD_SPEED],
        p[COUPLING],
    )
    left = max(power - coupling * other_power, 0.05 * power)
    line = max(stall * (1.0 - speed / no_load), 0.0)
    return (1.0 + side * asymmetry) * min(torque, line, left / max(speed, REST))


@njit(cache=True)
def _torques(p: Array, point: Array, w: Array, z: Array, u: Array, step: float, windup: int) -> None:
    """Torques u (2,) and integral parts z (2,), in place."""
    kp, ki, most = p[PROPORTIONAL], p[INTEGRAL], p[INTEGRAL_LIMIT]
    right, left = max(u[0] * w[0], 0.0), max(u[1] * w[1], 0.0)
    for i in range(2):
        side, other = (1.0, left) if i == 0 else (-1.0, right)
        high = _torque_limit(p, w[i], side, other)
        low = -_torque_limit(p, -w[i], side, other)
        error = point[i] - w[i]
        asked = kp * error + z[i]
        u[i] = min(max(asked, low), high)
        if windup != 1 or u[i] == asked or (asked - u[i]) * error < 0.0:
            z[i] += step * ki * error
        if windup == 2:
            z[i] += step * (u[i] - asked) * ki / kp
        if windup == 3:
            z[i] = min(max(z[i], low), high)
        z[i] = min(max(z[i], -most), most)


@njit(cache=True)
def _move(p: Array, u: Array, w: Array, body: Array, work: Array, step: float) -> None:
    """Wheels w (2,) and vehicle (yaw rate, speed) over a step, in place; linearly implicit in all four.

    The ground's force is stiff against the wheels' small inertia: an explicit step of 10 ms would not be stable.
    ``work`` (4, 2) is scratch: changes, giving way, forces, remaining stiffness.
    """
    viscous, share, yaw_inertia = p[VISCOUS], p[WHEEL_SHARE], p[YAW_INERTIA]
    turning, turning_speed, rolling, traction, slip = (
        p[TURNING_LOAD],
        p[TURNING_SPEED],
        p[ROLLING_LOAD],
        p[TRACTION],
        p[SLIP_SPEED],
    )
    mass = 1.0 - share
    for i in range(2):
        ground = body[1] + (0.5 * body[0] if i == 0 else -0.5 * body[0])
        grip, roll = _saturating((w[i] - ground) / slip), _saturating(w[i] / ROLLING_SPEED)
        stiff = traction * _slope(grip) / slip
        damping = rolling * _slope(roll) / ROLLING_SPEED + viscous
        whole = share + step * (damping + stiff)
        # dw = work[0] + work[1] * (change of the ground's speed under the wheel)
        work[0, i] = step * (u[i] - traction * grip - rolling * roll - viscous * w[i]) / whole
        work[1, i] = step * stiff / whole
        work[2, i], work[3, i] = traction * grip + stiff * work[0, i], stiff * (1.0 - work[1, i])
    turn = _saturating(body[0] / turning_speed)
    both, between = work[3, 0] + work[3, 1], work[3, 0] - work[3, 1]
    straight, cross = mass + 0.5 * step * both, 0.25 * step * between
    turning_mass = mass * yaw_inertia + 0.5 * step * both + step * 2.0 * turning * _slope(turn) / turning_speed
    pull, twist = 0.5 * step * (work[2, 0] + work[2, 1]), step * (work[2, 0] - work[2, 1] - 2.0 * turning * turn)
    determinant = straight * turning_mass - 4.0 * cross * cross
    dv = (pull * turning_mass - cross * twist) / determinant
    dy = (straight * twist - 4.0 * cross * pull) / determinant
    w[0] += work[0, 0] + work[1, 0] * (dv + 0.5 * dy)
    w[1] += work[0, 1] + work[1, 1] * (dv - 0.5 * dy)
    body[0] += dy
    body[1] += dv


@njit(cache=True)
def _with_late_starts(times: Array, events: Array, before: Array, wait: float) -> Array:
    """Times (m,) of commands, those to a robot that was told to stand so much later, but not after the next one."""
    late = times.copy()
    for k in range(times.size):
        last = before if k == 0 else events[k - 1]
        if last[0] == 0.0 and last[1] == 0.0:
            late[k] = times[k] + wait if k + 1 == times.size else min(times[k] + wait, times[k + 1])
    return late


@njit(cache=True)
def simulate(
    p: Array, times: Array, events: Array, before: Array, speeds: Array, count: int, step: float, windup: int,
    loads: Array,
) -> Array:  # fmt: skip
    """Bank speeds and the vehicle's motion at every step.

    Args:
        p: vector of :func:`benchmarks.drivetrain.parameters.parameter_vector`.
        times: of the commands (m,), from 0 [s].
        events: commands (m, 2) right, left [rad/s].
        before: commands (2,) before the first.
        speeds: bank speeds (2,) at time 0, in a steady state.
        count: number of steps.
        step: [s].
        windup: of ANTI_WINDUP.
        loads: factors (m,) on the turning load from each command on.

    Returns:
        (count + 1, 4) bank speeds right and left, yaw rate as a difference of the banks, vehicle speed [rad/s].
    """
    delay, kp, most, viscous = p[DELAY], p[PROPORTIONAL], p[INTEGRAL_LIMIT], p[VISCOUS]
    turning, turning_speed, rolling = p[TURNING_LOAD], p[TURNING_SPEED], p[ROLLING_LOAD]
    out = np.empty((count + 1, 4))
    w, wanted, u, z = speeds.copy(), np.zeros(2), np.zeros(2), np.zeros(2)
    _ask(p, before, wanted)
    point, smooth = wanted.copy(), wanted.copy()
    body = np.array([w[0] - w[1], 0.5 * (w[0] + w[1])])
    resisting = turning * _saturating(body[0] / turning_speed)
    for i in range(2):
        load = viscous * w[i] + rolling * _saturating(w[i] / ROLLING_SPEED) + (resisting if i == 0 else -resisting)
        z[i] = min(max(load - kp * (point[i] - w[i]), -most), most)
    work, mean = np.empty((4, 2)), np.zeros(2)
    p = p.copy()
    times = _with_late_starts(times, events, before, p[START_DELAY])
    event = 0
    out[0, 0], out[0, 1], out[0, 2], out[0, 3] = w[0], w[1], body[0], body[1]
    for k in range(1, count + 1):
        now, end = (k - 1) * step - delay, k * step - delay
        mean[:] = 0.0
        # a command inside the step splits it, so that predictions are smooth in the delay
        while event < times.size and times[event] < end:
            _set_points(p, wanted, smooth, point, mean, max(times[event] - now, 0.0), step)
            _ask(p, events[event], wanted)
            p[TURNING_LOAD] = loads[event] * turning
            now = max(times[event], now)
            event += 1
        _set_points(p, wanted, smooth, point, mean, end - now, step)
        _torques(p, mean, w, z, u, step, windup)
        _move(p, u, w, body, work, step)
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = w[0], w[1], body[0], body[1]
    return out


def run(p: Array, stretch: Stretch, windup: int, step: float = STEP, loads: Array | None = None) -> Array:
    """Motion (n, 4) over a stretch, as :func:`simulate`; ``loads`` are 1 by default."""
    count = int(np.ceil(stretch.duration / step)) + 1
    factors = np.ones(len(stretch.times)) if loads is None else loads
    return simulate(
        p, stretch.times, stretch.events, stretch.command_before(0), stretch.speeds, count, step, windup, factors
    )


def predict(p: Array, stretch: Stretch, windup: int, step: float = STEP, loads: Array | None = None) -> Array:
    """Encoder readings (n,) that the model gives for those of a stretch [rad/s]; ``loads`` as of :func:`run`."""
    motion = run(p, stretch, windup, step, loads)
    return read(motion, stretch, float(p[AVERAGING]), step)


def read(motion: Array, stretch: Stretch, averaging: float, step: float = STEP) -> Array:
    """Readings (n,) of a motion (m, 4): the speed at their time, or its mean over the time before [rad/s]."""
    grid = step * np.arange(len(motion))
    found = np.empty(len(stretch.value))
    for bank in (0, 1):
        mine = stretch.bank == bank
        if averaging <= 0.0:
            found[mine] = np.interp(stretch.time[mine], grid, motion[:, bank])
            continue
        travelled = np.concatenate([[0.0], np.cumsum(0.5 * step * (motion[1:, bank] + motion[:-1, bank]))])
        end = stretch.time[mine]
        # before its start a stretch is steady
        early = np.minimum(end - averaging, 0.0) * motion[0, bank]
        begin = np.interp(np.maximum(end - averaging, 0.0), grid, travelled) + early
        found[mine] = (np.interp(end, grid, travelled) - begin) / averaging
    return found


def residuals(values: dict[str, float], stretches: list[Stretch], windup: str) -> Array:
    """Readings less predictions of all stretches, in their order [rad/s]."""
    p = parameter_vector(values)
    form = ANTI_WINDUP[windup]
    return np.concatenate([s.value - predict(p, s, form) for s in stretches])
