"""Frames: world x, y horizontal; body x forward, y left; yaw counter-clockwise positive (REP 103)."""

from __future__ import annotations

from typing import overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@overload
def wrap_angle(angle: float) -> float: ...
@overload
def wrap_angle(angle: Array) -> Array: ...
def wrap_angle(angle: float | Array) -> float | Array:
    """Angle [rad] moved by whole turns into (-pi, pi]; a scalar gives a float, an array keeps its shape."""
    wrapped = np.pi - np.mod(np.pi - np.asarray(angle, dtype=float), 2.0 * np.pi)
    # Just above an odd multiple of pi the remainder can round to a whole turn.
    wrapped = np.where(wrapped <= -np.pi, np.pi, wrapped)
    return float(wrapped) if wrapped.ndim == 0 else wrapped


def rotation_matrix(yaw: ArrayLike) -> Array:
    """Matrix R(yaw) with v_world = R v_body, shape ``yaw.shape + (2, 2)``; ``yaw`` [rad]."""
    yaw = np.asarray(yaw, dtype=float)
    c, s = np.cos(yaw), np.sin(yaw)
    return np.stack([np.stack([c, -s], axis=-1), np.stack([s, c], axis=-1)], axis=-2)


def body_to_world(points: ArrayLike, x: ArrayLike, y: ArrayLike, yaw: ArrayLike) -> Array:
    """World positions of points fixed to a body.

    Args:
        points: body coordinates (..., N, 2) [m].
        x, y: world position of the body origin, each (...) [m].
        yaw: heading (...) [rad].

    Returns:
        World coordinates (..., N, 2) [m].
    """
    origin = np.stack(np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float)), axis=-1)
    rotated = np.asarray(points, dtype=float) @ np.swapaxes(rotation_matrix(yaw), -1, -2)
    return np.asarray(rotated + origin[..., None, :])


def unwrap_heading(yaw: ArrayLike) -> Array:
    """Continuous heading (T,) [rad] from one known up to whole turns; NaN (no new sample) stays NaN."""
    continuous = np.array(yaw, dtype=float)
    known = np.isfinite(continuous)
    continuous[known] = np.unwrap(continuous[known])
    return continuous
