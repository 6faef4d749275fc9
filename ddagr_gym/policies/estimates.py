"""Estimates of the soil that replace the filter's in a policy's observation, for ablations: frozen, wrong, true.

They need the raw samples or the true state (``info_level="full"``), so they are for evaluation only.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.control.observation import FEATURE_SCALES, OBSERVATION, PLACES
from ddagr_gym.envs.constants import OBSERVATION_LIMIT
from ddagr_gym.envs.ekf_features import FEATURE_COUNT, EkfFeatureBatch
from ddagr_gym.errors import InputError
from ddagr_gym.estimation import BatchFilter, FilterModel, SoilPrior
from ddagr_gym.parameters import Robot, Sensors

Observation = NDArray[np.float32]

_BASE = len(OBSERVATION)
_MOTION = [PLACES["estimated_v_x"], PLACES["estimated_yaw_rate"]]
_SLIPS = [PLACES["estimated_slip_right"], PLACES["estimated_slip_left"]]

_NEVER_LEARNS = 1e9
"""De-weighting with which the parameters do not move [-]."""

WRONG_LIMIT, WRONG_RATE = 2.0, 0.5
"""Factors on the prior's traction limit and rate of the deliberately wrong soil: strong but slippery (ours)."""


class LiveEstimate:
    """The filter's estimate, unchanged."""

    def reset(self) -> None:
        """Nothing to forget."""

    def __call__(self, observation: Observation, info: Any) -> Observation:
        """The observation as it came."""
        return observation


class TrueMotion:
    """The true speed, yaw rate and slips in place of the estimated ones.

    The force law's parameters stay the filter's: on a terramechanic soil they have no true value.
    """

    def reset(self) -> None:
        """Nothing to forget."""

    def __call__(self, observation: Observation, info: Any) -> Observation:
        """The observation with the true motion of ``info_level="full"``."""
        given = _full(info, "true_v_x")
        slip = given["true_slip_ratio"]
        changed = observation.copy()
        values = np.array([given["true_v_x"], given["true_yaw_rate"]])
        changed[_MOTION] = values / FEATURE_SCALES[:2]
        changed[_SLIPS] = [0.5 * (slip[0] + slip[2]), 0.5 * (slip[1] + slip[3])]
        return np.clip(changed, -OBSERVATION_LIMIT, OBSERVATION_LIMIT)


class FixedSoil:
    """A second filter that never learns the soil: parameters and deviations stay those of ``prior``.

    Args:
        robot: nominal robot.
        sensors: nominal sensors.
        prior: the fixed soil; the filter's own by default.
    """

    def __init__(self, robot: Robot, sensors: Sensors, prior: SoilPrior | None = None) -> None:
        nominal = FilterModel.of(robot, sensors)
        noise = replace(
            nominal.noise, soil=0.0, accelerometer_deweighting=_NEVER_LEARNS, learning_deweighting=_NEVER_LEARNS
        )
        self._features = EkfFeatureBatch(robot, sensors, 1)  # counts the logs from the nominal prior
        self._features.filter = BatchFilter(replace(nominal, noise=noise, prior=prior), 1)
        self._started = False

    def reset(self) -> None:
        """Back to the prior, at rest."""
        self._features.reset([0])
        self._started = False

    def __call__(self, observation: Observation, info: Any) -> Observation:
        """The observation with this filter's features."""
        given = _full(info, "samples")
        if self._started:
            self._features.update(given["command"][None], given["samples"][None])
        self._started = True
        features = np.empty((1, FEATURE_COUNT), dtype=np.float32)
        self._features.write(features)
        return np.concatenate([observation[:_BASE], features[0]])


def _full(info: Any, key: str) -> Any:
    if info is None or key not in info:
        raise InputError('this ablation needs the samples and the true state: use info_level="full".')
    return info


Estimate = LiveEstimate | TrueMotion | FixedSoil

ESTIMATES: dict[str, tuple[Callable[[Robot, Sensors], Estimate], str]] = {
    "live": (lambda robot, sensors: LiveEstimate(), "the filter's estimate"),
    "frozen": (FixedSoil, "the soil frozen at the filter's prior"),
    "wrong": (
        lambda robot, sensors: FixedSoil(robot, sensors, wrong_prior()),
        "the soil fixed at deliberately wrong values",
    ),
    "feed_forward": (lambda robot, sensors: LiveEstimate(), "its network silenced, only feed-forward and loop"),
    "true": (lambda robot, sensors: TrueMotion(), "the true speed, yaw rate and slip"),
}
"""By name: how it is made, and what it is in a phrase. With "feed_forward" the policy's outputs are zero."""

OF_EVERY_POLICY = ("live", "feed_forward")
"""Those that do not need the filter's features."""


def wrong_prior() -> SoilPrior:
    """Twice the traction limit, half the rate at which slip mobilises it."""
    nominal = SoilPrior()
    return replace(
        nominal,
        traction_limit_over_load=WRONG_LIMIT * nominal.traction_limit_over_load,
        traction_rate=WRONG_RATE * nominal.traction_rate,
    )
