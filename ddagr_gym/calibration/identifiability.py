"""Parameters that the drives do not identify, and how well they identify the others."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.calibration.joint_fit import FittedModel
from ddagr_gym.identification.gauss_newton import linearised
from ddagr_gym.identification.parameters import OF_SENSORS

Array = NDArray[np.float64]

AS_WIDE_AS_BEFORE = 0.8
"""Deviation after over before the fit above which a parameter counts as not identified (ours): the drives then hold
half as much information on it as its prior."""


def unidentified(model: FittedModel) -> dict[str, float]:
    """Parameters whose deviation is about as wide as their prior, with the ratio of the two.

    The widest one is held, which may identify another that it was confused with, and so on.
    """
    names = np.array(model.free)
    prior = np.array([p.prior for p in model.parameters if p.prior > 0.0])
    information = linearised(model.problem, model.fitted).information
    open_ = np.arange(len(names))
    found: dict[str, float] = {}
    while open_.size:
        deviation = np.sqrt(np.diag(np.linalg.inv(information[np.ix_(open_, open_)])))
        ratio = deviation / prior[open_]
        worst = int(np.argmax(ratio))
        if ratio[worst] < AS_WIDE_AS_BEFORE:
            break
        found[str(names[open_[worst]])] = float(ratio[worst])
        open_ = np.delete(open_, worst)
    return {name: ratio for name, ratio in found.items() if not name.startswith(OF_SENSORS)}


def covariance(model: FittedModel) -> Array:
    """(P, P) covariance of the free parameters inside the drives, with the larger of both kinds of deviations.

    Equation (6) of :mod:`~ddagr_gym.identification.least_squares`.
    """
    linear = linearised(model.problem, model.fitted)
    inverse = np.asarray(np.linalg.inv(linear.information), dtype=np.float64)
    scores = np.einsum("wmp,wm->wp", linear.sensitivity, linear.residual) @ inverse
    return _at_least(scores.T @ scores, inverse)


def _at_least(sandwich: Array, inverse: Array) -> Array:
    """Covariance with the correlations of the sandwich and the larger deviations of the two.

    A parameter that no reading depends on has no sandwich, and its prior alone.
    """
    wide = np.sqrt(np.maximum(np.diag(sandwich), np.diag(inverse)))
    root = np.sqrt(np.diag(sandwich))
    scale = np.divide(wide, root, out=np.zeros(len(root)), where=root > 0.0)
    alone = np.where(root > 0.0, 0.0, np.diag(inverse))
    return np.asarray(sandwich * np.outer(scale, scale) + np.diag(alone))
