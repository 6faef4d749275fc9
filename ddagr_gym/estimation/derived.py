"""Speeds, soil parameters, slip and turn radius from a filter's state, with their standard deviations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.estimation.filter_model import FilterModel
from ddagr_gym.estimation.layout import OMEGA, PARAMETER, STATE_SIZE

Array = NDArray[np.float64]

_PARAMETERS = slice(PARAMETER, PARAMETER + 4)


class Estimates(NamedTuple):
    """Estimates and standard deviations; every array has the leading shape (...) of the states.

    Attributes:
        velocity: (..., 3) v_x, v_y [m/s], yaw rate [rad/s].
        velocity_deviation: (..., 3).
        bank_speeds: (..., 2) right, left [rad/s].
        parameters: (..., 4) a1 [N], a2 [-], b [N/rad], Rc [N].
        log_deviations: (..., 4) of their natural logs; a small one is also the relative deviation.
        learned: (..., 4) 1 - (deviation/prior deviation)^2: 0 nothing observed, 1 known exactly, below 0 forgotten.
        slip_ratios: (..., 2) right, left.
        slip_ratio_deviations: (..., 2).
        radius: (...,) v_x over yaw rate [m], left turns positive; infinite without yaw rate.
        curvature: (...,) yaw rate over v_x [1/m].
        radius_deviation: (...,) [m].
    """

    velocity: Array
    velocity_deviation: Array
    bank_speeds: Array
    parameters: Array
    log_deviations: Array
    learned: Array
    slip_ratios: Array
    slip_ratio_deviations: Array
    radius: Array
    curvature: Array
    radius_deviation: Array


def estimates(model: FilterModel, states: ArrayLike, covariances: ArrayLike) -> Estimates:
    """Speeds, soil parameters, slip and turn radius; deviations of derived values are to first order.

    Args:
        model: filter model.
        states: (..., 12).
        covariances: (..., 12, 12).

    Raises:
        InputError: shapes that do not fit.
    """
    x, p = np.asarray(states, dtype=np.float64), np.asarray(covariances, dtype=np.float64)
    if x.shape[-1:] != (STATE_SIZE,) or p.shape != (*x.shape, STATE_SIZE):
        raise InputError(f"states {x.shape} and covariances {p.shape}: give (..., 12) and (..., 12, 12).")
    variances = np.diagonal(p, axis1=-2, axis2=-1)
    slip, slip_deviation = _slip_ratios(model, x, p)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        radius = np.where(x[..., 2] == 0.0, np.inf, x[..., 0] / x[..., 2])
        curvature = np.where(x[..., 0] == 0.0, np.inf, x[..., 2] / x[..., 0])
        spread = p[..., 0, 0] - 2.0 * radius * p[..., 0, 2] + radius**2 * p[..., 2, 2]
        radius_deviation = np.sqrt(np.maximum(spread, 0.0)) / np.abs(x[..., 2])
    prior = np.diagonal(model.soil_prior.logs(model.wheel_load)[1])
    return Estimates(
        velocity=x[..., :3],
        velocity_deviation=np.sqrt(variances[..., :3]),
        bank_speeds=x[..., OMEGA : OMEGA + 2],
        parameters=np.exp(x[..., _PARAMETERS]),
        log_deviations=np.sqrt(variances[..., _PARAMETERS]),
        learned=1.0 - variances[..., _PARAMETERS] / prior,
        slip_ratios=slip,
        slip_ratio_deviations=slip_deviation,
        radius=radius,
        curvature=curvature,
        radius_deviation=np.where(np.isfinite(radius), radius_deviation, np.inf),
    )


def slip_ratio(rim: ArrayLike, speed: ArrayLike) -> Array:
    """Slip ratio (theory: wheel model, eq. (8)): rim = R0 omega and wheel speed v_x [m/s], 0 where both are 0."""
    rim, speed = np.asarray(rim, dtype=np.float64), np.asarray(speed, dtype=np.float64)
    larger = np.where(np.abs(rim) >= np.abs(speed), rim, speed)
    divisor = np.where(larger == 0.0, 1.0, np.abs(larger))
    return np.asarray(np.sign(larger) * (rim - speed) / divisor)


def _slip_ratios(model: FilterModel, x: Array, p: Array) -> tuple[Array, Array]:
    width, radius = model.robot.half_track, model.outer_radius
    ratios, deviations = [], []
    for bank, side in ((0, 1.0), (1, -1.0)):
        rim = radius * x[..., OMEGA + bank]
        speed = x[..., 0] + side * width * x[..., 2]
        ratios.append(slip_ratio(rim, speed))
        faster = np.abs(rim) >= np.abs(speed)
        larger = np.where(faster, rim, speed)
        larger = np.copysign(np.maximum(np.abs(larger), model.rest_speed), larger)
        # 1 - v/rim of a driven wheel, rim/v - 1 of a braked one
        by_rim = np.where(faster, speed / larger**2, 1.0 / larger)
        by_speed = np.where(faster, -1.0 / larger, -rim / larger**2)
        row = np.zeros(x.shape)
        row[..., OMEGA + bank] = by_rim * radius
        row[..., 0] = by_speed
        row[..., 2] = by_speed * side * width
        variance = np.einsum("...i,...ij,...j->...", row, p, row)
        deviations.append(np.sqrt(np.maximum(variance, 0.0)))
    return np.stack(ratios, axis=-1), np.stack(deviations, axis=-1)
