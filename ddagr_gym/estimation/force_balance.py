"""Bank speeds at which a robot drives a steady arc, by the filter's force law."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.estimation.filter_model import FilterModel
from ddagr_gym.estimation.force_laws import ForceLaw, wheel_law
from ddagr_gym.jit import kernel

Array = NDArray[np.float64]

_ITERATIONS = 30  # of a damped Newton search (ours): each bank may move 0.33 of the speed a step, ten speeds in all
_LARGEST_RIM_RATIO = 5.0  # a rim speed beyond five times the body's means that the soil does not carry the arc


@kernel()
def _imbalance(
    law: float, unknown: Array, speed: float, rate: float, mass: float, half_wheelbase: float, half_track: float,
    parameters: Array, rest_speed: float, reversal_speed: float, result: Array,
) -> None:  # fmt: skip
    """Sums of F_x, F_y and M_z less what the steady arc needs, at rim speeds right, left and v_y."""
    result[0] = mass * rate * unknown[2]
    result[1] = -mass * rate * speed
    result[2] = 0.0
    for wheel in range(4):
        x = half_wheelbase if wheel < 2 else -half_wheelbase
        y = half_track if wheel % 2 else -half_track
        forces = wheel_law(
            law, speed - rate * y, unknown[2] + rate * x, unknown[wheel % 2], parameters[0], parameters[1],
            parameters[2], parameters[3], rest_speed, reversal_speed,
        )  # fmt: skip
        f_x, f_y = forces[0], forces[8]
        result[0] += f_x
        result[1] += f_y
        result[2] += x * f_y - y * f_x


@kernel()
def _solve(
    law: float, speed: float, rate: float, mass: float, half_wheelbase: float, half_track: float, parameters: Array,
    rest_speed: float, reversal_speed: float, unknown: Array,
) -> bool:  # fmt: skip
    base = np.zeros(3)
    moved = np.zeros(3)
    jacobian = np.zeros((3, 3))
    limit = _LARGEST_RIM_RATIO * abs(speed)
    for _ in range(_ITERATIONS):
        _imbalance(
            law, unknown, speed, rate, mass, half_wheelbase, half_track, parameters, rest_speed, reversal_speed, base
        )  # fmt: skip
        size = max(abs(base[0]), abs(base[1]), abs(base[2]))
        if size < 1e-6 * mass:
            return True
        for k in range(3):
            step = 1e-6 * max(abs(speed), 0.01)
            unknown[k] += step
            _imbalance(
                law, unknown, speed, rate, mass, half_wheelbase, half_track, parameters, rest_speed, reversal_speed,
                moved,
            )  # fmt: skip
            unknown[k] -= step
            for j in range(3):
                jacobian[j, k] = (moved[j] - base[j]) / step
        if abs(np.linalg.det(jacobian)) < 1e-12:
            return False
        change = np.linalg.solve(jacobian, base)
        # a bank may not change by more than a third of the speed at once: the law saturates
        largest = max(abs(change[0]), abs(change[1]), abs(change[2]))
        damping = min(1.0, 0.33 * abs(speed) / max(largest, 1e-12))
        for k in range(3):
            unknown[k] = min(max(unknown[k] - damping * change[k], -limit), limit)
    return False


def arc_bank_speeds(
    model: FilterModel, parameters: ArrayLike, speed: float, curvature: float
) -> tuple[float, float] | None:
    """Right and left bank speeds [rad/s] that hold a steady arc by the law, or None where it has no such solution.

    Args:
        model: robot and law of the filter.
        parameters: (4,) a1 [N], a2 [-], b [N/rad], Rc [N].
        speed: v_x [m/s].
        curvature: yaw rate over speed [1/m], counter-clockwise positive.
    """
    robot = model.robot
    spread = 1.3 * robot.half_track * curvature  # effective over geometric track of most soils
    unknown = np.array([speed * (1.0 + spread), speed * (1.0 - spread), 0.0])
    law = 1.0 if model.law is ForceLaw.coupled else 0.0
    found = _solve(
        law, speed, speed * curvature, robot.mass, robot.half_wheelbase, robot.half_track,
        np.asarray(parameters, dtype=np.float64), model.rest_speed, model.reversal_speed, unknown,
    )  # fmt: skip
    if not found:
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
        found = _solve(
            law, speeds[n], speeds[n] * curvatures[n], robot[0], robot[1], robot[2], parameters[n], rest_speed,
            reversal_speed, unknown,
        )  # fmt: skip
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
        1.0 if model.law is ForceLaw.coupled else 0.0,
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
