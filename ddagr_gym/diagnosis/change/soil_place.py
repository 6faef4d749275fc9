"""A changed soil that may lie in a place: the rival that sizes of a changed soil do not tell from it.

A patch under all of a drive is a changed soil, and one under half of it looks like a changed soil that is half as
large. A place has no counterpart in ordinary drives, but the patch's factors have: those of a changed soil.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.gauss_newton import Fitted
from ddagr_gym.physics.effects.soil_change import SoilChange
from ddagr_gym.physics.effects.soil_patch import SoilPatch

Array = NDArray[np.float64]

PATH = slice(5, 7)
"""Place of the robot among the readings of a prediction."""


def patch_of_change(before: Fitted, changed: Fitted) -> SoilPatch | None:
    """The disc of ground whose windows gain most by a changed soil, with its factors; None where no window gains.

    Windows outside gain nothing by a patch, so that the sum of what those inside gain is what it would explain.

    Args:
        before: fit without the changed soil, which is the last effect of the other.
        changed: fit with it.

    Raises:
        ValueError: the last effect of the other fit is no changed soil.
    """
    soil = changed.point.effects[-1]
    if not isinstance(soil, SoilChange):
        raise ValueError(f"{soil.name} is no changed soil")
    gains = before.window_cost - changed.window_cost
    paths = changed.prediction[..., PATH]
    disc = _best_disc(paths, gains)
    if disc is None:
        return None
    centre, radius = disc
    low, high = (SoilPatch.parameter("radius").metadata[name] for name in ("low", "high"))
    return SoilPatch(
        soil.strength,
        soil.stiffness,
        centre_x=float(centre[0]),
        centre_y=float(centre[1]),
        radius=float(np.clip(radius, low, high)),
    )


def _best_disc(paths: Array, gains: Array) -> tuple[Array, float] | None:
    """Centre (2,) and radius [m] of the disc about a window whose windows gain most together; None below 0.

    Args:
        paths: (W, T, 2) places in each window [m].
        gains: (W,) of the windows.
    """
    middles = paths.mean(axis=1)
    best, found = 0.0, None
    for centre in middles:
        distance = np.linalg.norm(middles - centre, axis=1)
        order = np.argsort(distance, kind="stable")
        total = np.cumsum(gains[order])
        last = int(np.argmax(total))
        if total[last] > best:
            inside, outside = order[: last + 1], order[last + 1 :]
            reach = float(np.linalg.norm(paths[inside] - centre, axis=2).max())
            # of windows on the rim a part lies on either side
            rim = 0.5 * float(distance[inside].max() + distance[outside].min()) if outside.size else reach + 1.0
            best, found = float(total[last]), (centre, rim)
    return found
