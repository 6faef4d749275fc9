"""What the filter's force laws cost against the terramechanic wheel, and which parameters fit it.

Errors are relative to the largest force of the fitted set.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ddagr_gym.estimation.force_laws import ForceLaw, wheel_law
from ddagr_gym.jit import kernel
from ddagr_gym.parameters import STANDARD_GRAVITY, Robot, Soil
from ddagr_gym.physics import equilibrium_sinkage, wheel_force
from ddagr_gym.physics.soil_draws import draw_soil, get_distribution
from ddagr_gym.presets import get_soil

Array = NDArray[np.float64]

REST_SPEED, REVERSAL_SPEED = 1e-3, 1e-2
"""Smoothing of the laws in a fit [m/s]."""
LAWS: Mapping[str, tuple[ForceLaw, bool]] = {
    "thesis": (ForceLaw.thesis, False),
    "thesis_with_resistance": (ForceLaw.thesis, True),
    "coupled": (ForceLaw.coupled, True),
}
"""Laws by name: form, and whether motion resistance is fitted."""
STATE_SETS = ("grid", "turn")
RATIOS = ("traction_limit_over_load", "traction_rate", "coupling", "resistance_over_limit")
_NONE = np.log(1e-9)
_SPEED = 0.2  # [m/s]; forces depend on ratios of speeds only


class LawFit(NamedTuple):
    """A fitted law.

    Attributes:
        logs: (4,) of a1 [N], a2, b [N/rad], Rc [N].
        errors: (N, 2) law less truth [N].
        peak: (2,) largest true force along x and y [N].
    """

    logs: Array
    errors: Array
    peak: Array


def grid_states(robot: Robot) -> Array:
    """The thesis's 2,500 points: slip -1..1, slip angle -60..60 degrees. Columns v_x, v_y, omega, yaw rate."""
    slips, angles = np.meshgrid(np.linspace(-0.98, 0.98, 50), np.linspace(-np.pi / 3, np.pi / 3, 50))
    slip, angle = np.ravel(slips), np.ravel(angles)
    rim = np.where(slip >= 0, _SPEED / (1 - np.maximum(slip, 0)), _SPEED * (1 + slip))
    zero = np.zeros(slip.size)
    return np.column_stack([zero + _SPEED, _SPEED * np.tan(angle), rim / robot.wheels[0].outer_radius, zero])


def turn_states(robot: Robot, rng: np.random.Generator, count: int = 400) -> Array:
    """Wheel states of turns of 0.6-1.4 m at 0.10-0.25 m/s, one in five straight; inner banks drag, outer ones drive."""
    speed = rng.uniform(0.10, 0.25, count)
    yaw_rate = speed / rng.uniform(0.6, 1.4, count) * rng.choice([-1, 1], count) * (rng.random(count) > 0.2)
    v_x = speed + rng.choice([-1, 1], count) * robot.half_track * yaw_rate
    v_y = 0.01 * rng.standard_normal(count) + rng.choice([-1, 1], count) * robot.half_wheelbase * yaw_rate
    slip = np.where(v_x < 0.1, -rng.uniform(0, 1, count), rng.uniform(-0.1, 0.35, count))
    rim = np.where(slip >= 0, v_x / (1 - slip), v_x * (1 + slip))
    rim = np.where(v_x > 0, rim, rng.uniform(-0.03, 0.03, count))
    return np.column_stack([v_x, v_y, rim / robot.wheels[0].outer_radius, yaw_rate])


def true_forces(robot: Robot, soil: Soil, states: Array) -> Array:
    """F_x, F_y (N, 2) [N] at the static load; bogged wheels as NaN."""
    wheel, load = robot.wheels[0], robot.mass * STANDARD_GRAVITY / 4
    v_x, v_y, omega, yaw_rate = states.T
    sinkage, status = equilibrium_sinkage(wheel, soil, v_x, v_y, omega, yaw_rate, load)
    force = np.array(wheel_force(wheel, soil, v_x, v_y, omega, yaw_rate, sinkage).force[:, :2])
    force[np.asarray(status) != 0] = np.nan
    return force


