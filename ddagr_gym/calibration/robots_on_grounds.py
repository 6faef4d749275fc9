"""The robot on each ground: the joint values, drawn to what the drives on that ground tell (diagnosis, eq. (15c)).

Parameters x of the robot in drive i on ground g are random effects about the joint values m,

    x = m + u_g + e_i,    u_g ~ N(0, diag G),    e_i ~ N(0, diag E)                                             (1)

A simulator lacks what differs between grounds, so that part of it ends in the robot's parameters: two drives on one
ground mostly agree far better than drives on two. Each parameter's variances are those of the largest restricted
likelihood (D. A. Harville, J. Am. Stat. Assoc. 72 (1977) 320) at one share rho = E/(E + G) for all parameters, since
few drives say little of a single one; rho is its mean over the product of these likelihoods, before which it may be
anything from 0 to 1. A drive tells its own deviations from m by an information J and a gradient h, and its ground's by

    A_i = J (1 + E J)^-1,    b_i = (1 + J E)^-1 h                                                               (2)

With the sums A and b over the drives on a ground the mean of u_g is C b and its covariance C = G (1 + A G)^-1, and a
further drive on it deviates from m + C b with the variance diag(C) + E and that of m.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.calibration.drive_scatter import DriveEstimates, DriveInformation
from ddagr_gym.diagnosis.change.robot_on_ground import RobotOnGround

Array = NDArray[np.float64]

SHARES = np.linspace(0.02, 1.0, 50)
"""Values of rho at which likelihoods are taken."""

_RANGE = (1e-4, 1e4)
"""Of a variance over that of the estimates, in which the likelihood's maximum is sought (ours)."""

_FEWEST = 2
"""Drives that a parameter must show in for its variances to be estimated."""


@dataclass(frozen=True, eq=False)
class GroundModel:
    """Equation (1).

    Attributes:
        names: (P,) of the parameters.
        within: (P,) variances E between drives on one ground.
        between: (P,) variances G between grounds.
        joint: (P,) variances of the joint values m.
        share: rho [-].
    """

    names: tuple[str, ...]
    within: Array
    between: Array
    joint: Array
    share: float

    def on(self, drives: Sequence[DriveInformation], centre: Mapping[str, float] | None = None) -> RobotOnGround:
        """The robot in a further drive on the ground of some drives.

        Args:
            drives: on that ground; none where there was none.
            centre: values from which deviations are given, as changes from the joint values; these by default.
        """
        count = len(self.names)
        away = np.array([(centre or {}).get(name, 0.0) for name in self.names])
        information, gradient, one = np.zeros((count, count)), np.zeros(count), np.eye(count)
        for drive in drives:
            inner = drive.information
            information += inner @ np.linalg.inv(one + self.within[:, None] * inner)
            gradient += np.linalg.solve(one + inner * self.within, drive.gradient - inner @ away)
        covariance = self.between[:, None] * np.linalg.inv(one + information * self.between)
        variance = np.maximum(np.diag(covariance), 0.0) + self.within + self.joint
        return RobotOnGround(
            dict(zip(self.names, (covariance @ gradient).tolist(), strict=True)),
            dict(zip(self.names, np.sqrt(variance).tolist(), strict=True)),
        )


def ground_model(estimates: DriveEstimates, grounds: Sequence[str], deviations: Mapping[str, float]) -> GroundModel:
    """Variances of equation (1).

    Args:
        estimates: of each drive.
        grounds: (D,) of the drives.
        deviations: of the joint values of the robot's parameters.
    """
    names = estimates.of_robot
    of_ground = np.unique(np.array(grounds), return_inverse=True)[1]
    found = [_likelihoods(estimates.values[name], estimates.variances[name], of_ground) for name in names]
    whole = np.sum([likelihood for likelihood, _ in found], axis=0) if found else np.zeros(SHARES.size)
    weight = np.exp(whole - whole.max())
    share = float(SHARES @ weight / weight.sum())
    total = np.array([np.interp(share, SHARES, variance) for _, variance in found])
    joint = np.array([deviations[name] for name in names]) ** 2
    return GroundModel(names, share * total, (1.0 - share) * total, joint, share)


def _likelihoods(values: Array, variances: Array, of_ground: NDArray[np.int64]) -> tuple[Array, Array]:
    """Logarithm of the restricted likelihood at each of :data:`SHARES`, and the variance E + G at its maximum there."""
    from scipy.optimize import minimize_scalar

    known = np.isfinite(values)
    x, v, ground = values[known], variances[known], of_ground[known]
    if x.size < _FEWEST:
        return np.zeros(SHARES.size), np.zeros(SHARES.size)
    same = ground[:, None] == ground
    scale = float(np.var(x, ddof=1)) + float(v.mean())
    likelihoods, totals = np.empty(SHARES.size), np.empty(SHARES.size)
    for k, share in enumerate(SHARES.tolist()):
        shape = share * np.eye(x.size) + (1.0 - share) * same
        found = minimize_scalar(
            partial(_loss, x, np.diag(v), shape), bounds=np.log(scale * np.array(_RANGE)), method="bounded"
        )
        likelihoods[k], totals[k] = -float(found.fun), float(np.exp(found.x))
    return likelihoods, totals


def _loss(values: Array, own: Array, shape: Array, size: float) -> float:
    """Of the logarithm of a variance."""
    return -restricted_likelihood(values, own + np.exp(size) * shape)


def restricted_likelihood(values: Array, covariance: Array) -> float:
    """Logarithm of the likelihood of values (n,) of unknown mean with a covariance (n, n), up to a constant."""
    inverse = np.linalg.inv(covariance)
    weight = inverse.sum(axis=0)
    mean = float(weight @ values) / float(weight.sum())
    square = float((values - mean) @ inverse @ (values - mean))
    return -0.5 * (float(np.linalg.slogdet(covariance)[1]) + float(np.log(weight.sum())) + square)
