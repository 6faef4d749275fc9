"""From a bank's speed command to its acceleration (theory: drivetrain, section 1).

    r = filter(ramps(deadband(limit_turning(u))))(t - delay)
    d omega/dt = limit(k_omega (r - omega) + z) + T/J - viscous omega - friction sgn(omega),  dz/dt = k_i (r - omega)

T is the torque of the ground on the bank's wheels; a loop that carries it asks for -T/J besides. With the defaults of
:class:`ddagr_gym.parameters.Drivetrain` only the first-order loop d omega/dt = k_omega (r - omega) is left, which is
solved exactly and does not depend on the body; otherwise the bank speeds are advanced together with the body's
velocities.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import kernel
from ddagr_gym.physics.history import fill_node, push, recall, ring_is_empty, ring_stride
from ddagr_gym.physics.layout import (
    ACCELERATION_LIMIT,
    AXLE_TORQUE,
    BASE_BODY,
    BASE_DRIVETRAIN,
    BASE_MOTOR_RATE,
    BASE_WHEEL,
    COMMAND,
    COMMAND_DEADBAND,
    COMMAND_DELAY,
    COMMAND_FILTER,
    COMMAND_RAMP,
    COULOMB_FRICTION,
    DRIVETRAIN,
    DYNAMIC_BANKS,
    FILTERED,
    INTEGRAL,
    INTEGRAL_KNOWN,
    INTEGRAL_LIMIT,
    INTEGRAL_RATE,
    LIMIT_IMBALANCE,
    LOAD_CARRIED,
    LOAD_COMPLIANCE,
    MAXIMUM_WHEEL_SPEED,
    MEAN_RAMP,
    MOTOR_RATE,
    MOTOR_TARGET,
    NO_LOAD_SPEED,
    OMEGA,
    POWER_LIMIT,
    SAMPLE_PERIOD,
    SET_POINT,
    SIZE,
    TARGET_NODES,
    TARGET_RING,
    TURNING_LIMIT,
    TURNING_RAMP,
    VISCOUS_RATE,
    WHEEL_ANGLE,
)

Array = NDArray[np.float64]

LONGEST_DELAY = 1.0  # [s] of a command, ours: as long as commands are remembered
NO_LIMIT = 1e6  # [rad/s^2] far beyond any wheel's
NO_SPEED_LIMIT = 1e3  # [rad/s] likewise
NO_POWER_LIMIT = 1e6  # [rad^2/s^3] likewise
_SLOW_SHARE = 0.06  # of the highest wheel speed, at which a settled loop holds half of its load (ours: 1 of 17 rad/s)
_STICTION_SPEED = 0.02  # [rad/s] over which Coulomb friction builds up, ours: a fortieth of a row turn's wheel speed


@kernel()
def delay_targets(row: Array, ring: Array, nodes: int, longest: float, right: float, left: float) -> None:
    """Put set points of some time ago in place of the present ones, interpolated between samples.

    A shift in time may come before or after limits and ramp; behind them a ramp that begins between two samples stays
    one.

    Args:
        row: of the simulator.
        ring: memory of past set points, see :mod:`ddagr_gym.physics.history`.
        nodes: of the ring.
        longest: delay that it reaches back [s]; longer ones count as this.
        right: delay of the right bank [s].
        left: of the left bank [s].
    """
    period = row[SAMPLE_PERIOD]
    stride = ring_stride(longest, period, nodes)
    if ring_is_empty(ring, 2, nodes):
        # before the first sample the set points are taken to have equalled the bank speeds
        for k in range(1, nodes):
            for bank in range(2):
                fill_node(ring, 2, nodes, k, stride, bank, row[OMEGA + bank])
    push(ring, 2, nodes, stride, row[MOTOR_TARGET : MOTOR_TARGET + 2])
    for bank in range(2):
        samples = min(right if bank == 0 else left, longest) / period
        row[MOTOR_TARGET + bank] = recall(ring, 2, nodes, stride, bank, samples, row[MOTOR_TARGET + bank])


@kernel()
def delay_by_dead_time(row: Array) -> None:
    """The same by the robot's own ``COMMAND_DELAY`` [s], of both banks."""
    delay = row[COMMAND_DELAY]
    delay_targets(row, row[TARGET_RING:SIZE], TARGET_NODES, LONGEST_DELAY, delay, delay)


@kernel(inline=True)
def mean_and_turning(row: Array, right: int) -> tuple[float, float]:
    """Mean of the entries of both banks, from ``right`` on, and how far the right one is from it."""
    mean = 0.5 * (row[right] + row[right + 1])
    return mean, row[right] - mean


