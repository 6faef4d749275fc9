"""Drivetrain faults of other structure than one lag, limit or delay of a bank; they came after the first sets.

What motor controllers of real robots do beside their speed loop: buses that are slower than the commands, ramps without
a corner, limits of the turning, loops that yield to the ground for a while, limits of power and of the integral part.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .change import Array, Change, Rng, Site, form, with_motors
from .forms_drive import STEP, delayed
from .jit import kernel
from .plant import Motors, Plant

RAMPED_STEP = 0.7
"""Step of a command whose jerk-limited ramp is as late on the mean as the label says [rad/s]."""
CARRIED = 28.0
"""Torque that a tight integral part still carries: a straight drive's, not a turn's [N m]."""
FOLDED_AT = 1.2
"""Speed at which a current that folds back has fallen to half [rad/s]."""


def _of_turning(passed: Callable[[Array], Array]) -> Callable[[Array, Rng], Array]:
    """Commands whose mean over the banks stays, and whose half difference (n,) becomes what ``passed`` makes of it."""

    def command(commands: Array, r: Rng) -> Array:
        mean, half = commands.mean(axis=1), passed(0.5 * (commands[:, 0] - commands[:, 1]))
        return np.column_stack([mean + half, mean - half])

    return command


def _of_the_robot(plant: Plant, value: float) -> float:
    """A torque or power of the DDAGR as a motor of another size has it."""
    return value * (plant.motors.torque_limit / Motors().torque_limit)


def _softened(motors: Motors, droop: float) -> float:
    """Bandwidth [rad/s] of a speed loop whose proportional part yields more by ``droop`` [rad/s/(N m)]."""
    moved = motors.inertia + motors.carried_inertia
    return 1.0 / (1.0 / motors.bandwidth + 2.0 * motors.damping * moved * droop)


def on_the_bus(commands: Array, period: float) -> tuple[Array, Array, Array]:
    """Last command on a bus (n, 2), the one before it (n, 2), and the share of the period that has passed since (n,).

    Args:
        commands: (n, 2) at 400 Hz [rad/s].
        period: of the bus [s].
    """
    every = max(round(period / STEP), 1)
    steps = np.arange(len(commands))
    last = steps - steps % every
    before = np.where((last >= every)[:, None], commands[np.maximum(last - every, 0)], 0.0)
    return commands[last], before, (steps % every) / every


@form("command_delay", "held on a slow bus", "different", 2, 6, "u = c at multiples of 2 T, held: T late", later=True)
def held_on_bus(size: float, rng: Rng, site: Site) -> Change:
    """Commands that a bus passes on seldom."""
    return Change({"delay": size, "period": 2.0 * size}, command=lambda c, r: on_the_bus(c, 2.0 * size)[0])


@form(
    "command_delay", "ramped on a slow bus", "variant", 2, 6,
    "u in straight lines through c(t - T/2) at multiples of T/2: T late", later=True,
)  # fmt: skip
def ramped_on_bus(size: float, rng: Rng, site: Site) -> Change:
    """A dead time, and a first-order hold at a bus that passes commands on seldom."""

    def command(commands: Array, r: Rng) -> Array:
        last, before, passed = on_the_bus(delayed(commands, 0.5 * size), 0.5 * size)
        return before + (last - before) * passed[:, None]

    return Change({"delay": size, "period": 0.5 * size}, command=command)


@kernel
def jerk_limited(commands, jerk, step, passed):  # type: ignore[no-untyped-def]
    """Follow ``commands`` (n, 2) [rad/s] into ``passed`` with an acceleration that changes by at most ``jerk``."""
    for bank in range(commands.shape[1]):
        speed, acceleration = commands[0, bank], 0.0
        for k in range(commands.shape[0]):
            left = commands[k, bank] - speed
            # the acceleration from which one of falling size, by the same jerk, ends at the command
            wanted = np.sign(left) * min(np.sqrt(2.0 * jerk * abs(left)), abs(left) / step)
            acceleration += min(max(wanted - acceleration, -jerk * step), jerk * step)
            speed += step * acceleration
            passed[k, bank] = speed


@form(
    "motor_lag", "S-shaped ramp", "different", 2, 6,
    "commands change with a jerk of at most 0.7 rad/s / T^2: T late after a step of 0.7 rad/s",
    later=True, also=("motor_saturation",),
)  # fmt: skip
def s_shaped_ramp(size: float, rng: Rng, site: Site) -> Change:
    """A ramp without corners; as a limit of acceleration it may be called a saturation too."""
    jerk = RAMPED_STEP / size**2

    def command(commands: Array, r: Rng) -> Array:
        passed = np.empty_like(commands)
        jerk_limited(np.ascontiguousarray(commands), jerk, STEP, passed)
        return passed

    return Change({"jerk_limit": jerk, "lateness": size}, command=command)


@form("motor_lag", "turning only", "different", 3, 8, "half difference of the banks' commands lags by T", later=True)
def lag_in_turning(size: float, rng: Rng, site: Site) -> Change:
    """A drive controller that lets the robot turn later than it lets it go."""

    def passed(half: Array) -> Array:
        slow, share = np.empty_like(half), STEP / (size + STEP)
        value = 0.0
        for k, wanted in enumerate(half):
            value += share * (wanted - value)
            slow[k] = value
        return slow

    return Change({"lag_of_turning": size}, command=_of_turning(passed))


@form(
    "motor_droop", "soft loop", "different", 4, 12,
    "PI loop whose P part yields by D more per torque; its I part brings the speed back, slower too",
    later=True, also=("motor_lag",),
)  # fmt: skip
def soft_loop(size: float, rng: Rng, site: Site) -> Change:
    """A loop that gives way to the ground and comes back: a droop that passes, or a lag under load."""

    def plant(p: Plant) -> Plant:
        return with_motors(p, bandwidth=_softened(p.motors, size))

    return Change({"passing_droop": size}, plant=plant)


@form(
    "motor_droop", "tight integral part", "different", 2, 8,
    "I part of at most 28 N m; beyond it speed falls by 2.1 mrad/s + D per N m", later=True,
)  # fmt: skip
def tight_integral(size: float, rng: Rng, site: Site) -> Change:
    """Anti-windup that leaves a turn's torque to the proportional part."""

    def plant(p: Plant) -> Plant:
        limit = _of_the_robot(p, CARRIED)
        return with_motors(p, bandwidth=_softened(p.motors, size), integral_limit=limit)

    return Change({"further_droop": size, "integral_torque": CARRIED}, plant=plant)


