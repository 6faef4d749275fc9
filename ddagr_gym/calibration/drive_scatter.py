"""How much parameters differ between drives: an estimate from each drive, and random effects over them.

Each drive gets its own values of all calibrated parameters about the joint ones; windows of other drives do not see
them, so that one simulation serves all drives. A drive's estimate is freed of its prior afterwards:

    1/v = 1/v' - 1/s^2,    d = d' v/v'                                                                          (1)

with the deviation d' from the joint value and its variance v' under the prior N(0, s^2). The variance tau^2 between
drives solves sum_i (x_i - m)^2/(v_i + tau^2) = k - 1 (R. C. Paule and J. Mandel, J. Res. NBS 87 (1982) 377), and the
variance of the mean is that of G. Knapp and J. Hartung (Stat. Med. 22 (2003) 2693), with Student's t of k - 1 degrees.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.calibration.calibration_data import CalibrationData
from ddagr_gym.calibration.joint_fit import FittedModel, fit_model
from ddagr_gym.calibration.parts import RobotModel
from ddagr_gym.calibration.result import Scatter
from ddagr_gym.identification.gauss_newton import linearised
from ddagr_gym.identification.parameters import OF_SENSORS, ModelParameter, per_group, robot_parameters
from ddagr_gym.identification.residual_weights import Weights

Array = NDArray[np.float64]

SAYS_NOTHING = 0.95
"""Variance after over before from which on a drive says nothing about a parameter (ours)."""

ITERATIONS = 4
"""Steps of the fit by drive (ours): it starts at the joint values."""

COVERAGE = 0.90
"""Of intervals."""

_NARROWEST = 1e-12
"""Variance below which an estimate would get infinite weight."""


@dataclass(frozen=True, eq=False)
class DriveInformation:
    """What one drive alone says of all parameters of the robot together, with those of its ground free.

    Attributes:
        information: (P, P) about their deviations from the joint values.
        gradient: (P,) of the logarithm of the likelihood at these values.
    """

    information: Array
    gradient: Array


@dataclass(frozen=True, eq=False)
class DriveEstimates:
    """Estimates of each calibrated parameter from each drive.

    Attributes:
        values: by parameter, (D,); NaN where the drive is on another ground or says nothing.
        variances: by parameter, (D,).
        of_robot: (P,) names of the robot's parameters.
        drives: (D,) what each says of these.
    """

    values: dict[str, Array]
    variances: dict[str, Array]
    of_robot: tuple[str, ...]
    drives: tuple[DriveInformation, ...]


def drive_estimates(data: CalibrationData, model: FittedModel, weights: Weights, threads: int) -> DriveEstimates:
    """Estimates by drive about a joint fit.

    Args:
        data: drives.
        model: joint fit.
        weights: of its windows.
        threads: of the simulator.
    """
    moved = [p for p in model.parameters if p.prior > 0.0 and not p.name.startswith(OF_SENSORS)]
    own = [made for p in moved for made in _by_drive(p, model.values[p.name], data.count)]
    joint = tuple(replace(p, prior=0.0) if p in moved else p for p in model.parameters)
    by_drive = RobotModel(model.model.robot, (*joint, *own))
    windows, states = model.problem.blocked.windows, model.fitted.point.states
    found = fit_model(data, windows, by_drive, weights, model.values, threads, states=states, iterations=ITERATIONS)
    covariance = np.asarray(np.linalg.inv(linearised(found.problem, found.fitted).information), dtype=np.float64)
    variance = dict(zip(found.free, np.diag(covariance), strict=True))
    values: dict[str, Array] = {}
    variances: dict[str, Array] = {}
    for p in moved:
        pairs = [_freed(found.values.get(_own(p.name, d)), variance.get(_own(p.name, d)), p) for d in range(data.count)]
        values[p.name] = model.values[p.name] + np.array([deviation for deviation, _ in pairs])
        variances[p.name] = np.array([v for _, v in pairs])
    names = {p.name for p in robot_parameters(model.model.robot)}
    of_robot = [p for p in moved if p.name in names]
    places = {name: k for k, name in enumerate(found.free)}
    drives = tuple(_information(of_robot, drive, found.values, covariance, places) for drive in range(data.count))
    return DriveEstimates(values, variances, tuple(p.name for p in of_robot), drives)


def _own(name: str, drive: int) -> str:
    return f"{name}_of_{drive + 1}"


def _by_drive(parameter: ModelParameter, joint: float, drives: int) -> tuple[ModelParameter, ...]:
    """The parameter's deviation from its joint value, in each drive in which it acts."""
    acts = range(drives) if parameter.scope is None else sorted(parameter.scope)
    own = replace(
        parameter, name=f"{parameter.name}_of", scope=None, low=parameter.low - joint, high=parameter.high - joint
    )
    return per_group(own, {str(drive + 1): (drive,) for drive in acts})