@kernel(inline=True)
def limit_turning(row: Array, right: int, limit: float) -> None:
    """Bring the entries of both banks, from ``right`` on, to at most ``limit`` [rad/s] from their mean, which stays."""
    mean, turning = mean_and_turning(row, right)
    turning = min(max(turning, -limit), limit)
    row[right], row[right + 1] = mean + turning, mean - turning


@kernel(inline=True)
def lagged_mean(behind: float, lag: float, period: float) -> tuple[float, float]:
    """Distance from a held input that a first-order filter has on average over a sample, and at its end."""
    decay = math.exp(-period / lag)
    return behind * (1.0 - decay) * lag / period, behind * decay


@kernel(inline=True)
def _smoothed(row: Array, bank: int) -> float:
    """Mean over the sample of the filter's answer to the set point, which is held: as the loop's target, so that a
    filter that is shorter than a sample counts in proportion to its length."""
    target = row[SET_POINT + bank]
    if row[COMMAND_FILTER] <= 0.0:
        row[FILTERED + bank] = target
        return target
    mean, end = lagged_mean(row[FILTERED + bank] - target, row[COMMAND_FILTER], row[SAMPLE_PERIOD])
    row[FILTERED + bank] = target + end
    return target + mean


@kernel(inline=True)
def _approached(before: float, target: float, most: float) -> float:
    """A value that goes towards its target by at most so much."""
    return before + min(max(target - before, -most), most)


@kernel(inline=True)
def _ramped_together(row: Array, right: float, left: float) -> tuple[float, float]:
    """Set points of both banks on the way to targets, with the ramps of their mean and of how far they are from it."""
    period = row[SAMPLE_PERIOD]
    mean, turning = mean_and_turning(row, SET_POINT)
    asked = 0.5 * (right + left)
    mean = _approached(mean, asked, row[MEAN_RAMP] * period)
    turning = _approached(turning, right - asked, row[TURNING_RAMP] * period)
    return mean + turning, mean - turning


@kernel(inline=True)
def _allowed(row: Array, bank: int) -> float:
    """Command of a bank within its speed limit, or none in the deadband [rad/s]."""
    limit = row[MAXIMUM_WHEEL_SPEED]
    row[COMMAND + bank] = min(max(row[COMMAND + bank], -limit), limit)
    return row[COMMAND + bank] if abs(row[COMMAND + bank]) >= row[COMMAND_DEADBAND] else 0.0


@kernel()
def set_targets(row: Array) -> None:
    """Set points of the coming sample from the commands, and the drivetrain as the robot has it."""
    if row[TURNING_LIMIT] < NO_SPEED_LIMIT:
        limit_turning(row, COMMAND, row[TURNING_LIMIT])
    right, left = _allowed(row, 0), _allowed(row, 1)
    if min(row[MEAN_RAMP], row[TURNING_RAMP]) < NO_LIMIT:
        right, left = _ramped_together(row, right, left)
    for bank in range(2):
        target = right if bank == 0 else left
        if row[COMMAND_RAMP] < NO_LIMIT:
            target = _approached(row[SET_POINT + bank], target, row[COMMAND_RAMP] * row[SAMPLE_PERIOD])
        row[SET_POINT + bank] = target
        row[MOTOR_TARGET + bank] = _smoothed(row, bank)
        row[MOTOR_RATE + bank] = row[BASE_MOTOR_RATE]
    for j in range(9):
        row[DRIVETRAIN + j] = row[BASE_DRIVETRAIN + j]
    row[LOAD_CARRIED] = 0.0


@kernel(inline=True)
def _resistance(row: Array, bank: int) -> float:
    """Deceleration by the friction of motor and gear [rad/s^2]."""
    speed = row[OMEGA + bank]
    coulomb = row[DRIVETRAIN + COULOMB_FRICTION] * speed / (abs(speed) + _STICTION_SPEED)
    return row[DRIVETRAIN + VISCOUS_RATE] * speed + coulomb


@kernel(inline=True)
def _load(row: Array, bank: int) -> float:
    """Acceleration by the ground's torque of the last evaluation [rad/s^2]; negative while it brakes."""
    torque = row[AXLE_TORQUE + bank] + row[AXLE_TORQUE + 2 + bank]
    return row[DRIVETRAIN + LOAD_COMPLIANCE] * torque


@kernel()
def _settle_integrals(row: Array) -> None:
    """Integral parts after a reset: those that carry the present load, ever less of it the nearer a bank is to rest.

    What a bank near rest turns against may have either sign, and a loop that stands holds nothing.
    """
    slow = _SLOW_SHARE * row[MAXIMUM_WHEEL_SPEED]
    for bank in range(2):
        squared = row[OMEGA + bank] * row[OMEGA + bank]
        carried = squared / (squared + slow * slow) * (_resistance(row, bank) - _load(row, bank))
        most = row[DRIVETRAIN + INTEGRAL_LIMIT]
        row[INTEGRAL + bank] = min(max(carried, -most), most)
    row[INTEGRAL_KNOWN] = 1.0


