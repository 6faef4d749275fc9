"""What the filter's force laws cost against the terramechanic wheel.

Errors are relative to the largest force of the fitted set.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.estimation.force_laws import ForceLaw
from ddagr_gym.evaluation.force_law_fits import LawFit, fit_law, true_forces, turn_states
from ddagr_gym.parameters import STANDARD_GRAVITY, Robot, Soil
from ddagr_gym.physics.soil_draws import draw_soil, get_distribution
from ddagr_gym.presets import get_soil

Array = NDArray[np.float64]

LAWS: Mapping[str, tuple[ForceLaw, bool]] = {
    "thesis": (ForceLaw.thesis, False),
    "thesis_with_resistance": (ForceLaw.thesis, True),
    "coupled": (ForceLaw.coupled, True),
}
"""Laws by name: form, and whether motion resistance is fitted."""
STATE_SETS = ("grid", "turn")
RATIOS = ("traction_limit_over_load", "traction_rate", "coupling", "resistance_over_limit")
_SPEED = 0.2
"""Forward speed of the grid [m/s]; forces depend on ratios of speeds only."""


def grid_states(robot: Robot) -> Array:
    """The thesis's 2,500 points: slip -1..1, slip angle -60..60 degrees. Columns v_x, v_y, omega, yaw rate."""
    slips, angles = np.meshgrid(np.linspace(-0.98, 0.98, 50), np.linspace(-np.pi / 3, np.pi / 3, 50))
    slip, angle = np.ravel(slips), np.ravel(angles)
    rim = np.where(slip >= 0, _SPEED / (1 - np.maximum(slip, 0)), _SPEED * (1 + slip))
    zero = np.zeros(slip.size)
    return np.column_stack([zero + _SPEED, _SPEED * np.tan(angle), rim / robot.wheels[0].outer_radius, zero])


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
