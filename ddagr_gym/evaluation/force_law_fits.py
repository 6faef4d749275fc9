"""The parameters of the filter's force laws that fit true wheel forces best.

Errors are relative to the largest force of the fitted set.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ddagr_gym.errors import InputError
from ddagr_gym.estimation.force_laws import ForceLaw, LawParameters, wheel_law
from ddagr_gym.jit import kernel
from ddagr_gym.parameters import STANDARD_GRAVITY, Robot, Soil
from ddagr_gym.physics import equilibrium_sinkage, wheel_force

Array = NDArray[np.float64]
Columns = Mapping[str, Array]

REST_SPEED, REVERSAL_SPEED = 1e-3, 1e-2
"""Smoothing of the laws in a fit [m/s]."""
LAUNCH = 1.6
"""Time after the start from which a drive is fitted and judged [s]: the launch is over."""
_EVERY = 20
"""Samples between fitted ones: 0.16 s, about the time in which wheel forces change."""
_NONE = np.log(1e-9)
"""Log of a motion resistance that is left out [N]."""


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
    parameters = LawParameters(p[0], p[1], p[2], p[3], REST_SPEED, REVERSAL_SPEED)
    for n in range(states.shape[0]):
        values = wheel_law(law, states[n, 0], states[n, 1], radius * states[n, 2], parameters)
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


def wheel_states(robot: Robot, columns: Columns, rows: NDArray[np.int64]) -> tuple[Array, Array]:
    """True wheel states (4 N, 4) v_x, v_y, bank speed, yaw rate and forces (4 N, 2) of chosen samples."""
    states, forces = [], []
    turning = columns["true_yaw_rate"][rows]
    for wheel in range(4):
        bank = "right" if wheel % 2 == 0 else "left"
        v_x = columns["true_v_x"][rows] - robot.wheel_y[wheel] * turning
        v_y = columns["true_v_y"][rows] + robot.wheel_x[wheel] * turning
        states.append(np.column_stack([v_x, v_y, columns[f"true_omega_{bank}"][rows], turning]))
        forces.append(np.column_stack([columns[f"true_force_{axis}_{wheel + 1}"][rows] for axis in "xy"]))
    return np.concatenate(states), np.concatenate(forces)


def drive_law_fit(robot: Robot, columns: Columns, law: ForceLaw, resistance: bool = True) -> LawFit:
    """The force law's parameters that fit a drive's true wheel forces best, from samples 0.16 s apart."""
    period = float(columns["t"][1] - columns["t"][0])
    rows = np.arange(round(LAUNCH / period), len(columns["t"]), _EVERY)
    return fit_law(law, *wheel_states(robot, columns, rows), robot.wheels[0].outer_radius, resistance=resistance)


def fit_to_soil(law: ForceLaw, robot: Robot, soil: Soil) -> LawFit:
    """A law's parameters by the forces of a soil under the wheels of a robot in turns.

    Raises:
        InputError: a soil into which the robot sinks.
    """
    states = turn_states(robot, np.random.default_rng(0))
    forces = true_forces(robot, soil, states)
    carried = np.isfinite(forces).all(axis=1)
    if not carried.any():
        raise InputError(
            f"the soil carries the {robot.name} in no turn, its wheels sink too deep: check its cohesion and moduli."
        )
    return fit_law(law, states[carried], forces[carried], robot.outer_radius)