@kernel()
def mark_dynamic_banks(row: Array) -> None:
    """Note whether the banks need more than the exact solution of the first-order loop."""
    ideal = row[DRIVETRAIN + INTEGRAL_RATE] == 0.0 and row[DRIVETRAIN + LOAD_COMPLIANCE] == 0.0
    ideal = ideal and row[DRIVETRAIN + ACCELERATION_LIMIT] >= NO_LIMIT
    ideal = ideal and row[DRIVETRAIN + POWER_LIMIT] >= NO_POWER_LIMIT
    ideal = ideal and row[DRIVETRAIN + VISCOUS_RATE] == 0.0 and row[DRIVETRAIN + COULOMB_FRICTION] == 0.0
    row[DYNAMIC_BANKS] = 0.0 if ideal else 1.0
    if row[DRIVETRAIN + INTEGRAL_RATE] > 0.0 and row[INTEGRAL_KNOWN] == 0.0:
        _settle_integrals(row)


@kernel(inline=True)
def moving_entries(row: Array) -> int:
    """Entries from ``V_X`` on that are advanced together: the body's 3 velocities, and both bank speeds if dynamic."""
    return 5 if row[DYNAMIC_BANKS] != 0.0 else 3


@kernel()
def advance_motors(row: Array, duration: float) -> None:
    """Bank speeds and wheel angles after ``duration`` [s] of d omega/dt = k_omega (target - omega).

    Theory: wheel model, eq. (28); thesis 4.11.
    """
    for bank in range(2):
        target = row[MOTOR_TARGET + bank]
        rate = row[MOTOR_RATE + bank]
        difference = row[OMEGA + bank] - target
        decay = math.exp(-rate * duration)
        row[WHEEL_ANGLE + bank] += target * duration + difference * (1.0 - decay) / rate
        row[OMEGA + bank] = target + difference * decay


@kernel(inline=True)
def _wanted(row: Array, bank: int) -> float:
    """Acceleration that the speed loop asks for [rad/s^2]."""
    wanted = row[MOTOR_RATE + bank] * (row[MOTOR_TARGET + bank] - row[OMEGA + bank]) + row[INTEGRAL + bank]
    return wanted - row[LOAD_CARRIED] * _load(row, bank)


@kernel(inline=True)
def _share(row: Array, bank: int) -> float:
    """Share of the limits that the motor of a bank has."""
    imbalance = row[DRIVETRAIN + LIMIT_IMBALANCE]
    return 1.0 + imbalance if bank == 0 else 1.0 - imbalance


@kernel(inline=True)
def _falling_limit(row: Array, bank: int, wanted: float) -> tuple[float, float]:
    """Most that the motor gives in the direction that is asked for [rad/s^2], and how it changes with that speed [1/s].

    Less the faster the bank turns that way: along the line to the no-load speed, and by its power.
    """
    along = row[OMEGA + bank] if wanted > 0.0 else -row[OMEGA + bank]
    limit, slope = row[DRIVETRAIN + ACCELERATION_LIMIT], 0.0
    if row[DRIVETRAIN + NO_LOAD_SPEED] < NO_SPEED_LIMIT:
        share = 1.0 - along / row[DRIVETRAIN + NO_LOAD_SPEED]
        slope = -limit / row[DRIVETRAIN + NO_LOAD_SPEED] if 0.0 < share < 1.0 else 0.0
        limit *= min(max(share, 0.0), 1.0)
    if row[DRIVETRAIN + POWER_LIMIT] < NO_POWER_LIMIT and along * limit > row[DRIVETRAIN + POWER_LIMIT]:
        limit = row[DRIVETRAIN + POWER_LIMIT] / along
        slope = -limit / along
    return _share(row, bank) * limit, _share(row, bank) * slope


@kernel(inline=True)
def _limit(row: Array, bank: int, wanted: float) -> float:
    """Most that the motor gives in the direction that is asked for [rad/s^2]."""
    limit, _ = _falling_limit(row, bank, wanted)
    return limit


@kernel()
def bank_acceleration(row: Array, bank: int) -> float:
    """d omega/dt of a bank with the ground's torque of the last evaluation [rad/s^2] (theory: drivetrain, eq. (4))."""
    wanted = _wanted(row, bank)
    limit = _limit(row, bank, wanted)
    return min(max(wanted, -limit), limit) + _load(row, bank) - _resistance(row, bank)


