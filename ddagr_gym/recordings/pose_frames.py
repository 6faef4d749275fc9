"""Whether the poses of a drive's stretches are in one frame: a robot cannot jump between them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ddagr_gym.recordings.schema import Recording

FARTHEST_JUMP = 1.0
"""Distance between the end of a stretch and the next one's start that bad positions alone can make [m] (ours)."""

FASTER = 2.0
"""Times the highest speed within stretches that a robot may have gone between them (ours)."""

_SPEED_OVER = 0.5
"""Time over which speeds are taken from poses [s] (ours)."""


def _has_stretches_with_poses(recording: Recording) -> bool:
    """Whether poses come in several stretches."""
    return len(recording.meta.spans) > 1 and recording.has("pose_x", "pose_y", "pose_yaw")


def frames_apart(recording: Recording) -> bool:
    """Whether stretches of a drive have poses in frames of their own.

    They have where one begins farther from the end of the one before than the robot can have gone in between, at
    :data:`FASTER` times the highest speed that the poses show within stretches.
    """
    if not _has_stretches_with_poses(recording):
        return False
    places = np.stack([recording["pose_x"], recording["pose_y"]], axis=1)
    known = [s.start + np.flatnonzero(np.isfinite(places[s]).all(axis=1)) for s in recording.spans()]
    known = [rows for rows in known if len(rows)]
    highest = max((_highest_speed(recording.t[rows], places[rows]) for rows in known), default=0.0)
    for before, after in pairwise(known):
        last, first = before[-1], after[0]
        gone = float(np.linalg.norm(places[first] - places[last]))
        if gone > FARTHEST_JUMP + FASTER * highest * float(recording.t[first] - recording.t[last]):
            return True
    return False


def _highest_speed(t: np.ndarray, places: np.ndarray) -> float:
    """Largest distance over time between poses about half a second apart [m/s]; 0 where there are none."""
    later = np.searchsorted(t, t + _SPEED_OVER)
    chosen = later < len(t)
    if not chosen.any():
        return 0.0
    gone = np.linalg.norm(places[later[chosen]] - places[chosen], axis=1)
    return float((gone / (t[later[chosen]] - t[chosen])).max())


def in_one_frame(recordings: Sequence[Recording]) -> bool:
    """Whether directions mean the same in all drives: they have headings, each in one frame.

    Args:
        recordings: of one ground.
    """
    return all(recording.has("pose_yaw") and not frames_apart(recording) for recording in recordings)
