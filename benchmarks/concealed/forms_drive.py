"""Forms of the effects on commands and motors."""

from __future__ import annotations

import numpy as np

from .change import Array, Change, Rng, Site, form, with_motors
from .drive import SAMPLE_PERIOD, SUBSTEPS
from .manoeuvres import FASTEST
from .plant import Motors, Plant

STEP = SAMPLE_PERIOD / SUBSTEPS


def delayed(commands: Array, seconds: Array | float) -> Array:
    """Commands at 400 Hz as they arrive ``seconds`` late (a number, or one per step)."""
    source = np.arange(len(commands)) - np.round(np.asarray(seconds) / STEP).astype(int)
    return np.where((source >= 0)[:, None], commands[np.clip(source, 0, None)], 0.0)


@form("command_delay", "constant", "same", 2, 6, "u(t) = c(t - T), both banks")
def constant_delay(size: float, rng: Rng, site: Site) -> Change:
    return Change({"delay": size}, command=lambda c, r: delayed(c, size))


@form("command_delay", "jitter", "variant", 2, 6, "u(t) = c(t - T_k), T_k in [0.6 T, 1.4 T] anew every 0.1 s")
def jittering_delay(size: float, rng: Rng, site: Site) -> Change:
    def command(commands: Array, r: Rng) -> Array:
        packets = r.uniform(0.6, 1.4, len(commands) // 40 + 1) * size
        return delayed(commands, np.repeat(packets, 40)[: len(commands)])

    return Change({"delay": size}, command=command)


@form("command_delay", "one bank", "different", 3, 6, "u_right(t) = c_right(t - T), left at once")
def one_bank_delay(size: float, rng: Rng, site: Site) -> Change:
    def command(commands: Array, r: Rng) -> Array:
        return np.column_stack([delayed(commands, size)[:, 0], commands[:, 1]])

    return Change({"delay": size, "bank": "right"}, command=command)


def _slower(rate: float, seconds: float) -> float:
    """Rate [1/s] of a first-order lag whose time constant has grown."""
    return 1.0 / (1.0 / rate + seconds)


@form("motor_lag", "slower loop", "same", 2, 6, "reference' = (c - reference)/(1/k + T)")
def slower_loop(size: float, rng: Rng, site: Site) -> Change:
    def plant(p: Plant) -> Plant:
        return with_motors(p, rate_up=_slower(p.motors.rate_up, size), rate_down=_slower(p.motors.rate_down, size))

    return Change({"added_time_constant": size}, plant=plant)


@form("motor_lag", "second pole", "variant", 2, 6, "reference passes a second lag of time constant T")
def second_pole(size: float, rng: Rng, site: Site) -> Change:
    return Change({"added_time_constant": size}, plant=lambda p: with_motors(p, second_lag=size))


@form("motor_lag", "speeding up only", "different", 3, 7, "slower loop only while |c| exceeds |reference|")
def lag_when_speeding_up(size: float, rng: Rng, site: Site) -> Change:
    def plant(p: Plant) -> Plant:
        return with_motors(p, rate_up=_slower(p.motors.rate_up, size))

    return Change({"added_time_constant": size}, plant=plant)


@form("motor_droop", "leaky integrator", "same", 2, 3.9, "speed falls by D per torque: the loop's integrator leaks")
def leaky_integrator(size: float, rng: Rng, site: Site) -> Change:
    return Change({"droop": size}, plant=lambda p: with_motors(p, droop=size))


@form("motor_droop", "battery sag", "different", 4, 9, "both speeds fall by D/(0.7 rad/s) of themselves per power")
def battery_sag(size: float, rng: Rng, site: Site) -> Change:
    return Change({"droop": size}, plant=lambda p: with_motors(p, sag=size / 0.7))


@form("motor_saturation", "speed limit", "same", 3, 8, "|reference| <= 1.2 (1 - S) rad/s")
def speed_limit(size: float, rng: Rng, site: Site) -> Change:
    limit = FASTEST * (1.0 - size)
    return Change({"speed_limit": limit}, plant=lambda p: with_motors(p, speed_limit=limit))


@form("motor_saturation", "load line", "variant", 3, 8, "|reference| <= 1.2 (1 - S) + 0.05 - 0.003 |torque|")
def load_line(size: float, rng: Rng, site: Site) -> Change:
    limit = FASTEST * (1.0 - size) + 0.05
    return Change({"speed_limit": limit}, plant=lambda p: with_motors(p, speed_limit=limit, load_line=0.003))


@form("motor_saturation", "slew limit", "variant", 3, 8, "command passes a limit of 3 (1 - 1.5 S) rad/s^2 on its slew")
def slew_limit(size: float, rng: Rng, site: Site) -> Change:
    limit = 3.0 * (1.0 - 1.5 * size)

    def command(commands: Array, r: Rng) -> Array:
        passed = commands.copy()
        for k in range(1, len(passed)):
            passed[k] = passed[k - 1] + np.clip(commands[k] - passed[k - 1], -limit * STEP, limit * STEP)
        return passed

    return Change({"acceleration_limit": limit}, command=command)


@form("motor_saturation", "torque limit", "different", 3, 6, "|torque| <= 70 (1 - S) N m per bank")
def torque_limit(size: float, rng: Rng, site: Site) -> Change:
    limit = 70.0 * (1.0 - size)

    def plant(p: Plant) -> Plant:
        return with_motors(p, torque_limit=limit * (p.motors.torque_limit / Motors().torque_limit))

    return Change({"torque_limit": limit}, plant=plant)


@form("command_deadband", "cut out", "same", 5, 10, "u = 0 where |c| < B, else c")
def cut_out(size: float, rng: Rng, site: Site) -> Change:
    return Change({"deadband": size}, command=lambda c, r: np.where(np.abs(c) < size, 0.0, c))


@form("command_deadband", "offset", "variant", 2, 6, "u = sign(c) max(|c| - B, 0)")
def dead_zone(size: float, rng: Rng, site: Site) -> Change:
    return Change({"deadband": size}, command=lambda c, r: np.sign(c) * np.maximum(np.abs(c) - size, 0.0))


@form("command_deadband", "sticking", "different", 6, 12, "starts when |c| exceeds B, stops when it falls below B/2")
def sticking(size: float, rng: Rng, site: Site) -> Change:
    def command(commands: Array, r: Rng) -> Array:
        passed = commands.copy()
        for bank in range(2):
            moving = False
            for k, value in enumerate(np.abs(commands[:, bank])):
                moving = bool(value > (size / 2 if moving else size))
                passed[k, bank] *= moving
        return passed

    return Change({"deadband": size}, command=command)
