"""Which joints of a JointState are the right and the left wheels: by their names, else by how they turn."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from ddagr_gym.recordings.checks.signals import STILL_SPEED
from ddagr_gym.recordings.guess.candidates import Candidate
from ddagr_gym.recordings.guess.names import LEFT, RIGHT, side_of, wheel_joints
from ddagr_gym.recordings.schema import FloatArray

MOST_WHEELS = 8
"""Joints without a side in their names, beyond which no banks are looked for (ours)."""


@dataclass(frozen=True)
class Banks:
    """Joints of both banks.

    Attributes:
        right: names.
        left: names.
        by_name: whether the names tell the sides; else ``right`` is one of both, and the gyro has to say which.
        why: what speaks for it, in words.
    """

    right: tuple[str, ...]
    left: tuple[str, ...]
    by_name: bool
    why: str

    def exchanged(self) -> Banks:
        """The same with the other side."""
        return Banks(self.left, self.right, self.by_name, self.why)


def banks_of(candidate: Candidate) -> Banks | None:
    """Banks among the joints of a JointState; None where there are no two.

    Args:
        candidate: with the speeds of single joints.
    """
    speeds = {name: np.array(values) for name, values in candidate.samples.values.items()}
    joints = [joint for joint in wheel_joints(tuple(speeds)) if np.any(np.isfinite(speeds[joint]))]
    sides = {joint: side_of(joint) for joint in joints}
    right, left = (tuple(j for j in joints if sides[j] == side) for side in (RIGHT, LEFT))
    if right and left:
        return Banks(right, left, True, f"{_listed(right)} right and {_listed(left)} left by name")
    if len(joints) % 2 or not 2 <= len(joints) <= MOST_WHEELS:
        return None
    return _by_motion({joint: speeds[joint] for joint in joints})


def moves(candidate: Candidate, banks: Banks) -> bool:
    """Whether a wheel of the banks ever turns."""
    joints = (*banks.right, *banks.left)
    fastest = max(float(np.nanmax(np.abs(np.array(candidate.samples.values[j])), initial=0.0)) for j in joints)
    return fastest >= STILL_SPEED


def _by_motion(speeds: dict[str, FloatArray]) -> Banks | None:
    """Halves within which the joints turn most alike: wheels of one bank are geared or chained together."""
    joints = tuple(speeds)
    known = np.all([np.isfinite(values) for values in speeds.values()], axis=0)
    if not known.any():
        return None

    def spread(half: tuple[str, ...]) -> float:
        halves = (half, tuple(joint for joint in joints if joint not in half))
        return sum(float(np.mean(np.var([speeds[j][known] for j in part], axis=0))) for part in halves)

    rest = itertools.combinations(joints[1:], len(joints) // 2 - 1)
    right = min(((joints[0], *others) for others in rest), key=spread)
    left = tuple(joint for joint in joints if joint not in right)
    alike = "" if len(joints) == 2 else ", which turn alike,"
    return Banks(right, left, False, f"{_listed(right)}{alike} against {_listed(left)}; their names tell no side")


def _listed(joints: tuple[str, ...]) -> str:
    return " and ".join(joints) if len(joints) < 3 else f"{', '.join(joints[:-1])} and {joints[-1]}"
