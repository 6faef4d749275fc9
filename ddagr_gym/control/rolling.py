"""B0: bank speeds of a robot that rolls without slip."""

from __future__ import annotations

from ddagr_gym.control.turn_controller import TurnController
from ddagr_gym.parameters import Robot


class RollingWithoutSlip(TurnController):
    """Kinematic bank speeds, geometric track, no feedback in the turn."""

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot, track_ratio=1.0)
