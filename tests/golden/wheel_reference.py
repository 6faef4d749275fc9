"""Independent reference for the forces on a torus wheel, and the writer of ``wheel_forces.csv`` beside it.

Written from the vector form of the model (surface point, directions, velocity field, stresses) with a Gauss rule on
panels graded towards the edges of the patch. It shares nothing with ``ddagr_gym``: no closed form of the shear
displacement, no substitution, no mirror kernel. Run ``python tests/golden/wheel_reference.py`` to write the CSV again.
"""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

COLUMNS = ("F_x", "F_y", "F_z", "M_z", "axle_torque")
PEAK_CEILING = 0.9
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)


class Wheel(NamedTuple):
    minor_radius: float
    half_width: float
    major_radius: float


class Soil(NamedTuple):
    cohesion: float
    friction_angle: float
    sinkage_exponent: float
    cohesive_modulus: float
    frictional_modulus: float
    shear_modulus: float
    peak_stress_coefficient_0: float
    peak_stress_coefficient_1: float
    exit_angle_ratio: float


class State(NamedTuple):
    v_x: float
    v_y: float
    omega: float
    yaw_rate: float
    sinkage: float


def surface_point(wheel: Wheel, theta, psi) -> np.ndarray:
    """Point r of the tyre's surface, (..., 3)."""
    rho = wheel.major_radius + wheel.minor_radius * np.cos(psi)
    return np.stack(
        np.broadcast_arrays(rho * np.sin(theta), wheel.half_width * np.sin(psi), -rho * np.cos(theta)), axis=-1
    )


def surface_tangents(wheel: Wheel, theta, psi) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of the point by theta and by psi, (..., 3) each."""
    rho = wheel.major_radius + wheel.minor_radius * np.cos(psi)
    sink = -wheel.minor_radius * np.sin(psi)
    by_theta = np.stack(np.broadcast_arrays(rho * np.cos(theta), 0.0, rho * np.sin(theta)), axis=-1)
    by_psi = np.stack(
        np.broadcast_arrays(sink * np.sin(theta), wheel.half_width * np.cos(psi), -sink * np.cos(theta)), axis=-1
    )
    return by_theta, by_psi


def surface_velocity(state: State, point: np.ndarray) -> np.ndarray:
    """Velocity of the tyre's surface over the soil: hub velocity plus rotation about y and z."""
    return np.array([state.v_x, state.v_y, 0.0]) + np.cross([0.0, state.omega, state.yaw_rate], point)


def slip_ratio(wheel: Wheel, state: State) -> float:
    """Section 3 of the model."""
    rim = (wheel.major_radius + wheel.minor_radius) * state.omega
    largest = max((rim, state.v_x), key=abs)
    return 0.0 if largest == 0 else math.copysign(1.0, largest) * (rim - state.v_x) / abs(largest)


