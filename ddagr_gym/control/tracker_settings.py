"""Gains of closed loops and of the path tracker, as files hold them."""

from __future__ import annotations

from dataclasses import dataclass

from ddagr_gym.control.pid import PidGains
from ddagr_gym.validated import Validated, bounded

STANDING = 10
"""Control periods for which the path tracker stands before it drives, 0.8 s: 100 samples tell gravity to 3 mm/s^2."""

SETTLING = 3.0
"""Time in which the path tracker's pose takes over what its filter learns later of the way so far [s]; chosen by turns
on development plants with seeds of their own, for the error of the radius (docs/results)."""


@dataclass(frozen=True)
class LoopSettings(Validated):
    """A closed loop of the ladder.

    Attributes:
        gains: of the loop.
        lead_factor: heading before the end of the turn at which it straightens, over that of the constant speeds.
    """

    gains: PidGains
    lead_factor: float = bounded("-", 0.0, 5.0, default=1.0)


@dataclass(frozen=True)
class TrackerSettings(Validated):
    """Gains of a path tracker (theory: control, eq. (7) and (7a)).

    Attributes:
        loop: curvature per cross-track error, and the lead factor.
        course: curvature per course error [1/(m rad)].
        ahead: time by which the errors run ahead, without delays that are known [s].
        side_slip: share of the side slip in the course [-].
        aligning: distance over which the nose turns into the next row [m].
        largest_slip: side slip that counts at most [rad].
    """

    loop: LoopSettings
    course: float = bounded("1/(m rad)", 0.0, 1e3)
    ahead: float = bounded("s", 0.0, 5.0)
    side_slip: float = bounded("-", 0.0, 2.0)
    aligning: float = bounded("m", 0.0, 10.0)
    largest_slip: float = bounded("rad", 0.0, 3.2)