@form("motor_saturation", "power limit", "different", 2, 7, "torque speed <= 50 (1 - 1.6 S) W per bank", later=True)
def power_limit(size: float, rng: Rng, site: Site) -> Change:
    """Motors that may draw no more, and brake as before."""
    limit = 50.0 * (1.0 - 1.6 * size)
    return Change({"power_limit": limit}, plant=lambda p: with_motors(p, power_limit=_of_the_robot(p, limit)))


@form(
    "motor_saturation", "current folds back", "different", 3, 7,
    "|torque| <= 90 (1 - S) (1 - |omega|/(2.4 rad/s)) N m per bank", later=True,
)  # fmt: skip
def folding_current(size: float, rng: Rng, site: Site) -> Change:
    """A current limit that falls with speed."""
    limit = 90.0 * (1.0 - size)

    def plant(p: Plant) -> Plant:
        return with_motors(p, torque_limit=_of_the_robot(p, limit), fold_back=0.5 / FOLDED_AT)

    return Change({"torque_limit_at_rest": limit}, plant=plant)


@form(
    "motor_saturation", "turning limit", "different", 3, 10,
    "half difference of the banks' commands <= 0.6 (1 - S) rad/s, mean kept", later=True,
)  # fmt: skip
def turning_limit(size: float, rng: Rng, site: Site) -> Change:
    """A drive controller that bounds the yaw rate."""
    limit = 0.6 * (1.0 - size)
    return Change({"turning_limit": limit}, command=_of_turning(lambda half: np.clip(half, -limit, limit)))


@form(
    "command_deadband", "turning only", "different", 5, 12,
    "half difference of the banks' commands is none where it is below B", later=True,
)  # fmt: skip
def turning_deadband(size: float, rng: Rng, site: Site) -> Change:
    """A drive controller that overlooks small turns."""
    command = _of_turning(lambda half: np.where(np.abs(half) < size, 0.0, half))
    return Change({"turning_deadband": size}, command=command)
