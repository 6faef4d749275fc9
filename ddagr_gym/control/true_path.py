"""Upper bound, never deployable: follows the commanded path by the true pose."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.control.observation import TurnObservation, decode
from ddagr_gym.control.pid import Pid, PidGains
from ddagr_gym.control.row_turn import Phase, RowTurn
from ddagr_gym.control.timing import CONTROL_PERIOD
from ddagr_gym.control.turn_controller import TurnController, commanded_turn
from ddagr_gym.errors import InputError
from ddagr_gym.parameters import Robot


class TruePath(TurnController):
    """Feed-forward on the commanded path, PI on the true lateral error and the true heading (``info_level="full"``).

    A turn that this controller cannot make for lack of grip none can: it says which scenarios are feasible.

    Args:
        robot: nominal robot.
        gains: the loop's output is a curvature [1/m], its error a lateral error [m].
        heading_gain: curvature per heading error [1/(m rad)].
        track_ratio: see :class:`TurnController`.
        lead: heading by which the feed-forward runs ahead, for the motors' lag [rad].
    """

    def __init__(
        self, robot: Robot, gains: PidGains, heading_gain: float, track_ratio: float = 1.0, lead: float = 0.0
    ) -> None:
        super().__init__(robot, track_ratio, lead, heading_gain)
        self._pid = Pid(gains, CONTROL_PERIOD)
        self._turn: RowTurn | None = None

    def reset(self) -> None:
        """Forget the integral and the path."""
        self._pid.reset()
        self._turn = None

    def __call__(self, observation: ArrayLike, info: Any = None) -> NDArray[np.float32]:
        """Action (2,), right and left bank speed over the robot's maximum."""
        seen = decode(observation)
        if self._turn is None:
            self._turn = commanded_turn(seen)
        return super().__call__(observation, info)

    def curvature(self, seen: TurnObservation, phase: Phase, info: Any) -> float:
        """Curvature of the path a little ahead, corrected by the true errors."""
        if info is None or "true_x" not in info:
            raise InputError('this controller needs the true state: make the environment with info_level="full".')
        assert self._turn is not None
        distance, lateral = self._turn.project(info["true_x"], info["true_y"])
        ahead = distance + self.lead * seen.target_radius
        heading = float(info["true_yaw"]) - float(self._turn.heading(distance))
        feed_forward = float(self._turn.curvature(ahead))
        return feed_forward + self._pid.update(-float(lateral)) - self.heading_gain * heading