class Patch:
    """Contact patch of a wheel that travels forward; every method takes arrays of theta and psi of one shape."""

    def __init__(self, wheel: Wheel, soil: Soil, state: State, minimum_shear_rate: float) -> None:
        self.wheel, self.soil, self.state = wheel, soil, state
        self.outer_radius = wheel.major_radius + wheel.minor_radius
        self.edge = math.acos(max(1.0 - state.sinkage / wheel.minor_radius, 0.0))
        width = 2.0 * wheel.half_width * math.sin(self.edge)
        self.modulus = soil.cohesive_modulus / width + soil.frictional_modulus
        share = soil.peak_stress_coefficient_0 + soil.peak_stress_coefficient_1 * slip_ratio(wheel, state)
        self.peak = min(max(share, 0.0), PEAK_CEILING)
        self.rate = max(abs(state.omega), abs(state.v_x) / self.outer_radius, minimum_shear_rate)

    def entry(self, psi: np.ndarray) -> np.ndarray:
        """theta_f of each slice."""
        rho = self.wheel.major_radius + self.wheel.minor_radius * np.cos(psi)
        return np.arccos(np.minimum((self.outer_radius - self.state.sinkage) / rho, 1.0))

    def pressure(self, theta: np.ndarray, psi: np.ndarray) -> np.ndarray:
        """Bekker's pressure at the depth of the point, or of its image ahead of the peak."""
        entry = self.entry(psi)
        peak, leave = self.peak * entry, -self.soil.exit_angle_ratio * entry
        with np.errstate(invalid="ignore", divide="ignore"):
            behind = entry - (theta - leave) / (peak - leave) * (entry - peak)
        height = surface_point(self.wheel, np.where(theta >= peak, theta, behind), psi)[..., 2]
        depth = np.maximum(-height - (self.outer_radius - self.state.sinkage), 0.0)
        return self.modulus * depth**self.soil.sinkage_exponent

    def slide(self, theta: np.ndarray, psi: np.ndarray) -> np.ndarray:
        """Sliding velocity along the tangent and the lateral direction, (..., 2)."""
        velocity = surface_velocity(self.state, surface_point(self.wheel, theta, psi))
        directions = surface_tangents(self.wheel, theta, psi)
        return np.stack([np.sum(velocity * d, axis=-1) / np.linalg.norm(d, axis=-1) for d in directions], axis=-1)

    def shear_displacement(self, theta: np.ndarray, psi: np.ndarray) -> np.ndarray:
        """Sliding summed over the time since entry, by Gauss quadrature of the velocity, (..., 2)."""
        half = 0.5 * (self.entry(psi) - theta)
        total = np.zeros((*theta.shape, 2))
        for node, weight in zip(_NODES, _WEIGHTS, strict=True):
            total += weight * self.slide(theta + half * (node + 1.0), psi)
        return total * (half / self.rate)[..., None]

    def wrench_density(self, theta: np.ndarray, psi: np.ndarray) -> np.ndarray:
        """Force and moment about the hub per d theta d psi: F_x, F_y, F_z, M_z, M_y, (..., 5)."""
        by_theta, by_psi = surface_tangents(self.wheel, theta, psi)
        area_vector = np.cross(by_psi, by_theta)
        area = np.linalg.norm(area_vector, axis=-1, keepdims=True)
        point = surface_point(self.wheel, theta, psi)
        core = surface_point(self.wheel._replace(minor_radius=0.0, half_width=0.0), theta, psi)
        inward = np.sum(area_vector * (point - core), axis=-1, keepdims=True) < 0
        outward = np.where(inward, -area_vector, area_vector) / area
        sigma = self.pressure(theta, psi)[..., None]
        displacement = np.linalg.norm(self.shear_displacement(theta, psi), axis=-1, keepdims=True)
        strength = self.soil.cohesion + sigma * math.tan(self.soil.friction_angle)
        tau = -strength * np.expm1(-displacement / self.soil.shear_modulus)
        slide = self.slide(theta, psi)
        unit = [d / np.linalg.norm(d, axis=-1, keepdims=True) for d in (by_theta, by_psi)]
        speed = np.maximum(np.linalg.norm(slide, axis=-1, keepdims=True), 1e-300)
        direction = (slide[..., :1] * unit[0] + slide[..., 1:] * unit[1]) / speed
        force = (-sigma * outward - tau * direction) * area
        moment = np.cross(point, force)
        return np.concatenate([force, moment[..., 2:], moment[..., 1:2]], axis=-1)

    def integral(self, low: float, high: float, panels: int, order: int) -> np.ndarray:
        """Wrench of the part of the patch with theta/theta_f in [low, high], (5,)."""
        share, share_weights = graded_rule(low, high, panels, order)
        psi, psi_weights = graded_rule(-self.edge, self.edge, panels, order)
        total = np.zeros(len(COLUMNS))
        for angle, weight in zip(psi, psi_weights, strict=True):
            slice_psi = np.full(share.shape, angle)
            entry = self.entry(slice_psi)
            density = self.wrench_density(share * entry, slice_psi)
            total += weight * entry[0] * (share_weights @ density)
        return total


