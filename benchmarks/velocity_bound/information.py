"""The posterior Cramer-Rao bound where the truth has no noise of its own: all that is unknown are constants.

The recursion of Tichavsky, Muravchik and Nehorai (IEEE Trans. Signal Process. 46 (1998) 1386) for a state with the
one-step map f and process noise of covariance zero is J <- F^-T J F^-1 + H^T R^-1 H. In the coordinates of the unknown
constants u, of which the motion is a function, F is the identity, and with G = d reading / d u it becomes

    J <- J + G^T R^-1 G,        bound of the motion's covariance: S J^-1 S^T,  S = d motion / d u.

Nothing is inverted along the way, and process noise, where there is some, is further unknowns: one for each step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cho_factor, cho_solve

Array = NDArray[np.float64]


def accumulated_information(readings: ArrayLike, deviations: ArrayLike, every: int = 1) -> Array:
    """Information on standardised unknowns (K, P, P) after every block of ``every`` samples, with that of the prior.

    Args:
        readings: derivatives of the readings (T, C, P) by unknowns whose prior is N(0, 1).
        deviations: of a reading's noise (C,), in its unit; infinity for a channel that is not there.
        every: samples in a block; an incomplete last one is left out.
    """
    weighted = np.asarray(readings, dtype=np.float64) / np.asarray(deviations, dtype=np.float64)[:, None]
    size = weighted.shape[2]
    blocks = weighted[: len(weighted) // every * every].reshape(-1, every * weighted.shape[1], size)
    return np.eye(size) + np.cumsum(np.swapaxes(blocks, 1, 2) @ blocks, axis=0)


class Bounds(NamedTuple):
    """Least covariances of the motion v_x, v_y, yaw rate, x, y, yaw at K instants.

    Attributes:
        filtered: (K, 6, 6) from the readings so far.
        smoothed: (K, 6, 6) from all readings.
        reckoned: (K, 3, 3) of the pose to which the best filtered velocities lead, integrated as they come.
    """

    filtered: Array
    smoothed: Array
    reckoned: Array


def motion_bounds(information: Array, motion: Array, track: Array, interval: float) -> Bounds:
    """Bounds of a drive.

    Args:
        information: (K, P, P).
        motion: derivatives (K, 6, P) of v_x, v_y, yaw rate, x, y, yaw.
        track: x, y, yaw (K, 3) of the truth [m, rad].
        interval: between instants [s].
    """
    covariances = np.array([cho_solve(cho_factor(own), np.eye(len(own))) for own in information])
    return Bounds(
        motion @ covariances @ np.swapaxes(motion, 1, 2),
        motion @ covariances[-1] @ np.swapaxes(motion, 1, 2),
        _reckoned(covariances, motion[:, :3], track, interval),
    )


def _reckoned(covariances: Array, velocities: Array, track: Array, interval: float) -> Array:
    """Covariances (K, 3, 3) of x, y, yaw by the sums of the filtered velocities' errors.

    The errors of the best estimates of constants from the readings up to s and up to t > s have the covariance P(t).
    """
    size = velocities.shape[2]
    x, y, yaw = track.T
    cosine, sine = np.cos(yaw), np.sin(yaw)
    places = np.zeros((3, size))  # d pose / d unknowns by what was integrated so far
    lever = np.zeros((2, size))  # the same of the sums of x r and y r, for the lever of a turn
    turned = np.zeros(size)
    found = np.zeros((len(track), 3, 3))
    sums = np.zeros((5, 5))  # of x, y, yaw and the two levers
    for k, own in enumerate(covariances):
        v_x, v_y, rate = velocities[k]
        step = interval * np.array(
            [cosine[k] * v_x - sine[k] * v_y, sine[k] * v_x + cosine[k] * v_y, rate, x[k] * rate, y[k] * rate]
        )
        before = np.vstack([places[:2], turned, lever])
        cross = step @ own @ before.T
        sums += step @ own @ step.T + cross + cross.T
        places[:2] += step[:2]
        turned += step[2]
        lever += step[3:]
        # an error of the yaw rate at s moves the place at k by the lever from s to k, turned by a right angle
        now = np.array([[1.0, 0.0, -y[k], 0.0, 1.0], [0.0, 1.0, x[k], -1.0, 0.0], [0.0, 0.0, 1.0, 0.0, 0.0]])
        found[k] = now @ sums @ now.T
    return found
