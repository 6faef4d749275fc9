"""Cost against accuracy: quadrature of the force, and the time step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.speeds.kernel_time import Kernel
from benchmarks.speeds.timing import Contestant, race
from benchmarks.speeds.workloads import EPISODES
from ddagr_gym.control.timing import CONTROL_INTERVAL
from ddagr_gym.parameters import Numerics
from ddagr_gym.physics import equilibrium_sinkage, layout, wheel_force
from ddagr_gym.presets import get_robot, get_soil, soil_names
from ddagr_gym.simulator import Simulator

SECTIONS = (8, 16)
CONTACTS = (2, 3, 4, 5, 6, 7, 8, 10, 12, 16)
# Time steps: what is changed against the default
STEPS = {
    "default": {},
    "no extrapolated forces": {"force_extrapolation": 0.0},
    "accepted_error 4e-3": {"accepted_error": 4e-3},
    "accepted_error 2.5e-4": {"accepted_error": 2.5e-4},
    "accepted_error 1e-4, 2 steps": {"accepted_error": 1e-4, "substeps": 2},
    "accepted_error 1e-4, 4 steps": {"accepted_error": 1e-4, "substeps": 4},
}  # fmt: skip
CONVERGED = Numerics(
    substeps=32, accepted_error=2e-4, jacobian_refresh=0.02, force_extrapolation=0.0, sinkage_tolerance=1e-7
)


def wheel_states(count: int, seed: int = 0) -> list[tuple[str, np.ndarray]]:
    """Random states (count, 5) of the DDAGR's wheels in turns, at the sinkage of their load, for every named soil.

    Speeds 0.05 to 0.5 m/s, slip -0.5 to 0.8, slip angles up to 45 degrees, yaw rates up to 0.6 rad/s; states in which
    the wheel is bogged are left out.
    """
    rng = np.random.default_rng(seed)
    robot = get_robot("ddagr")
    wheel, load = robot.wheels[0], 0.25 * robot.mass * 9.80665
    found = []
    for name in soil_names():
        v_x = rng.uniform(0.05, 0.5, count)
        v_y = v_x * np.tan(rng.uniform(-np.pi / 4, np.pi / 4, count))
        slip = rng.uniform(-0.5, 0.8, count)
        omega = np.where(slip > 0, v_x / (1 - slip), v_x * (1 + slip)) / wheel.outer_radius
        yaw_rate = rng.uniform(-0.6, 0.6, count)
        sinkage, status = equilibrium_sinkage(wheel, get_soil(name), v_x, v_y, omega, yaw_rate, load)
        found.append((name, np.column_stack([v_x, v_y, omega, yaw_rate, sinkage])[status == 0]))
    return found


def force_errors(numerics: Numerics, states: list[tuple[str, np.ndarray]]) -> np.ndarray:
    """|F - F_finest| over |F_finest|, of all states."""
    wheel = get_robot("ddagr").wheels[0]
    errors = []
    for name, values in states:
        exact = wheel_force(wheel, get_soil(name), *values.T, numerics=Numerics.finest()).force
        force = wheel_force(wheel, get_soil(name), *values.T, numerics=numerics).force
        errors.append(np.linalg.norm(force - exact, axis=-1) / np.linalg.norm(exact, axis=-1))
    return np.concatenate(errors)


def quadrature(states_per_soil: int, repeats: int, evaluations: int) -> list[dict[str, object]]:
    """Errors and nanoseconds per evaluation over quadrature sizes; the default is marked."""
    states = wheel_states(states_per_soil)
    rules = [(section, contact) for section in SECTIONS for contact in CONTACTS]
    kernels = {rule: Kernel(replace(Numerics(), section_nodes=rule[0]), rule[1]) for rule in rules}
    contestants = [kernels[rule].contestant(str(rule), max(1, evaluations // 256)) for rule in rules]
    rates = race(contestants, repeats)
    rows = []
    for rule in rules:
        errors = force_errors(replace(Numerics(), section_nodes=rule[0], contact_nodes=rule[1]), states)
        rows.append(
            {
                "section_nodes": rule[0],
                "contact_nodes": rule[1],
                "nodes": 2 * rule[0] * rule[1],
                "nanoseconds": round(1e9 / rates[str(rule)].median, 1),
                "median_error": float(f"{np.median(errors):.3g}"),
                "error_of_9_in_10": float(f"{np.percentile(errors, 90):.3g}"),
                "largest_error": float(f"{errors.max():.3g}"),
                "states": int(errors.size),
                "default": rule == (Numerics().section_nodes, Numerics().contact_nodes),
            }
        )
    return rows


def bank_commands(actions: np.ndarray, samples: int) -> np.ndarray:
    """Bank speed commands (episodes, samples, 2) [rad/s] of actions that are each held for a control interval."""
    held = np.repeat(actions, CONTROL_INTERVAL, axis=1)[:, :samples]
    return get_robot("ddagr").maximum_wheel_speed * held.astype(np.float64)


class Drive:
    """The DDAGR in Table A.1 soil under given commands, one robot an episode.

    Args:
        numerics: accuracy.
        commands: (episodes, samples, 2).
    """

    def __init__(self, numerics: Numerics, commands: np.ndarray) -> None:
        self.commands = commands
        self.simulator = Simulator(len(commands), numerics=numerics)
        for n in range(len(commands)):
            self.simulator.configure(n, get_robot("ddagr"), get_soil("thesis_a1"))

    def velocities(self) -> np.ndarray:
        """(episodes, samples, 3): v_x, v_y [m/s], yaw rate [rad/s]."""
        self.simulator.reset()
        entries = [layout.V_X, layout.V_Y, layout.YAW_RATE]
        return self.simulator.step(self.commands, recorded=entries)[1]

    def contestant(self, name: str) -> Contestant:
        """The amount is samples."""

        def run() -> float:
            self.simulator.reset()
            self.simulator.step(self.commands)
            return float(self.commands.shape[0] * self.commands.shape[1])

        return Contestant(name, run)


def time_steps(tables: dict[str, np.ndarray], samples: int, repeats: int) -> dict[str, list[dict[str, object]]]:
    """Velocity errors (r.m.s., against converged steps) and microseconds per 8 ms sample, by workload and option."""
    found: dict[str, list[dict[str, object]]] = {}
    for workload, actions in tables.items():
        commands = bank_commands(actions[: min(4, EPISODES)], samples)
        exact = Drive(CONVERGED, commands).velocities()
        drives = {name: Drive(replace(Numerics(), **changes), commands) for name, changes in STEPS.items()}
        rates = race([drive.contestant(name) for name, drive in drives.items()], repeats)
        found[workload] = []
        for name, drive in drives.items():
            error = np.sqrt(np.mean((drive.velocities() - exact) ** 2, axis=(0, 1)))
            found[workload].append(
                {
                    "numerics": name,
                    "microseconds": round(1e6 / rates[name].median, 2),
                    **{k: float(f"{e:.2g}") for k, e in zip(("v_x", "v_y", "yaw_rate"), error, strict=True)},
                }
            )
    return found
