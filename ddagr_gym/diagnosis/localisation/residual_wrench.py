"""The force and moment on the body that would explain what a model leaves, along the path.

A wrench held over a window changes speeds, slips and so the soil's reaction; its effect on all channels comes from one
simulation per component, and the window's unknowns are projected out of it. In steady motion an accelerometer shows
nothing of a drag: the soil balances it at another slip, which encoders and poses show. Small forces in straight steady
motion hardly show at all (their deviations say so), and starts from rest are not linear in them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.gauss_newton import Fitted
from ddagr_gym.identification.misfit import projected_residual
from ddagr_gym.identification.problem import Problem
from ddagr_gym.physics.effects.base import Effect, Vector, size
from ddagr_gym.physics.layout import BODY_FORCE, POINT_BODY_FORCES

Array = NDArray[np.float64]

COMPONENTS = (("F_x", "N"), ("F_y", "N"), ("M_z", "N m"))
"""Of a wrench at the body origin, in body axes."""

WIDEST = 1e4
"""Standard deviation before any data [N, N m]: what no window shows comes out at this."""

_STEP = 5.0
"""Wrench whose effect on the readings, divided by it, is the derivative [N, N m] (ours: well above rounding, and small
beside the robot's weight)."""


def push(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Add the wrench ``parameters[:3]`` at the body origin."""
    row[BODY_FORCE] += parameters[0]
    row[BODY_FORCE + 1] += parameters[1]
    row[BODY_FORCE + 2] += parameters[2]


@dataclass(frozen=True)
class HeldWrench(Effect):
    """Constant wrench in body axes: a probe of the diagnosis, not an effect of the library.

    Attributes:
        force_x: forward.
        force_y: to the left.
        moment: counter-clockwise.
    """

    name = "held_wrench"
    title = "Held wrench"
    group = "robot"
    equation = "F_x, F_y, M_z added at the body origin"
    source = "ours"
    signature = "none of its own"
    actions = ((POINT_BODY_FORCES, push),)

    force_x: float = size("N", -1e5, 1e5, least=1.0, default=0.0)
    force_y: float = size("N", -1e5, 1e5, least=1.0, default=0.0)
    moment: float = size("N m", -1e5, 1e5, least=1.0, default=0.0)


@dataclass(frozen=True, eq=False)
class ResidualWrench:
    """Wrenches by window.

    Attributes:
        before: (W, 3) F_x, F_y [N], M_z [N m] that the nominal model lacks as it stands.
        after: (W, 3) the same of the corrected model.
        deviation: (W, 3) standard deviations.
    """

    before: Array
    after: Array
    deviation: Array


def residual_wrench(problem: Problem, before: Fitted, after: Fitted, dispersion: float = 1.0) -> ResidualWrench:
    """Wrench in each window that explains the residual best, by sensitivities at the corrected model.

    Args:
        problem: what was fitted.
        before: the nominal model, as it stands or refitted.
        after: the corrected one.
        dispersion: variance of the standardised residuals.
    """
    columns = np.stack([_column(problem, after, unit) for unit in np.eye(3)], axis=2)
    first, _ = _solve(problem, before, columns)
    second, covariance = _solve(problem, after, columns)
    deviation = np.sqrt(dispersion * np.einsum("wii->wi", covariance))
    return ResidualWrench(first, second, deviation)


def _column(problem: Problem, fitted: Fitted, unit: Sequence[float] | Array) -> Array:
    probe = HeldWrench(*(float(_STEP * item) for item in unit))
    moved = problem.predict(replace(fitted.point, effects=(*fitted.point.effects, probe)))
    return problem.blocked.change(moved, fitted.prediction) / _STEP


def _solve(problem: Problem, fitted: Fitted, columns: Array) -> tuple[Array, Array]:
    """(W, 3) wrenches and (W, 3, 3) covariances."""
    own = fitted.elimination.project(problem.padded(columns))
    covariance = np.linalg.inv(np.matmul(own.transpose(0, 2, 1), own) + np.eye(3) / WIDEST**2)
    right = np.einsum("wmk,wm->wk", own, projected_residual(problem, fitted))
    return np.einsum("wij,wj->wi", covariance, right), covariance
