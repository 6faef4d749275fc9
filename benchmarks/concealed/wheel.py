"""A rigid torus wheel cut into strips across the tyre, each with points along its contact.

The stress profile depends on sinkage, slip and soil and is laid once per step; the shear forces are then summed
over it for as many motions as the integrator asks for. Along a strip of radius ``rho`` with entry angle ``theta_f``

    sigma(theta) = p(z_m) sin(pi zeta)^n,  zeta = u^q,  u = (theta + theta_r)/(theta_f + theta_r),
    q = ln(1/2)/ln(u_m): the peak lies at theta_m = (peak_0 + peak_1 slip) theta_f, at depth z_m.

``direction`` in [-1, 1] turns the contact smoothly from forward to backward travel; at rest it is symmetric.
Shear displacement accumulates from entry while the tread turns at the rate nu, the 8-norm of wheel spin, soil
passage v/R and a creep rate (saturates for a locked wheel, viscous at rest).
"""

from __future__ import annotations

import math

import numpy as np

from .jit import kernel
from .soil import KONDNER, mobilised, pressure

STRIPS = 3
"""Strips on each side of the wheel's middle plane."""
POINTS = 12
"""Points along each strip."""
NODES = STRIPS * POINTS
CREEP_RATE = 0.005
"""Rate of shear relaxation at rest [rad/s]."""
PROFILE_FIELDS = 8


@kernel
def transit_rate(spin, speed, radius):  # type: ignore[no-untyped-def]
    """Rate nu [rad/s] at which shear displacement is carried through the contact."""
    total = spin**8 + (speed / radius) ** 8 + CREEP_RATE**8
    return math.sqrt(math.sqrt(math.sqrt(total)))


@kernel
def lay_profile(soil, wheel, sinkage, slip, direction, speed, profile):  # type: ignore[no-untyped-def]
    """Fill ``profile`` (fields, nodes); return the normal stresses' (forward force, vertical force) [N].

    ``wheel`` is (minor radius, half width, major radius) [m]. Forces are for the direction of travel.
    """
    minor, half_width, major = wheel
    hub = major + minor - sinkage
    edge = half_width * math.sqrt(max(1.0 - max(1.0 - sinkage / minor, 0.0) ** 2, 1e-12))
    strip_width = edge / STRIPS
    tan_friction = math.tan(soil.friction_angle)
    span = 0.5 * (1.0 + soil.exit_ratio)
    skew = 0.5 * (1.0 - soil.exit_ratio)
    magnitude = abs(direction)
    shift = magnitude * min(max(soil.peak_0 + soil.peak_1 * slip, 0.05), 0.8)
    forward, vertical = 0.0, 0.0
    node = 0
    for strip in range(STRIPS):
        side = edge * (strip + 0.5) / STRIPS
        section = math.sqrt(1.0 - (side / half_width) ** 2)
        radius = major + minor * section
        stretch = math.sqrt(1.0 + (minor * side / (half_width**2 * section)) ** 2)
        geometric = math.acos(min(hub / radius, 1.0))
        entry = geometric * (span + magnitude * skew)
        leave = -geometric * (span - magnitude * skew)
        peak = shift * geometric
        stress = pressure(soil, max(radius * math.cos(peak) - hub, 0.0), 2.0 * edge, speed)
        bend = math.log(0.5) / math.log((peak - leave) / (entry - leave))
        for point in range(POINTS):
            share = (point + 0.5) / POINTS
            theta = leave + share * (entry - leave)
            sigma = stress * math.sin(math.pi * share**bend) ** soil.exponent
            sine, cosine = math.sin(theta), math.cos(theta)
            area = radius * strip_width * (entry - leave) / POINTS
            forward -= 2.0 * sigma * sine * area
            vertical += 2.0 * sigma * cosine * area
            profile[0, node] = sine
            profile[1, node] = cosine
            profile[2, node] = entry - theta
            profile[3, node] = math.sin(entry) - sine
            profile[4, node] = cosine - math.cos(entry)
            profile[5, node] = soil.strength * (soil.cohesion + sigma * tan_friction) * area * stretch
            profile[6, node] = radius
            profile[7, node] = side
            node += 1
    return forward, vertical


