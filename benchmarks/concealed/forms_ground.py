"""Forms of the effects of the ground."""

from __future__ import annotations

import math

import numpy as np

from .change import Change, Rng, Site, form, patch_row, signed, with_ground, with_soil
from .ground import BAND, DISC
from .manoeuvres import PAUSE_BETWEEN_RUNS
from .plant import Plant

RIGHT = np.array([1.0, 0.0, 1.0, 0.0])


def _slope(size: float, rng: Rng, **more: float) -> Change:
    uphill = rng.uniform(-math.pi, math.pi)
    steep = math.tan(size)
    values = {"gradient_x": steep * math.cos(uphill), "gradient_y": steep * math.sin(uphill), **more}
    return Change({"angle": size, "uphill": uphill}, plant=lambda p: with_ground(p, **values))


@form("slope", "plane", "same", 2, 8, "g sin(slope) downhill, fixed in the world; loads follow")
def plane(size: float, rng: Rng, site: Site) -> Change:
    return _slope(size, rng)


@form("slope", "ridge", "variant", 3, 8, "slope 30 % steeper on one side of a line than on the other")
def ridge(size: float, rng: Rng, site: Site) -> Change:
    return _slope(size, rng, ridge=0.15, ridge_angle=rng.uniform(-math.pi, math.pi))


@form("soil_change", "everything", "same", 3, 6, "strength times exp(s), stiffness times exp(1.5 s)")
def all_changed(size: float, rng: Rng, site: Site) -> Change:
    ln = signed(rng) * size
    factors = {"strength": math.exp(ln), "stiffness": math.exp(1.5 * ln)}
    return Change({"ln_strength": ln, "ln_stiffness": 1.5 * ln}, plant=lambda p: with_soil(p, **factors))


@form(
    "soil_change",
    "onset",
    "variant",
    3,
    6,
    "strength exp(s), stiffness exp(1.5 s) from a moment in the second drive on",
)
def changed_from(size: float, rng: Rng, site: Site) -> Change:
    ln, onset = signed(rng) * size, PAUSE_BETWEEN_RUNS + rng.uniform(15.0, 45.0)
    values = {"onset": onset, "onset_strength": ln, "onset_stiffness": 1.5 * ln}
    parameters = {"ln_strength": ln, "ln_stiffness": 1.5 * ln, "onset_in_run_2": onset - PAUSE_BETWEEN_RUNS}
    return Change(parameters, plant=lambda p: with_ground(p, **values))


@form("soil_change", "another soil", "different", 3, 6, "cohesion exp(-s), tan phi exp(s), K exp(2 s): clay to sand")
def another_soil(size: float, rng: Rng, site: Site) -> Change:
    def plant(p: Plant) -> Plant:
        angle = math.atan(math.exp(size) * math.tan(p.soil.friction_angle))
        changed = with_soil(p, cohesion=math.exp(-size), shear_length=math.exp(2.0 * size))
        return changed._replace(soil=changed.soil._replace(friction_angle=angle))

    return Change({"ln_cohesion": -size, "ln_tan_friction": size, "ln_shear_length": 2.0 * size}, plant=plant)


def _split(strength: float, stiffness: float) -> Change:
    side = np.where(RIGHT > 0.5, 0.5, -0.5)

    def plant(p: Plant) -> Plant:
        return with_ground(p, wheel_strength=np.exp(strength * side), wheel_stiffness=np.exp(stiffness * side))

    return Change({"ln_strength_ratio": strength, "ln_stiffness_ratio": stiffness}, plant=plant)


@form("soil_split", "both", "same", 3, 7, "right over left: strength exp(s), stiffness exp(1.5 s)")
def split_both(size: float, rng: Rng, site: Site) -> Change:
    ln = signed(rng) * size
    return _split(ln, 1.5 * ln)


@form("soil_split", "strength", "variant", 3, 7, "right over left: strength exp(s), stiffness equal")
def split_strength(size: float, rng: Rng, site: Site) -> Change:
    return _split(signed(rng) * size, 0.0)