def _freed(deviation: float | None, variance: float | None, parameter: ModelParameter) -> tuple[float, float]:
    """Deviation from the joint value and its variance by the drive alone, equation (1); NaN where it says nothing."""
    prior = parameter.prior**2
    if deviation is None or variance is None or variance >= SAYS_NOTHING * prior:
        return np.nan, np.nan
    alone = 1.0 / (1.0 / max(variance, _NARROWEST) - 1.0 / prior)
    return deviation * alone / variance, alone


def _information(
    parameters: Sequence[ModelParameter],
    drive: int,
    values: Mapping[str, float],
    covariance: Array,
    places: Mapping[str, int],
) -> DriveInformation:
    """What a drive alone says: its estimate with its covariance, freed of the priors as in equation (1)."""
    own = [_own(p.name, drive) for p in parameters]
    known = [k for k, name in enumerate(own) if name in places]
    rows = [places[own[k]] for k in known]
    inverse = np.linalg.inv(covariance[np.ix_(rows, rows)])
    size, vectors = np.linalg.eigh(inverse - np.diag([parameters[k].prior ** -2.0 for k in known]))
    information, gradient = np.zeros((len(own), len(own))), np.zeros(len(own))
    # rounding may leave less than nothing
    information[np.ix_(known, known)] = (vectors * np.maximum(size, 0.0)) @ vectors.T
    gradient[known] = inverse @ np.array([values[own[k]] for k in known])
    return DriveInformation(information, gradient)


def between_variance(values: Array, variances: Array) -> float:
    """Variance between drives by Paule and Mandel; 0 where the estimates scatter no more than they may."""
    from scipy.optimize import brentq

    if values.size < 2:
        return 0.0

    def excess(tau: float) -> float:
        weight = 1.0 / (variances + tau)
        mean = float(weight @ values) / float(weight.sum())
        return float(weight @ (values - mean) ** 2) - (values.size - 1)

    if excess(0.0) <= 0.0:
        return 0.0
    high = float(np.sum((values - values.mean()) ** 2))
    return float(brentq(excess, 0.0, high))


def scatter(values: Array, variances: Array, grounds: Sequence[str]) -> Scatter:
    """Scatter of estimates (D,) between drives on the same and on any ground."""
    known = np.isfinite(values)
    by_ground = [np.flatnonzero(known & (np.array(grounds) == ground)) for ground in dict.fromkeys(grounds)]
    several = [rows for rows in by_ground if rows.size > 1]
    degrees = sum(rows.size - 1 for rows in several)
    same = sum((rows.size - 1) * between_variance(values[rows], variances[rows]) for rows in several)
    count = int(known.sum())
    return Scatter(
        count,
        float(np.sqrt(same / degrees)) if degrees else None,
        float(np.sqrt(between_variance(values[known], variances[known]))) if count > 1 else None,
        degrees,
        max(count - 1, 0),
    )


def half_width(values: Array, variances: Array, within: float) -> float:
    """Half the interval of a parameter of several drives: never narrower than one drive after the other allows.

    Args:
        values: (D,) estimates by drive, NaN where a drive says nothing.
        variances: (D,) of them.
        within: deviation of the joint estimate inside the drives.
    """
    from scipy.special import ndtri, stdtrit

    normal = float(ndtri(0.5 + 0.5 * COVERAGE)) * within
    known = np.isfinite(values)
    if known.sum() < 2:
        return normal
    x, v = values[known], variances[known]
    weight = 1.0 / (v + between_variance(x, v))
    mean = float(weight @ x) / float(weight.sum())
    spread = float(weight @ (x - mean) ** 2) / ((x.size - 1) * float(weight.sum()))
    return max(normal, float(stdtrit(x.size - 1, 0.5 + 0.5 * COVERAGE)) * float(np.sqrt(spread)))