@kernel
def shear_forces(soil, profile, direction, v_x, v_y, spin, turn, radius, out):  # type: ignore[no-untyped-def]
    """Sum the shear stresses over a laid profile into ``out``.

    Args:
        soil: local soil.
        profile: from :func:`lay_profile`.
        direction: sign of travel; a wheel that travels backwards is evaluated mirrored in x.
        v_x, v_y: hub velocity in the wheel's frame [m/s].
        spin, turn: wheel speed and yaw rate [rad/s].
        radius: outer radius [m].
        out: (forward force, lateral force, vertical force [N], yaw moment, axle moment [N m]); the axle moment
            is what the drive must supply.
    """
    mirror = 1.0 if direction >= 0.0 else -1.0
    v_x, spin, turn = mirror * v_x, mirror * spin, mirror * turn
    rate = 1.0 / transit_rate(spin, v_x, radius)
    forward, lateral, vertical, yaw_moment, axle = 0.0, 0.0, 0.0, 0.0, 0.0
    hyperbola = soil.shear_law == KONDNER
    for node in range(NODES):
        sine, cosine, rho, side = profile[0, node], profile[1, node], profile[6, node], profile[7, node]
        across = (v_y * profile[2, node] + turn * rho * profile[4, node]) * rate
        for half in range(2):
            arm = side if half == 0 else -side
            along = (spin * rho * profile[2, node] - (v_x - turn * arm) * profile[3, node]) * rate
            size = math.sqrt(along * along + across * across)
            share = 1.0 / (soil.shear_length + size) if hyperbola else mobilised(soil, size)
            pull = profile[5, node] * share * along
            push = -profile[5, node] * share * across
            forward += pull * cosine
            vertical += pull * sine
            lateral += push
            axle += pull * rho
            yaw_moment += rho * sine * push - arm * pull * cosine
    out[0], out[1], out[2] = mirror * forward, lateral, vertical
    out[3], out[4] = mirror * yaw_moment, mirror * axle


@kernel
def travel_direction(v_x, spin, radius, blend):  # type: ignore[no-untyped-def]
    """Smooth sign of travel in [-1, 1]; ``blend`` [m/s] is the speed over which it turns."""
    return math.tanh((radius * spin + v_x) / blend)


def static_wheel(soil, wheel, load, v_x, v_y, spin, turn):  # type: ignore[no-untyped-def]
    """Force of the soil on one wheel at vertical equilibrium, for calibration and tests.

    Args:
        soil: :class:`~benchmarks.concealed.soil.Soil`.
        wheel: (minor radius, half width, major radius) [m].
        load: vertical load [N].
        v_x, v_y: hub velocity [m/s].
        spin, turn: wheel speed and yaw rate [rad/s].

    Returns:
        (sinkage [m], array of forward, lateral, vertical force [N], yaw moment, axle moment [N m]).
    """
    from scipy.optimize import brentq

    radius = wheel[0] + wheel[2]
    direction = float(travel_direction(v_x, spin, radius, 0.005))
    slip = math.copysign(1.0, direction) * wheel_slip(v_x, spin, radius)
    profile, out = np.zeros((PROFILE_FIELDS, NODES)), np.zeros(5)

    def excess(sinkage: float) -> float:
        forward, vertical = lay_profile(soil, wheel, sinkage, slip, direction, math.hypot(v_x, v_y), profile)
        shear_forces(soil, profile, direction, v_x, v_y, spin, turn, radius, out)
        out[0] += math.copysign(1.0, direction) * forward
        out[2] += vertical
        return float(out[2] - load)

    sinkage = float(brentq(excess, 1e-5, 0.999 * wheel[0], xtol=1e-9))
    excess(sinkage)
    return sinkage, out.copy()


@kernel
def wheel_slip(v_x, spin, radius):  # type: ignore[no-untyped-def]
    """(R omega - v_x) over the larger of both in size, within [-1, 1]; not yet signed by travel."""
    rolling = radius * spin
    larger = max(abs(rolling), abs(v_x), 1e-6)
    return min(max((rolling - v_x) / larger, -1.0), 1.0)