@form("soil_split", "stiffness", "different", 4, 9, "right over left: stiffness exp(2 s), strength equal")
def split_stiffness(size: float, rng: Rng, site: Site) -> Change:
    return _split(0.0, 2.0 * signed(rng) * size)


def _patches(rows: list[np.ndarray], ln: float) -> Change:
    def plant(p: Plant) -> Plant:
        return with_ground(p, patches=np.concatenate([p.ground.patches, *rows]))

    where = [[float(r[0, k]) for k in range(5)] for r in rows]
    return Change({"ln_strength": ln, "ln_stiffness": 1.5 * ln, "kind_x_y_radius_angle": where}, plant=plant)


@form("soil_patch", "disc", "same", 3, 6, "strength exp(s), stiffness exp(1.5 s) within a disc that a drive crosses")
def disc(size: float, rng: Rng, site: Site) -> Change:
    ln = signed(rng) * size
    return _patches([patch_row(DISC, site.point(rng), rng.uniform(1.0, 1.6), 0.0, ln)], ln)


@form("soil_patch", "band", "variant", 3, 6, "the same within a band 1.2-2.4 m wide, as from an old track")
def band(size: float, rng: Rng, site: Site) -> Change:
    ln = signed(rng) * size
    angle = rng.uniform(-math.pi, math.pi)
    return _patches([patch_row(BAND, site.point(rng), rng.uniform(0.6, 1.2), angle, ln)], ln)


@form("soil_patch", "scattered", "different", 4, 6, "four discs of 0.5-0.8 m radius")
def scattered(size: float, rng: Rng, site: Site) -> Change:
    ln = signed(rng) * size
    rows = [patch_row(DISC, site.point(rng, 0.15, 0.85), rng.uniform(0.5, 0.8), 0.0, ln) for _ in range(4)]
    return _patches(rows, ln)


@form("lateral_bulldozing", "immediate", "same", 3, 8, "side force B l (gamma z^2 Kp/2 + 2 c z sqrt Kp) against v_y")
def bulldozing(size: float, rng: Rng, site: Site) -> Change:
    return Change({"gain": size}, plant=lambda p: with_ground(p, bulldozing_mode=1, bulldozing_gain=size))


@form("lateral_bulldozing", "berm", "different", 3, 8, "the same times a berm left behind over 0.3 m")
def berm(size: float, rng: Rng, site: Site) -> Change:
    return Change({"gain": size}, plant=lambda p: with_ground(p, bulldozing_mode=2, bulldozing_gain=size))


@form("slip_sinkage", "immediate", "same", 6, 12, "stiffness divided by sqrt(1 + s |slip|): sinkage times 1 + s |slip|")
def slip_sinkage(size: float, rng: Rng, site: Site) -> Change:
    return Change({"gain": size}, plant=lambda p: with_ground(p, sinkage_mode=1, sinkage_gain=size))


@form("slip_sinkage", "digging", "different", 6, 12, "slip replaced by the soil dug out, left behind over 0.3 m")
def digging(size: float, rng: Rng, site: Site) -> Change:
    return Change({"gain": size}, plant=lambda p: with_ground(p, sinkage_mode=2, sinkage_gain=size))


@form("multipass", "alignment", "same", 5, 10, "trailing wheels' soil stiffer by m exp(-(2 L w/v/0.35)^2)")
def aligned_pass(size: float, rng: Rng, site: Site) -> Change:
    return Change({"stiffening": size}, plant=lambda p: with_ground(p, rut_mode=1, rut_gain=size))


@form("multipass", "rut map", "different", 5, 10, "soil stiffer by m wherever a wheel passed before (map)")
def rut_map(size: float, rng: Rng, site: Site) -> Change:
    return Change({"stiffening": size}, plant=lambda p: with_ground(p, rut_mode=2, rut_gain=size))
