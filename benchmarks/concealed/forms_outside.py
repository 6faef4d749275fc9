"""Effects that no library lists: forces, ground and drives. Sizes are multiples of the figure in the equation."""

from __future__ import annotations

import math

import numpy as np

from . import externals
from .change import Array, Change, Rng, Site, outside, signed, with_external, with_ground, with_motors, with_wheels
from .forms_drive import delayed
from .plant import Plant


def _force(kind: float, *numbers: float, **parameters: float) -> Change:
    row = externals.row(kind, *numbers)
    return Change(parameters, plant=lambda p: with_external(p, row))


@outside("tether", "elastic", "-15 N/m max(0, d - 0.5 m) towards a point on the ground")
def tether(size: float, rng: Rng, site: Site) -> Change:
    x, y = site.point(rng, 0.0, 0.3)
    return _force(externals.TETHER, x, y, 15.0 * size, 0.5, stiffness=15.0 * size, x=x, y=y)


@outside("bearing_drag", "broken chain", "one wheel not driven, and 30 N of friction at its hub")
def bearing_drag(size: float, rng: Rng, site: Site) -> Change:
    wheel = int(rng.integers(4))
    free = np.eye(4)[wheel]
    along, across = (1.0 if wheel < 2 else -1.0), (1.0 if wheel % 2 else -1.0)

    def plant(p: Plant) -> Plant:
        x, y = along * p.body.half_wheelbase, across * p.body.half_track
        return with_external(with_wheels(p, free=free), externals.row(externals.HUB_DRAG, 30.0 * size, x, y, 0.01))

    return Change({"wheel": wheel + 1, "force": 30.0 * size}, plant=plant)


@outside("wheel_bounce", "flat spot", "one wheel's load times 1 + 0.4 cos(bank angle)")
def wheel_bounce(size: float, rng: Rng, site: Site) -> Change:
    wheel = int(rng.integers(4))
    bounce = 0.4 * size * np.eye(4)[wheel]
    return Change({"wheel": wheel + 1, "share": 0.4 * size}, plant=lambda p: with_wheels(p, bounce=bounce))


@outside("lug_force", "periodic", "12 N sin(18 phi) along x at each bank, phi its angle")
def lug_force(size: float, rng: Rng, site: Site) -> Change:
    return _force(externals.LUGS, 12.0 * size, 18.0, amplitude=12.0 * size)


@outside("wind", "gusty", "25 N fixed in the world, 1.6 times that on the side, 40 % gust of 9 s period")
def wind(size: float, rng: Rng, site: Site) -> Change:
    angle = rng.uniform(-math.pi, math.pi)
    force = (25.0 * size * math.cos(angle), 25.0 * size * math.sin(angle))
    return _force(externals.WIND, *force, 0.4, 9.0, 1.6, force=25.0 * size, angle=angle)


@outside("bowl", "round", "height d^2/2 * 0.012/m about a point, gradient at most 0.09")
def bowl(size: float, rng: Rng, site: Site) -> Change:
    x, y = site.middle()
    values = {"bowl_x": x, "bowl_y": y, "bowl_curvature": signed(rng) * 0.012 * size, "bowl_limit": 0.09}
    return Change(values, plant=lambda p: with_ground(p, **values))


@outside("gear_backlash", "torsional play", "encoder leads the wheel by 0.02 rad tanh(torque/8 N m)")
def gear_backlash(size: float, rng: Rng, site: Site) -> Change:
    play = 0.02 * size

    def encoder(angles: Array, truth: dict[str, Array], r: Rng) -> Array:
        torque = np.column_stack([truth["torque_right"], truth["torque_left"]])
        return angles + play * np.tanh(torque / 8.0)

    return Change({"play": play}, encoder=encoder)  # type: ignore[arg-type]


@outside("low_speed_gain", "asymmetric", "right command times 1 + 0.1 exp(-|c|/0.4), left 1 - it")
def low_speed_gain(size: float, rng: Rng, site: Site) -> Change:
    side = 0.1 * size * signed(rng) * np.array([1.0, -1.0])
    return Change({"gain": side[0]}, command=lambda c, r: c * (1.0 + side * np.exp(-np.abs(c) / 0.4)))