def graded_rule(low: float, high: float, panels: int, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Composite Gauss rule whose panels shrink by three towards both ends, where the integrand is singular."""
    half = np.concatenate([[0.0], 3.0 ** np.arange(-panels + 1, 1)])
    edges = np.concatenate([half, 2.0 - half[-2::-1]]) * 0.5
    edges = np.unique(np.concatenate([edges, np.linspace(0.0, 1.0, panels + 1)]))
    nodes, weights = np.polynomial.legendre.leggauss(order)
    width = np.diff(edges)[:, None]
    places = edges[:-1, None] + width * (nodes + 1.0) / 2.0
    return low + (high - low) * places.ravel(), (high - low) * (width * weights / 2.0).ravel()


def wheel_wrench(
    wheel: Wheel, soil: Soil, state: State, *, minimum_shear_rate: float = 1e-3, panels: int = 14, order: int = 12
) -> np.ndarray:
    """F_x, F_y, F_z, M_z and axle torque of the soil on the wheel, (5,)."""
    rim = (wheel.major_radius + wheel.minor_radius) * state.omega
    if max((rim, state.v_x), key=abs) < 0:
        mirrored = state._replace(v_x=-state.v_x, omega=-state.omega, yaw_rate=-state.yaw_rate)
        wrench = wheel_wrench(wheel, soil, mirrored, minimum_shear_rate=minimum_shear_rate, panels=panels, order=order)
        return wrench * np.array([-1.0, 1.0, 1.0, -1.0, -1.0])
    patch = Patch(wheel, soil, state, minimum_shear_rate)
    front = patch.integral(patch.peak, 1.0, panels, order)
    return front + patch.integral(-soil.exit_angle_ratio, patch.peak, panels, order)


DDAGR = Wheel(0.05, 0.1016, 0.2294)
WARTHOG = Wheel(0.12, 0.127, 0.18)
HUSKY = Wheel(0.05, 0.057, 0.10875)
THESIS = Soil(4140.0, math.radians(13.0), 0.5, 13190.0, 692000.0, 0.006, 0.5, 0.5, 0.9)
SAND = Soil(1040.0, math.radians(28.0), 1.1, 990.0, 1528430.0, 0.025, 0.4, 0.15, 0.3)
SNOW = Soil(1030.0, math.radians(19.7), 1.6, 4370.0, 196720.0, 0.03, 0.4, 0.15, 0.3)
FIRM = Soil(0.0, math.atan(0.8), 1.0, 0.0, 5.0e7, 0.004, 0.1, 0.1, 0.8)
CLAY = Soil(68950.0, math.radians(34.0), 0.13, 12700.0, 1555950.0, 0.006, 0.4, 0.15, 0.3)

CASES: dict[str, tuple[Wheel, Soil, State]] = {
    "driven_straight": (DDAGR, THESIS, State(0.1942, 0.0, 0.701, 0.0, 0.010)),
    "inner_wheel_of_table_6_2_locked": (DDAGR, THESIS, State(0.032, 0.066, 0.0, 0.211, 0.010)),
    "outer_wheel_of_table_6_2": (DDAGR, THESIS, State(0.277, -0.073, 1.195, 0.211, 0.011)),
    "spinning_on_the_spot": (DDAGR, SAND, State(0.0, 0.0, 2.0, 0.0, 0.030)),
    "dragged_sideways": (DDAGR, SAND, State(2e-3, 0.3, 0.0, 0.0, 0.020)),
    "counter_rotating_backwards": (DDAGR, THESIS, State(0.1, -0.05, -0.9, 0.3, 0.012)),
    "braked_in_snow": (HUSKY, SNOW, State(0.5, 0.1, 1.2, -0.4, 0.045)),
    "reversing_fast": (WARTHOG, FIRM, State(-3.0, 0.4, -11.0, 1.5, 0.002)),
    "slow_creep_at_the_shear_rate_floor": (HUSKY, SAND, State(1e-3, 2e-5, 5e-3, 1e-4, 0.010)),
    "stiff_clay_turning": (WARTHOG, CLAY, State(1.0, -0.3, 3.9, -0.8, 0.0015)),
    "sunk_to_the_limit": (DDAGR, SNOW, State(0.2, 0.05, 1.5, 0.2, 0.05)),
    "yawing_at_rest": (HUSKY, THESIS, State(0.0, 0.0, 0.02, 0.8, 0.008)),
}


def write(path: Path) -> None:
    """Compute every case and write one row each."""
    parameters = [*Wheel._fields, *Soil._fields, *State._fields]
    with path.open("w", newline="") as handle:
        writer = csv.writer(handle, lineterminator="\n")
        writer.writerow(["case", *parameters, *COLUMNS])
        for name, (wheel, soil, state) in CASES.items():
            wrench = wheel_wrench(wheel, soil, state)
            writer.writerow([name, *map(repr, map(float, (*wheel, *soil, *state, *wrench)))])


if __name__ == "__main__":
    write(Path(__file__).with_name("wheel_forces.csv"))
