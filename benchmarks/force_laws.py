"""What the filter's force laws cost against the terramechanic wheel, and the prior of their parameters.

    python -m benchmarks.force_laws [--soils N] [--output FILE]

Each soil is fitted by each law twice: on the thesis's grid of slip and slip angle (chapter 3) and on wheel states of
row turns. Errors are relative to the largest force of the fitted set. The geometric means of the turn fits' medians
over thesis_a1_range and field are the medians of ddagr_gym.estimation.SoilPrior.
"""

from __future__ import annotations

import argparse
import json
import os
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from ddagr_gym.estimation.force_laws import ForceLaw, wheel_law
from ddagr_gym.jit import kernel
from ddagr_gym.parameters import STANDARD_GRAVITY, Robot, Soil
from ddagr_gym.physics import equilibrium_sinkage, wheel_force
from ddagr_gym.physics.soil_draws import draw_soil, get_distribution
from ddagr_gym.presets import get_robot, get_soil

REST, REVERSAL = 1e-3, 1e-2
SETS = ("thesis_a1_range", "field", "weaker", "stiffer")
LAWS = {
    "thesis": (ForceLaw.thesis, False),
    "thesis_with_resistance": (ForceLaw.thesis, True),
    "coupled": (ForceLaw.coupled, True),
}
SPEED = 0.2  # [m/s]; forces depend on ratios of speeds only


def grid_states(robot: Robot) -> np.ndarray:
    """The thesis's 2,500 points: slip -1..1, slip angle -60..60 degrees. Columns v_x, v_y, omega, yaw rate."""
    slip, angle = np.meshgrid(np.linspace(-0.98, 0.98, 50), np.linspace(-np.pi / 3, np.pi / 3, 50))
    slip, angle = slip.ravel(), angle.ravel()
    rim = np.where(slip >= 0, SPEED / (1 - np.maximum(slip, 0)), SPEED * (1 + slip))
    zero = np.zeros(slip.size)
    return np.column_stack([zero + SPEED, SPEED * np.tan(angle), rim / robot.wheels[0].outer_radius, zero])


def turn_states(robot: Robot, rng: np.random.Generator, count: int = 400) -> np.ndarray:
    """Wheel states of turns of 0.6-1.4 m at 0.10-0.25 m/s, one in five straight; inner banks drag, outer ones drive."""
    speed = rng.uniform(0.10, 0.25, count)
    yaw_rate = speed / rng.uniform(0.6, 1.4, count) * rng.choice([-1, 1], count) * (rng.random(count) > 0.2)
    v_x = speed + rng.choice([-1, 1], count) * robot.half_track * yaw_rate
    v_y = 0.01 * rng.standard_normal(count) + rng.choice([-1, 1], count) * robot.half_wheelbase * yaw_rate
    slip = np.where(v_x < 0.1, -rng.uniform(0, 1, count), rng.uniform(-0.1, 0.35, count))
    rim = np.where(slip >= 0, v_x / (1 - slip), v_x * (1 + slip))
    rim = np.where(v_x > 0, rim, rng.uniform(-0.03, 0.03, count))
    return np.column_stack([v_x, v_y, rim / robot.wheels[0].outer_radius, yaw_rate])


def true_forces(robot: Robot, soil: Soil, states: np.ndarray) -> np.ndarray:
    """F_x, F_y (N, 2) at the static load; bogged wheels as NaN."""
    wheel, load = robot.wheels[0], robot.mass * STANDARD_GRAVITY / 4
    sinkage, status = equilibrium_sinkage(wheel, soil, *states.T, load)
    force = wheel_force(wheel, soil, *states.T, sinkage).force[:, :2]
    force[np.asarray(status) != 0] = np.nan
    return force


@kernel()
def law_forces(law, p, states, radius, forces):
    """Forces (N, 2) of a law with parameters p = a1, a2, b, Rc; written to ``forces``."""
    for n in range(states.shape[0]):
        values = wheel_law(
            law, states[n, 0], states[n, 1], radius * states[n, 2], p[0], p[1], p[2], p[3], REST, REVERSAL
        )
        forces[n, 0], forces[n, 1] = values[0], values[8]


