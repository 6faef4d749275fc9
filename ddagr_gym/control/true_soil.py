"""Upper bound, never deployable: the strong classical controller with the true soil and the true motion."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.control.force_balance import ForceBalance
from ddagr_gym.control.observation import TurnObservation, decode
from ddagr_gym.control.row_turn import Phase
from ddagr_gym.control.turn_controller import curvature_error
from ddagr_gym.errors import InputError


class TrueSoil(ForceBalance):
    """B4 with the truth for its estimate: bank speeds by the true soil's own force law, PI on the true curvature.

    Needs ``info_level="full"``. ``feed_forward`` takes the soil (9,) in the simulator's order, speed and curvature.
    """

    def __call__(self, observation: ArrayLike, info: Any = None) -> NDArray[np.float32]:
        """Action (2,), right and left bank speed over the robot's maximum."""
        if info is None or "true_soil" not in info:
            raise InputError('this controller needs the true soil: make the environment with info_level="full".')
        seen = decode(observation)
        phase = self.phase(seen)
        commanded = seen.side / seen.target_radius if phase == Phase.TURN else 0.0
        soil = np.asarray(info["true_soil"], dtype=float).reshape(4, 9).mean(axis=0)
        steady = self._feed_forward(soil, seen.target_speed, commanded)
        if steady is None:
            steady = self.bank_speeds(seen.target_speed, commanded)
        correction = self.curvature(seen, phase, info) - commanded
        spread = seen.target_speed * self.track_ratio * self.robot.half_track / self.robot.wheels[0].outer_radius
        speeds = np.array([steady[0] + spread * correction, steady[1] - spread * correction])
        return np.clip(speeds / self.robot.maximum_wheel_speed, -1.0, 1.0).astype(np.float32)

    def error(self, seen: TurnObservation, feed_forward: float, info: Any) -> float:
        """Commanded less true curvature [1/m]."""
        speed = math.hypot(info["true_v_x"], info["true_v_y"])
        return curvature_error(feed_forward, info["true_yaw_rate"], speed, seen.target_speed)