@kernel()
def law_forces(law: float, p: Array, states: Array, radius: float, forces: Array) -> None:
    """Forces (N, 2) of a law with parameters p = a1, a2, b, Rc; written to ``forces``."""
    for n in range(states.shape[0]):
        values = wheel_law(
            law, states[n, 0], states[n, 1], radius * states[n, 2], p[0], p[1], p[2], p[3], REST_SPEED, REVERSAL_SPEED
        )
        forces[n, 0], forces[n, 1] = values[0], values[8]


def fit_law(law: ForceLaw, states: Array, forces: Array, radius: float, *, resistance: bool = True) -> LawFit:
    """Parameters of least squared force error.

    Args:
        law: its form.
        states: (N, 4) hub velocity forward and to the left [m/s], bank speed [rad/s]; the fourth column is not used.
        forces: (N, 2) true ones [N].
        radius: R0 [m].
        resistance: whether there is motion resistance.
    """
    peak = np.abs(forces).max(axis=0)
    start = np.log([max(peak[0], 1.0), 5.0, max(2 * peak[1], 1.0), 20.0])
    free = 4 if resistance else 3
    modelled = np.empty(forces.shape)

    def logs(p: Array) -> Array:
        return p if resistance else np.append(p, _NONE)

    def residual(p: Array) -> Array:
        law_forces(float(law), np.exp(logs(p)), states, radius, modelled)
        return (modelled - forces).ravel()

    best = least_squares(residual, start[:free], bounds=(-25.0, 25.0))
    return LawFit(logs(best.x), best.fun.reshape(-1, 2), peak)


def summarise(fits: Sequence[LawFit], load: float) -> dict[str, Any]:
    """Medians over soils of the relative errors, and the prior's ratios with their scatter."""
    worst = np.array([np.abs(fit.errors).max(axis=0) / fit.peak for fit in fits])
    rms = np.array([np.sqrt((fit.errors**2).mean(axis=0)) / fit.peak for fit in fits])
    logs = np.array([fit.logs for fit in fits])
    ratios = np.column_stack(
        [logs[:, 0] - np.log(load), logs[:, 1], logs[:, 2] - logs[:, 0] - logs[:, 1], logs[:, 3] - logs[:, 0]]
    )
    return {
        "peak_error_x": float(np.median(worst[:, 0])),
        "peak_error_y": float(np.median(worst[:, 1])),
        "rms_error_x": float(np.median(rms[:, 0])),
        "rms_error_y": float(np.median(rms[:, 1])),
        "prior": {
            name: {"median": float(np.exp(np.median(r))), "log_deviation": float(r.std()) if len(r) > 1 else 0.0}
            for name, r in zip(RATIOS, ratios.T, strict=True)
        },
    }


def draw_soils(name: str, robot: Robot, count: int, seed: int) -> list[Soil]:
    """``count`` soils of a distribution, or the one preset of that name."""
    if name == "thesis_a1":
        return [get_soil(name)]
    rng = np.random.default_rng(seed)
    return [draw_soil(get_distribution(name), rng, robot)[0] for _ in range(count)]


def soil_set_costs(robot: Robot, soils: Sequence[Soil], seed: int) -> dict[str, dict[str, Any]]:
    """What each law costs on the thesis's grid (chapter 3) and on wheel states of row turns: {states: {law: summary}}.

    Args:
        robot: for wheel, load and geometry.
        soils: each is fitted by itself.
        seed: of the wheel states of turns.
    """
    radius, load = robot.wheels[0].outer_radius, robot.mass * STANDARD_GRAVITY / 4
    costs: dict[str, dict[str, Any]] = {}
    for kind in STATE_SETS:
        rng = np.random.default_rng(seed)
        samples = [_samples(robot, soil, kind, rng) for soil in soils]
        costs[kind] = {
            name: summarise([fit_law(law, s, f, radius, resistance=rolls) for s, f in samples], load)
            for name, (law, rolls) in LAWS.items()
        }
    return costs


def _samples(robot: Robot, soil: Soil, kind: str, rng: np.random.Generator) -> tuple[Array, Array]:
    states = grid_states(robot) if kind == "grid" else turn_states(robot, rng)
    forces = true_forces(robot, soil, states)
    carried = np.isfinite(forces).all(axis=1)
    return states[carried], forces[carried]
