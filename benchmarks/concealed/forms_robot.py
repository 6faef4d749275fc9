"""Forms of the effects on the robot's body and what it drags."""

from __future__ import annotations

import math

import numpy as np

from . import externals
from .change import Change, Rng, Site, form, signed, with_body, with_external, with_radii
from .plant import Plant


@form("payload", "low", "same", 4, 8, "mass + m at the centre, inertia + m 0.2^2")
def low_payload(size: float, rng: Rng, site: Site) -> Change:
    def plant(p: Plant) -> Plant:
        return with_body(p, mass=p.body.mass + size, inertia=p.body.inertia + 0.04 * size)

    return Change({"mass": size}, plant=plant)


@form("payload", "mast", "variant", 4, 8, "mass + m spread out 0.5 m wide, and centre of mass higher by m 0.6/(M + m)")
def high_payload(size: float, rng: Rng, site: Site) -> Change:
    def plant(p: Plant) -> Plant:
        body = p.body
        height = (body.mass * body.mass_height + size * (body.mass_height + 0.6)) / (body.mass + size)
        return with_body(p, mass=body.mass + size, inertia=body.inertia + 0.25 * size, mass_height=height)

    return Change({"mass": size}, plant=plant)


@form("centre_of_mass_offset", "anywhere", "same", 2, 6, "N_i ~ (1 +- x/L)(1 +- y/W), forces act about (x, y)")
def offset_anywhere(size: float, rng: Rng, site: Site) -> Change:
    angle = rng.uniform(-math.pi, math.pi)
    x, y = size * math.cos(angle), 1.5 * size * math.sin(angle)
    return Change({"x": x, "y": y}, plant=lambda p: with_body(p, mass_x=x, mass_y=y))


@form("centre_of_mass_offset", "along", "variant", 3, 7, "x only, and the inertia grows by M x^2 (battery moved)")
def offset_along(size: float, rng: Rng, site: Site) -> Change:
    x = signed(rng) * size

    def plant(p: Plant) -> Plant:
        return with_body(p, mass_x=x, inertia=p.body.inertia + p.body.mass * x * x)

    return Change({"x": x, "y": 0.0}, plant=plant)


@form("wheel_radius_mismatch", "banks", "same", 2, 6, "R_right/R_left = 1 + e, mean kept")
def bank_mismatch(size: float, rng: Rng, site: Site) -> Change:
    ratio = signed(rng) * size
    sides = 0.5 * ratio * np.array([1.0, -1.0, 1.0, -1.0])
    return Change({"ratio": ratio}, plant=lambda p: with_radii(p, sides))


@form("wheel_radius_mismatch", "one wheel", "different", 5, 10, "one wheel's radius is smaller by e (soft tyre)")
def one_small_wheel(size: float, rng: Rng, site: Site) -> Change:
    wheel = int(rng.integers(4))
    growth = -size * np.eye(4)[wheel]
    parameters = {"ratio": -size if wheel % 2 == 0 else size, "wheel": wheel + 1}
    return Change(parameters, plant=lambda p: with_radii(p, growth))


def _dragging(row: np.ndarray, **parameters: float) -> Change:
    def plant(p: Plant) -> Plant:
        return with_external(p, row)

    return Change(parameters, plant=plant)


@form("towed_drag", "hitch", "same", 3, 8, "-F V/(|V| + 0.01) at a hitch 0.55 m behind the centre, V its velocity")
def hitch_drag(size: float, rng: Rng, site: Site) -> Change:
    return _dragging(externals.row(externals.DRAG, size, -0.55, 0.0, 0.01), force=size, hitch_x=-0.55, hitch_y=0.0)


@form("towed_drag", "offset hitch", "variant", 3, 8, "the same with the hitch up to 0.25 m to a side")
def offset_hitch_drag(size: float, rng: Rng, site: Site) -> Change:
    side = signed(rng) * rng.uniform(0.1, 0.25)
    return _dragging(externals.row(externals.DRAG, size, -0.6, side, 0.02), force=size, hitch_x=-0.6, hitch_y=side)


@form("towed_drag", "sledge", "different", 4, 8, "sledge of 12 kg with Coulomb friction F on an elastic rope, 2 kN/m")
def sledge(size: float, rng: Rng, site: Site) -> Change:
    rope = rng.uniform(0.6, 1.2)
    row = externals.row(externals.SLEDGE, size, rope, 2000.0, 12.0, -0.5)
    return _dragging(row, force=size, hitch_x=-0.5, hitch_y=0.0, rope=rope)


@form("viscous_drag", "linear", "same", 3, 8, "-c v on both axes, -0.3 m^2 c w on yaw")
def linear_drag(size: float, rng: Rng, site: Site) -> Change:
    return _dragging(externals.row(externals.VISCOUS, size, size, 0.3 * size, 1.0), coefficient=size)


@form("viscous_drag", "power law", "variant", 3, 8, "-c |v/0.2|^0.5 v along x and y, none on yaw")
def power_drag(size: float, rng: Rng, site: Site) -> Change:
    row = externals.row(externals.VISCOUS, size / math.sqrt(0.2), size / math.sqrt(0.2), 0.0, 1.5)
    return _dragging(row, coefficient=size)


@form("viscous_drag", "mud at wheels", "different", 3, 8, "-c/4 times each wheel hub's velocity")
def mud(size: float, rng: Rng, site: Site) -> Change:
    def plant(p: Plant) -> Plant:
        return with_external(p, externals.row(externals.MUD, size / 4.0, p.body.half_wheelbase, p.body.half_track))

    return Change({"coefficient": size}, plant=plant)
