"""Radius of a driven arc: the part of a turn that counts, and a circle through it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ddagr_gym.control.row_turn import side_sign
from ddagr_gym.errors import InputError
from ddagr_gym.frames import unwrap_heading

WINDOW = (math.radians(30.0), math.radians(150.0))
"""Heading change between which a turn's radius is fitted [rad] (theory: control, metric 1)."""

STRAIGHT = 1e-6
"""Ours: extent over radius below which points are on a line, not on a circle [-]."""

LEAST_ARC = 0.35
"""Heading change inside that window before the radius of a turn still going on is given [rad] (ours: 20 degrees)."""


class CircleFit(NamedTuple):
    """Circle through points: centre (x, y) [m], radius [m], root mean square of the points' radial residuals [m]."""

    x: float
    y: float
    radius: float
    residual: float


def taubin_circle(x: ArrayLike, y: ArrayLike) -> CircleFit | None:
    """Circle that minimises Taubin's gradient-weighted algebraic distance, exactly, by singular values.

    With the points centred and scaled to unit mean square distance, and q = u^2 + v^2, the circle
    a (q - 1)/2 + b u + c v = 0 with a^2 + b^2 + c^2 = 1 is the right singular vector of the smallest singular
    value of the rows ((q - 1)/2, u, v); its radius is 1/|a| and its centre -(b, c)/a.

    Source: G. Taubin, IEEE Trans. PAMI 13 (1991) 1115-1138; solved as in N. Chernov, Circular and Linear
    Regression (CRC Press 2010), section 5.10.

    Args:
        x, y: at least three points (N,) [m].

    Returns:
        The fit, or None where the points do not determine a circle (fewer than three, coincident, on a line).
    """
    points = np.column_stack([np.asarray(x, dtype=float), np.asarray(y, dtype=float)])
    if len(points) < 3:
        return None
    middle = points.mean(axis=0)
    u, v = (points - middle).T
    scale = math.sqrt(float(np.mean(u * u + v * v)))
    if scale <= 1e-12 * float(np.abs(middle).max()):
        return None
    u, v = u / scale, v / scale
    _, singular, vectors = np.linalg.svd(np.column_stack([(u * u + v * v - 1.0) / 2.0, u, v]), full_matrices=False)
    a, b, c = vectors[2]
    if abs(a) < STRAIGHT or singular[1] < 1e-9 * singular[0]:
        return None
    radius = 1.0 / abs(a)
    residual = np.sqrt(np.mean((np.hypot(u + b / a, v + c / a) - radius) ** 2))
    return CircleFit(
        float(middle[0] - scale * b / a), float(middle[1] - scale * c / a), scale * radius, scale * float(residual)
    )


def turn_window(yaw: ArrayLike, side: str) -> tuple[slice | None, float]:
    """Samples of a turn in which its radius is judged: from the first at 30 degrees to the last before 150.

    Args:
        yaw: heading (T,) [rad], wrapped or not; the change counts from the first sample.
        side: "left" or "right".

    Returns:
        The window, or None where the heading never changed by 30 degrees to that side, and the largest heading
        change to that side [rad].
    """
    heading = unwrap_heading(yaw)
    if heading.ndim != 1 or not heading.size or not np.isfinite(heading).all():
        raise InputError(f"yaw has shape {heading.shape} or values that are not finite: give headings (T,) in rad.")
    change = side_sign(side) * (heading - heading[0])
    largest = float(change.max())
    if largest < WINDOW[0]:
        return None, largest
    first = int(np.argmax(change >= WINDOW[0]))
    last = int(np.argmax(change > WINDOW[1])) if largest > WINDOW[1] else len(change)
    return slice(first, last), largest


def running_radius(x: ArrayLike, y: ArrayLike, yaw: ArrayLike, side: str) -> float | None:
    """Radius [m] of a turn that is still going on, for display, from the samples of its window so far.

    Args:
        x, y, yaw: pose of the robot's centre so far, each (T,) [m, m, rad].
        side: "left" or "right".

    Returns:
        The radius, or None where the arc is too short or not a circle.
    """
    window, largest = turn_window(yaw, side)
    if window is None or largest - WINDOW[0] < LEAST_ARC:
        return None
    fit = taubin_circle(np.asarray(x)[window], np.asarray(y)[window])
    return None if fit is None else fit.radius
