"""Bank speeds at which a robot drives a steady arc, by the filter's force law."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.estimation.filter_model import FilterModel
from ddagr_gym.estimation.force_laws import LawParameters, wheel_law
from ddagr_gym.jit import kernel

Array = NDArray[np.float64]

_ITERATIONS = 30  # of a damped Newton search (ours): each bank may move 0.33 of the speed a step, ten speeds in all
_LARGEST_RIM_RATIO = 5.0  # a rim speed beyond five times the body's means that the soil does not carry the arc


class _Arc(NamedTuple):
    """A steady arc of a robot on a soil.

    Attributes:
        speed: v_x [m/s].
        rate: yaw rate [rad/s].
        mass: [kg].
        half_wheelbase: [m].
        half_track: [m].
        law: number of the :class:`~ddagr_gym.estimation.force_laws.ForceLaw`.
        soil: parameters of the law.
        pull_x: gravity along body x [m/s^2].
        pull_y: gravity along body y [m/s^2].
        turning: of what else turns the robot, M [N m].
    """

    speed: float
    rate: float
    mass: float
    half_wheelbase: float
    half_track: float
    law: float
    soil: LawParameters
    pull_x: float
    pull_y: float
    turning: float


@kernel()
def _imbalance(arc: _Arc, unknown: Array, result: Array) -> None:
    """Sums of F_x, F_y and M_z less what the steady arc needs, at rim speeds and v_y (theory: control, eq. (4))."""
    result[0] = arc.mass * arc.rate * unknown[2] + arc.mass * arc.pull_x
    result[1] = -arc.mass * arc.rate * arc.speed + arc.mass * arc.pull_y
    result[2] = arc.turning
    for wheel in range(4):
        x = arc.half_wheelbase if wheel < 2 else -arc.half_wheelbase
        y = arc.half_track if wheel % 2 else -arc.half_track
        v_x, v_y = arc.speed - arc.rate * y, unknown[2] + arc.rate * x
        forces = wheel_law(arc.law, v_x, v_y, unknown[wheel % 2], arc.soil)
        f_x, f_y = forces[0], forces[8]
        result[0] += f_x
        result[1] += f_y
        result[2] += x * f_y - y * f_x


@kernel()
def _solve(arc: _Arc, unknown: Array) -> bool:
    """Newton's method for the rim speeds and v_y of the arc, from those in ``unknown`` (3,); whether it converged."""
    base = np.zeros(3)
    moved = np.zeros(3)
    jacobian = np.zeros((3, 3))
    limit = _LARGEST_RIM_RATIO * abs(arc.speed)
    for _ in range(_ITERATIONS):
        _imbalance(arc, unknown, base)
        size = max(abs(base[0]), abs(base[1]), abs(base[2]))
        if size < 1e-6 * arc.mass:
            return True
        for k in range(3):
            step = 1e-6 * max(abs(arc.speed), 0.01)
            unknown[k] += step
            _imbalance(arc, unknown, moved)
            unknown[k] -= step
            for j in range(3):
                jacobian[j, k] = (moved[j] - base[j]) / step
        if abs(np.linalg.det(jacobian)) < 1e-12:
            return False
        change = np.linalg.solve(jacobian, base)
        # a bank may not change by more than a third of the speed at once: the law saturates
        largest = max(abs(change[0]), abs(change[1]), abs(change[2]))
        damping = min(1.0, 0.33 * abs(arc.speed) / max(largest, 1e-12))
        for k in range(3):
            unknown[k] = min(max(unknown[k] - damping * change[k], -limit), limit)
    return False


def arc_bank_speeds(
    model: FilterModel,
    parameters: ArrayLike,
    speed: float,
    curvature: float,
    gravity: tuple[float, float] = (0.0, 0.0),
    turning: float = 0.0,
) -> tuple[float, float] | None:
    """Right and left bank speeds [rad/s] that hold a steady arc by the law, or None where it has no such solution.

    Args:
        model: robot and law of the filter.
        parameters: (4,) a1 [N], a2 [-], b [N/rad], Rc [N].
        speed: v_x [m/s].
        curvature: yaw rate over speed [1/m], counter-clockwise positive.
        gravity: its pull along body x and y [m/s^2], 0 on the level; and what else pulls.
        turning: moment of what else pulls, about the body origin, over the yaw inertia [rad/s^2].
    """
    robot = model.robot
    spread = 1.3 * robot.half_track * curvature  # effective over geometric track of most soils
    unknown = np.array([speed * (1.0 + spread), speed * (1.0 - spread), 0.0])
    limit, rate, stiffness, resistance = np.asarray(parameters, dtype=np.float64)
    soil = LawParameters(limit, rate, stiffness, resistance, model.rest_speed, model.reversal_speed)
    law, length, width = float(model.law), robot.half_wheelbase, robot.half_track
    pull_x, pull_y, moment = float(gravity[0]), float(gravity[1]), robot.yaw_inertia * float(turning)
    arc = _Arc(speed, speed * curvature, robot.mass, length, width, law, soil, pull_x, pull_y, moment)
    if not _solve(arc, unknown):
        return None
    radius = model.outer_radius
    return float(unknown[0] / radius), float(unknown[1] / radius)


@kernel()
def arc_speed_rows(
    law: float, speeds: Array, curvatures: Array, parameters: Array, robot: Array, rest_speed: float,
    reversal_speed: float, fallback: float, banks: Array,
) -> None:  # fmt: skip
    """Rim speeds (N, 2) right, left [m/s] of steady arcs; ``robot`` is mass, half wheelbase, half track.

    Where the law has no solution the rim speeds are kinematic, with ``fallback`` as effective over geometric track.
    """
    unknown = np.zeros(3)
    for n in range(speeds.shape[0]):
        spread = robot[2] * curvatures[n]
        unknown[0] = speeds[n] * (1.0 + 1.3 * spread)
        unknown[1] = speeds[n] * (1.0 - 1.3 * spread)
        unknown[2] = 0.0
        own = parameters[n]
        soil = LawParameters(own[0], own[1], own[2], own[3], rest_speed, reversal_speed)
        arc = _Arc(speeds[n], speeds[n] * curvatures[n], robot[0], robot[1], robot[2], law, soil, 0.0, 0.0, 0.0)
        found = _solve(arc, unknown)
        banks[n, 0] = unknown[0] if found else speeds[n] * (1.0 + fallback * spread)
        banks[n, 1] = unknown[1] if found else speeds[n] * (1.0 - fallback * spread)


def arc_bank_speed_rows(
    model: FilterModel, parameters: Array, speeds: Array, curvatures: Array, fallback: float = 1.3
) -> Array:
    """:func:`arc_bank_speeds` of N robots that share a model, kinematic where the law has no solution.

    Args:
        model: robot and law of the filter.
        parameters: (N, 4) a1 [N], a2 [-], b [N/rad], Rc [N].
        speeds: (N,) v_x [m/s].
        curvatures: (N,) [1/m].
        fallback: effective over geometric track of the kinematic bank speeds [-].

    Returns:
        (N, 2) right and left bank speeds [rad/s].
    """
    robot = model.robot
    banks = np.empty((len(speeds), 2))
    arc_speed_rows(
        float(model.law),
        np.ascontiguousarray(speeds, dtype=np.float64),
        np.ascontiguousarray(curvatures, dtype=np.float64),
        np.ascontiguousarray(parameters, dtype=np.float64),
        np.array([robot.mass, robot.half_wheelbase, robot.half_track]),
        model.rest_speed,
        model.reversal_speed,
        fallback,
        banks,
    )
    return banks / model.outer_radius