@outside("soil_drying", "exponential", "strength times exp(0.0025/s t) over all three drives")
def soil_drying(size: float, rng: Rng, site: Site) -> Change:
    rate = 0.0025 * size * signed(rng)
    return Change({"rate": rate}, plant=lambda p: with_ground(p, drying=rate))


@outside("coulter", "sideways friction", "50 N of sideways friction 0.5 m before or behind the centre")
def coulter(size: float, rng: Rng, site: Site) -> Change:
    x = 0.5 * signed(rng)
    return _force(externals.COULTER, 50.0 * size, x, 0.01, force=50.0 * size, x=x)


@outside("toe", "skewed wheel", "one wheel's plane turned by 3 degrees", reserved=True)
def toe(size: float, rng: Rng, site: Site) -> Change:
    wheel, angle = int(rng.integers(4)), signed(rng) * math.radians(3.0) * size
    return Change({"wheel": wheel + 1, "angle": angle}, plant=lambda p: with_wheels(p, toe=angle * np.eye(4)[wheel]))


@outside("brownout", "cut outs", "both commands drop to nothing for 0.25 s about every 8 s", reserved=True)
def brownout(size: float, rng: Rng, site: Site) -> Change:
    def command(commands: Array, r: Rng) -> Array:
        cut = commands.copy()
        for start in np.flatnonzero(r.random(len(commands)) < 1.0 / (8.0 * 400.0)):
            cut[start : start + int(100 * size)] = 0.0
        return cut

    return Change({"length": 0.25 * size}, command=command)


@outside("coupled_banks", "coupling", "each command gets 5 % of the other's less its own", reserved=True)
def coupled_banks(size: float, rng: Rng, site: Site) -> Change:
    share = 0.05 * size
    return Change({"share": share}, command=lambda c, r: c + share * (c[:, ::-1] - c))


@outside("ploughed", "anisotropic", "lateral wheel force times 1 - 0.25 cos 2(yaw - furrows)", reserved=True)
def ploughed(size: float, rng: Rng, site: Site) -> Change:
    values = {"furrow": 0.25 * size, "furrow_angle": rng.uniform(-math.pi, math.pi)}
    return Change(values, plant=lambda p: with_ground(p, **values))


@outside("sloshing", "liquid tank", "15 kg on a spring of 0.7 Hz, damping ratio 0.05", reserved=True)
def sloshing(size: float, rng: Rng, site: Site) -> Change:
    rate = 2.0 * math.pi * rng.uniform(0.6, 0.8)
    return _force(externals.SLOSH, 15.0 * size, rate, 0.05, mass=15.0 * size, rate=rate)


@outside("motor_fading", "heating", "speed loops' rate falls by 0.2 % per second of operation", reserved=True)
def motor_fading(size: float, rng: Rng, site: Site) -> Change:
    return Change({"rate": 0.002 * size}, plant=lambda p: with_motors(p, fading=0.002 * size))


@outside("old_ruts", "guiding", "40 N sin(2 pi s/0.9 m) across old ruts", reserved=True)
def old_ruts(size: float, rng: Rng, site: Site) -> Change:
    angle = rng.uniform(-math.pi, math.pi)
    return _force(externals.RUTS, 40.0 * size, angle, 0.9, force=40.0 * size, angle=angle)


@outside("resting_soil", "thixotropic", "strength exp(0.4/(1 + (rolling/0.2 rad/s)^2)) near rest", reserved=True)
def resting_soil(size: float, rng: Rng, site: Site) -> Change:
    return Change({"gain": 0.4 * size}, plant=lambda p: with_ground(p, aging=0.4 * size))


@outside("delay_by_speed", "bus load", "command delay of 0.25 s times |turning command|/(1 rad/s)", reserved=True)
def delay_by_speed(size: float, rng: Rng, site: Site) -> Change:
    def command(commands: Array, r: Rng) -> Array:
        return delayed(commands, 0.25 * size * np.abs(commands[:, 0] - commands[:, 1]))

    return Change({"gain": 0.25 * size}, command=command)
