"""B1: two constant bank speeds in the turn, calibrated once on a nominal soil. The bar that others must pass."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.control.observation import decode
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.parameters import Robot
from ddagr_gym.validated import Validated, bounded


@dataclass(frozen=True)
class ConstantSpeeds(Validated):
    """Controller ``(observation, info) -> action`` of constant bank speeds in each part of the turn.

    Attributes:
        straight: bank speed of run-in and run-out [rad/s].
        outer: speed of the outer bank in the turn [rad/s].
        inner: speed of the inner bank in the turn [rad/s].
        lead: heading before the end of the turn at which it straightens, for the motors' lag [rad].
        limit: bank speed of action 1 [rad/s].
    """

    straight: float = bounded("rad/s", 0.0, 100.0)
    outer: float = bounded("rad/s", -100.0, 100.0)
    inner: float = bounded("rad/s", -100.0, 100.0)
    lead: float = bounded("rad", -1.0, 1.0, default=0.0)
    limit: float = bounded("rad/s", 0.0, 100.0, default=2.0, open_low=True)

    def track_ratio(self, turn: RowTurn, robot: Robot) -> float:
        """Effective over geometric track [-] of a robot that makes a turn with these speeds (theory: control, eq. (2)).

        Args:
            turn: that they were found for.
            robot: that makes it.
        """
        spread = (self.outer - self.inner) / (self.outer + self.inner)
        return spread * turn.radius / robot.half_track

    def reset(self) -> None:
        """Nothing to forget."""

    def __call__(self, observation: ArrayLike, info: Any = None) -> NDArray[np.float32]:
        """Action (2,): right and left bank speed over ``limit``."""
        seen = decode(observation)
        right = left = self.straight
        if seen.run_in_to_go <= 0.0 and seen.heading_to_go > self.lead:
            right, left = (self.outer, self.inner) if seen.side > 0 else (self.inner, self.outer)
        return np.clip(np.array([right, left]) / self.limit, -1.0, 1.0).astype(np.float32)