def fit(
    law: ForceLaw, with_resistance: bool, states: np.ndarray, forces: np.ndarray, radius: float
) -> tuple[np.ndarray, np.ndarray]:
    """Logs of a1, a2, b, Rc of the least squared force error, and the errors (N, 2)."""
    start = np.log([np.nanmax(np.abs(forces[:, 0])), 5.0, 2 * np.nanmax(np.abs(forces[:, 1])), 20.0])
    free = 4 if with_resistance else 3
    none, modelled = np.log(1e-9), np.empty(forces.shape)

    def logs(p):
        return np.append(p, none) if free == 3 else p

    def residual(p):
        law_forces(float(law), np.exp(logs(p)), states, radius, modelled)
        return (modelled - forces).ravel()

    best = least_squares(residual, start[:free], bounds=(-25.0, 25.0))
    return logs(best.x), best.fun.reshape(-1, 2)


def summarise(fits: list[tuple[np.ndarray, np.ndarray, np.ndarray]], load: float) -> dict:
    """Relative errors over soils, and the prior's ratios."""
    peak = np.array([[np.abs(f[:, a]).max() for a in range(2)] for _, _, f in fits])
    worst = np.array([[np.abs(e[:, a]).max() for a in range(2)] for _, e, _ in fits]) / peak
    rms = np.array([np.sqrt((e**2).mean(axis=0)) for _, e, _ in fits]) / peak
    logs = np.array([p for p, _, _ in fits])
    ratios = np.column_stack(
        [logs[:, 0] - np.log(load), logs[:, 1], logs[:, 2] - logs[:, 0] - logs[:, 1], logs[:, 3] - logs[:, 0]]
    )
    names = ("traction_limit_over_load", "traction_rate", "coupling", "resistance_over_limit")
    return {
        "peak_error_x": float(np.median(worst[:, 0])),
        "peak_error_y": float(np.median(worst[:, 1])),
        "rms_error_x": float(np.median(rms[:, 0])),
        "rms_error_y": float(np.median(rms[:, 1])),
        "prior": {
            name: {"median": float(np.exp(np.median(r))), "log_deviation": float(r.std()) if len(r) > 1 else 0.0}
            for name, r in zip(names, ratios.T, strict=True)
        },
    }  # fmt: skip


def study(soils: int, seed: int = 0) -> dict:
    robot = get_robot("ddagr")
    radius, load = robot.wheels[0].outer_radius, robot.mass * STANDARD_GRAVITY / 4
    result: dict = {}
    sets = {"thesis_a1": [get_soil("thesis_a1")]}
    for name in SETS:
        rng = np.random.default_rng(seed)
        sets[name] = [draw_soil(get_distribution(name), rng, robot)[0] for _ in range(soils)]
    for name, chosen in sets.items():
        for states_name in ("grid", "turn"):
            rng = np.random.default_rng(seed)
            samples = []
            for soil in chosen:
                states = grid_states(robot) if states_name == "grid" else turn_states(robot, rng)
                forces = true_forces(robot, soil, states)
                carried = np.isfinite(forces).all(axis=1)
                samples.append((states[carried], forces[carried]))
            for law_name, (law, with_resistance) in LAWS.items():
                fits = [(*fit(law, with_resistance, s, f, radius), f) for s, f in samples]
                summary = summarise(fits, load)
                result.setdefault(name, {}).setdefault(states_name, {})[law_name] = summary
                print(f"{name:16} {states_name:5} {law_name:24} peak {100 * summary['peak_error_x']:.0f} % "
                      f"{100 * summary['peak_error_y']:.0f} %  rms {100 * summary['rms_error_x']:.1f} % "
                      f"{100 * summary['rms_error_y']:.1f} %", flush=True)  # fmt: skip
    return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--soils", type=int, default=40, help="soils per set")
    parser.add_argument("--output", type=Path, default=Path(__file__).parent / "results" / "force_laws.json")
    arguments = parser.parse_args()
    text = json.dumps(study(arguments.soils), indent=1)
    temporary = arguments.output.with_suffix(".part")
    temporary.write_text(text + "\n", encoding="utf-8")
    os.replace(temporary, arguments.output)


if __name__ == "__main__":
    main()