@kernel()
def bank_damping(row: Array, bank: int) -> float:
    """Derivative of :func:`bank_acceleration` by the bank's own speed, the ground's torque left out [1/s]."""
    wanted = _wanted(row, bank)
    limit, slope = _falling_limit(row, bank, wanted)
    width = abs(row[OMEGA + bank]) + _STICTION_SPEED
    damping = -row[DRIVETRAIN + VISCOUS_RATE] - row[DRIVETRAIN + COULOMB_FRICTION] * _STICTION_SPEED / (width * width)
    return damping + (slope if abs(wanted) > limit else -row[MOTOR_RATE + bank])


@kernel()
def felt_compliance(row: Array, bank: int) -> float:
    """Derivative of :func:`bank_acceleration` by the ground's torque [1/(kg m^2)]: none while the loop carries it."""
    compliance = row[DRIVETRAIN + LOAD_COMPLIANCE]
    if row[LOAD_CARRIED] == 0.0:
        return compliance
    wanted = _wanted(row, bank)
    return compliance if abs(wanted) > _limit(row, bank, wanted) else 0.0


@kernel()
def integral_growth(row: Array, bank: int) -> float:
    """dz/dt of the loop's integral part [rad/s^3] (theory: drivetrain, eq. (3))."""
    error = row[MOTOR_TARGET + bank] - row[OMEGA + bank]
    integral = row[INTEGRAL + bank]
    most = min(row[DRIVETRAIN + INTEGRAL_LIMIT], _limit(row, bank, integral))
    if integral * error > 0.0 and abs(integral) >= most:
        return 0.0
    return row[DRIVETRAIN + INTEGRAL_RATE] * error


@kernel(inline=True)
def rim_inertia(row: Array) -> float:
    """Inertia of the robot's mass at the rim [kg m^2]: that of a bank where none is known."""
    radius = 0.0
    for wheel in range(4):
        radius += 0.25 * (row[BASE_WHEEL + wheel] + row[BASE_WHEEL + 8 + wheel])
    return row[BASE_BODY] * radius * radius


@kernel(inline=True)
def bank_inertia(row: Array) -> float:
    """J [kg m^2]; where the ground has no influence, any will do."""
    compliance = row[DRIVETRAIN + LOAD_COMPLIANCE]
    return 1.0 / compliance if compliance > 0.0 else rim_inertia(row)


@kernel()
def carry_load(row: Array) -> None:
    """Let ideal loops feel the limits of their motors under the ground's load, which they carry as far as these allow.

    Banks that the ground resists already (1/J > 0) stay as they are.
    """
    if row[DRIVETRAIN + LOAD_COMPLIANCE] == 0.0:
        row[DRIVETRAIN + LOAD_COMPLIANCE] = 1.0 / rim_inertia(row)
        row[LOAD_CARRIED] = 1.0


@kernel()
def motor_torque(row: Array, bank: int) -> float:
    """Torque of a bank's motors at its wheels [N m] (theory: drivetrain, eq. (7)).

    Where the ground has no influence on the bank, the motors give what carries the ground's torque.
    """
    if row[DRIVETRAIN + LOAD_COMPLIANCE] > 0.0:
        wanted = _wanted(row, bank)
        limit = _limit(row, bank, wanted)
        return min(max(wanted, -limit), limit) / row[DRIVETRAIN + LOAD_COMPLIANCE]
    return -(row[AXLE_TORQUE + bank] + row[AXLE_TORQUE + 2 + bank])


@kernel()
def follows_past(row: Array) -> bool:
    """Whether the drivetrain depends on the bank speeds of earlier samples."""
    ramped = min(row[MEAN_RAMP], row[TURNING_RAMP], row[COMMAND_RAMP]) < NO_LIMIT
    return ramped or row[COMMAND_DELAY] > 0.0 or row[COMMAND_FILTER] > 0.0 or row[DYNAMIC_BANKS] != 0.0


@kernel()
def turn_banks(row: Array, speeds: Array) -> None:
    """Give the banks ``speeds`` (2,) [rad/s] where they are known."""
    for bank in range(2):
        if not math.isnan(speeds[bank]):
            row[OMEGA + bank] = speeds[bank]


@kernel()
def wind_up(row: Array, speeds: Array) -> None:
    """Let the integral part follow one earlier sample, to whose end the banks had ``speeds`` (2,) [rad/s]."""
    half = 0.5 * row[SAMPLE_PERIOD]
    for bank in range(2):
        if math.isnan(speeds[bank]):
            continue
        row[INTEGRAL + bank] += half * integral_growth(row, bank)
        row[OMEGA + bank] = speeds[bank]
        row[INTEGRAL + bank] += half * integral_growth(row, bank)
