"""Where recordings without poses begin: a place and a heading each, which only what is fixed in the world can show.

Dead reckoning ties the windows of such a recording to each other. A slope is then seen in one frame after the other,
whose headings are nuisances; taken as begun alike they would not agree, and a bias would have to make up for it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.base import GROUPS
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.replay.parameters import ModelParameter
from ddagr_gym.replay.windows import STATE, WindowSet

Array = NDArray[np.float64]

POSE = ("pose_x", "pose_y", "pose_yaw")
YAW = STATE.index("yaw")
_X, _Y = STATE.index("x"), STATE.index("y")
_GROUND = GROUPS[2]


def without_poses(recordings: Sequence[Recording]) -> tuple[int, ...]:
    """Numbers of the recordings that no receiver has followed."""
    return tuple(number for number, recording in enumerate(recordings) if not recording.has(*POSE))


def matter(origin: int, effects: Sequence[Effect]) -> bool:
    """Whether readings depend on an entry of the origin: a heading with any effect of the ground, a place with patches.

    Args:
        origin: index in STATE.
        effects: assumed.
    """
    ground = [effect for effect in effects if effect.group == _GROUND]
    return any(origin == YAW or "centre_x" in effect.shape_names() for effect in ground)


def moved_starts(windows: WindowSet, parameters: Sequence[ModelParameter], values: Array) -> Array:
    """(W, 8) first guess of STATE where the recordings' origins lie at their values.

    Args:
        windows: whose first guess holds for origins at 0.
        parameters: (P,) of the model.
        values: (P,) of them.
    """
    initial = windows.initial.copy()
    for recording in {p.recording for p in parameters if p.origin is not None}:
        x, y, yaw = _origin(parameters, values, recording)
        chosen = windows.recording == recording
        before = windows.initial[chosen]
        initial[chosen, _X] = x + np.cos(yaw) * before[:, _X] - np.sin(yaw) * before[:, _Y]
        initial[chosen, _Y] = y + np.sin(yaw) * before[:, _X] + np.cos(yaw) * before[:, _Y]
        initial[chosen, YAW] = yaw + before[:, YAW]
    return initial


def _origin(parameters: Sequence[ModelParameter], values: Array, recording: int | None) -> Array:
    """(3,) x, y [m] and heading [rad] at which a recording begins."""
    origin = np.zeros(3)
    for parameter, value in zip(parameters, values, strict=True):
        if parameter.origin is not None and parameter.recording == recording:
            origin[parameter.origin] = value
    return origin
