"""Estimated pose and path errors as further observation entries, for one environment or a batch."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.control.observation import PATH_FEATURES, PATH_SCALES, decode
from ddagr_gym.control.path_tracker import path_errors
from ddagr_gym.control.row_turn import SIDES, RowTurn
from ddagr_gym.control.tracker_settings import SETTLING
from ddagr_gym.control.turn_controller import commanded_turn
from ddagr_gym.envs.constants import OBSERVATION_LIMIT
from ddagr_gym.envs.ekf_features import FEATURE_COUNT, EkfFeatureBatch
from ddagr_gym.estimation import InertialModel, Reckoned
from ddagr_gym.estimation.inertial_layout import GRAVITY
from ddagr_gym.estimation.layout import PARAMETER, PARAMETER_SIZE
from ddagr_gym.estimation.reckoned_batch import ReckonedBatch
from ddagr_gym.parameters import Robot, Sensors

Array = NDArray[np.float64]

_NO_TURN = RowTurn()
"""Of environments that have not begun, whose entries mean nothing."""


def _entries(turn: RowTurn) -> Array:
    return np.array([turn.sign, turn.radius, turn.run_in, turn.speed])


@lru_cache(maxsize=4096)
def _turn(sign: float, radius: float, run_in: float, speed: float) -> RowTurn:
    side = next(name for name, own in SIDES.items() if own == sign)
    return RowTurn(radius=radius, side=side, run_in=run_in, speed=speed)


def path_entries(turn: RowTurn, at: Reckoned) -> Array:
    """Entries of :data:`~ddagr_gym.control.observation.PATH_FEATURES` (10,) in SI units."""
    errors = path_errors(turn, at)
    course_error, curvature = errors.course_error(errors.side_slip), float(turn.curvature(errors.distance))
    path = (errors.lateral, course_error, errors.to_go, curvature)
    return np.array([at.x, at.y, at.yaw, at.v_y, *at.gravity, *path])


class PathFeatureBatch(EkfFeatureBatch):
    """Inertial filters of N robots, the features of their estimates and those of their poses on the commanded path.

    Args:
        robot: nominal robot.
        sensors: nominal sensors.
        count: N.
    """

    size = FEATURE_COUNT + len(PATH_FEATURES)

    filter: ReckonedBatch

    def __init__(self, robot: Robot, sensors: Sensors, count: int) -> None:
        super().__init__(robot, sensors, count, "inertial")
        self.filter = ReckonedBatch(InertialModel.of(robot, sensors), count, SETTLING)
        self._turns = np.tile(_entries(_NO_TURN), (count, 1))

    def remembered(self) -> dict[str, NDArray[np.generic]]:
        """The arrays that it goes on from."""
        return {**super().remembered(), "turns": self._turns}

    def begin(self, chosen: Sequence[int] | NDArray[np.int64], observations: NDArray[np.float32]) -> None:
        """Note what the first observations (n, entries) of the ``chosen`` environments command."""
        for n, observation in zip(chosen, observations, strict=True):
            self._turns[n] = _entries(commanded_turn(decode(observation)))

    def reckoned(self) -> list[tuple[RowTurn, Reckoned]]:
        """Turn of each robot, and where it is."""
        states, poses = self.filter.states, self.filter.settled
        soils = np.exp(states[:, PARAMETER : PARAMETER + PARAMETER_SIZE])
        found = []
        for n, row in enumerate(states.tolist()):
            turn = _turn(*self._turns[n].tolist())
            x, y, yaw = poses[n].tolist()
            pull = (row[GRAVITY], row[GRAVITY + 1])
            found.append((turn, Reckoned(x - turn.run_in, y, yaw, row[0], row[1], row[2], soils[n], pull)))
        return found

    def write(self, features: NDArray[np.float32]) -> None:
        """Write the present features (N, size)."""
        super().write(features[:, :FEATURE_COUNT])
        entries = np.array([path_entries(turn, at) for turn, at in self.reckoned()]) / PATH_SCALES
        features[:, FEATURE_COUNT:] = np.clip(entries, -OBSERVATION_LIMIT, OBSERVATION_LIMIT)
