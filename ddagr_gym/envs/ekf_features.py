"""The extended Kalman filter's estimates as further observation entries, for one environment or a batch."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.control.observation import EKF_FEATURES, FEATURE_SCALES
from ddagr_gym.envs.constants import OBSERVATION_LIMIT
from ddagr_gym.errors import unknown_name
from ddagr_gym.estimation import (
    BatchFilter,
    FilterModel,
    InertialBatch,
    InertialModel,
    LearnedBatch,
    LearnedModel,
)
from ddagr_gym.estimation.layout import CHANNEL_SIZE, OMEGA, PARAMETER, PARAMETER_SIZE
from ddagr_gym.jit import kernel
from ddagr_gym.parameters import Robot, Sensors
from ddagr_gym.physics.contact_stress import slip_ratio

Array = NDArray[np.float64]

FEATURE_COUNT = len(EKF_FEATURES)

FILTERS = ("flat", "inertial", "learned")
"""Filters that make features: the one that takes the ground for level, the inertial one, and that with a network."""


def check_filter(name: str) -> str:
    """``name`` if it is one of FILTERS, else an InputError."""
    if name not in FILTERS:
        raise unknown_name("filter", name, FILTERS)
    return name


@kernel()
def write_features(
    states: Array, covariances: Array, prior: Array, outer_radius: float, half_track: float, scales: Array,
    features: NDArray[np.float32],
) -> None:  # fmt: skip
    """Scaled features (N, FEATURE_COUNT) of states (N, S) and covariances (N, S, S), of which the first 12 count."""
    values = np.zeros(FEATURE_COUNT)
    for n in range(states.shape[0]):
        state = states[n]
        values[0] = state[0]
        values[1] = state[2]
        for j in range(PARAMETER_SIZE):
            values[2 + j] = state[PARAMETER + j] - prior[j]
            values[8 + j] = np.sqrt(max(covariances[n, PARAMETER + j, PARAMETER + j], 0.0))
        for bank in range(2):
            side = half_track if bank == 0 else -half_track
            values[6 + bank] = slip_ratio(outer_radius * state[OMEGA + bank], state[0] + side * state[2])
        for j in range(FEATURE_COUNT):
            features[n, j] = min(max(values[j] / scales[j], -OBSERVATION_LIMIT), OBSERVATION_LIMIT)


class EkfFeatureBatch:
    """Filters of N robots that know the nominal robot and sensors, and the features of their estimates.

    Args:
        robot: nominal robot.
        sensors: nominal sensors.
        count: N.
        kind: of FILTERS.

    Raises:
        InputError: another kind.
    """

    size = FEATURE_COUNT
    """Features of a robot."""

    def __init__(self, robot: Robot, sensors: Sensors, count: int, kind: str = "flat") -> None:
        model = FilterModel.of(robot, sensors)
        self.filter: BatchFilter | InertialBatch | LearnedBatch = BatchFilter(model, count)
        if check_filter(kind) == "inertial":
            self.filter = InertialBatch(InertialModel.of(robot, sensors), count)
        elif kind == "learned":
            self.filter = LearnedBatch(LearnedModel.of(robot, sensors), count)
        self._prior = model.soil_prior.logs(model.wheel_load)[0]
        self._outer_radius = model.outer_radius
        self._half_track = robot.half_track

    def reset(self, chosen: Sequence[int] | NDArray[np.int64]) -> None:
        """Forget the episodes of the ``chosen`` environments; the robot is at rest."""
        self.filter.reset(np.asarray(chosen, dtype=np.int64))

    def begin(self, chosen: Sequence[int] | NDArray[np.int64], observations: NDArray[np.float32]) -> None:
        """See the first observations (n, entries) of the ``chosen`` environments after their reset; nothing to note."""

    def remembered(self) -> dict[str, NDArray[np.generic]]:
        """The arrays that it goes on from."""
        return {name: getattr(self.filter, name) for name in self.filter.REMEMBERED}

    def update(self, commands: Array, readings: Array) -> None:
        """Filter the samples of one control interval.

        Args:
            commands: (N, 2) constant over the interval [rad/s].
            readings: (N, samples, 5 or more) raw sensor block.
        """
        self.filter.step(commands, readings[..., :CHANNEL_SIZE])

    def write(self, features: NDArray[np.float32]) -> None:
        """Write the present features (N, FEATURE_COUNT)."""
        write_features(
            self.filter.states, self.filter.covariances, self._prior, self._outer_radius, self._half_track,
            FEATURE_SCALES, features,
        )  # fmt: skip
