"""Recordings without poses begin with a heading each, which only what is fixed in the world can show.

Dead reckoning ties the windows of such a recording to each other. A slope is then seen in one frame after the other,
whose headings are nuisances; taken as begun alike they would not agree, and a bias would have to make up for it. Places
are another matter: a patch is looked for as if the recordings had begun at one place.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.parameters import ModelParameter
from ddagr_gym.identification.timing_repair import POSE_CHANNELS
from ddagr_gym.identification.windows import STATE, WindowSet
from ddagr_gym.physics.effects import Effect
from ddagr_gym.recordings.schema import Recording

Array = NDArray[np.float64]

_X, _Y, _YAW = (STATE.index(name) for name in ("x", "y", "yaw"))


def without_poses(recordings: Sequence[Recording]) -> tuple[int, ...]:
    """Numbers of the recordings that no receiver has followed."""
    return tuple(number for number, recording in enumerate(recordings) if not recording.has(*POSE_CHANNELS))


def headings_matter(effects: Sequence[Effect]) -> bool:
    """Whether readings depend on headings: beside effects that have a ``direction`` in the world."""
    return any("direction" in effect.shape_names() for effect in effects)


def turned_starts(windows: WindowSet, parameters: Sequence[ModelParameter], values: Array) -> Array:
    """(W, 8) first guess of STATE where the recordings' headings have their values.

    Args:
        windows: whose first guess holds for headings of 0; recordings without poses begin at the origin.
        parameters: (P,) of the model.
        values: (P,) of them.
    """
    initial = windows.initial.copy()
    for parameter, yaw in zip(parameters, values, strict=True):
        if parameter.heading:
            chosen = parameter.acts_in(windows.recording)
            before = windows.initial[chosen]
            initial[chosen, _X] = np.cos(yaw) * before[:, _X] - np.sin(yaw) * before[:, _Y]
            initial[chosen, _Y] = np.sin(yaw) * before[:, _X] + np.cos(yaw) * before[:, _Y]
            initial[chosen, _YAW] = yaw + before[:, _YAW]
    return initial
