"""A trained policy as a controller: ``(observation, info) -> action`` with numpy alone."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.parameters import Robot, Sensors
from ddagr_gym.policies.archive import Policy
from ddagr_gym.policies.estimates import ESTIMATES, OF_EVERY_POLICY
from ddagr_gym.policies.shipped import SUFFIX, find_policy, policy_names, split_estimate
from ddagr_gym.policies.view import PolicyView
from ddagr_gym.presets import ddagr


class PolicyController:
    """Drives a turn by a trained policy without exploration.

    Args:
        policy: what drives.
        robot: nominal robot.
        sensors: nominal sensors.
        estimate: one of ``ESTIMATES``; all but "live" are for ablations, and those of the filter need
            ``info_level="full"``.
    """

    def __init__(
        self, policy: Policy, robot: Robot | None = None, sensors: Sensors = Sensors(), estimate: str = "live"
    ) -> None:
        if estimate not in ESTIMATES:
            raise unknown_name("estimate", estimate, ESTIMATES)
        if estimate not in OF_EVERY_POLICY and policy.design.features != "ekf":
            raise InputError(
                f"estimate {estimate!r}: this policy does not see the filter of level ground, give only its name."
            )
        nominal = ddagr() if robot is None else robot
        self.policy = policy
        self._alone = PolicyBatch(policy, 1, estimate == "feed_forward", nominal, sensors)
        self._estimate = ESTIMATES[estimate][0](nominal, sensors)

    def reset(self) -> None:
        """Forget the last episode."""
        self._alone.reset()
        self._estimate.reset()

    def __call__(self, observation: ArrayLike, info: Any = None) -> NDArray[np.float32]:
        """Action (2,): right and left bank speed over the robot's maximum.

        Raises:
            InputError: an observation of another environment than the policy was trained for.
        """
        given = np.asarray(observation, dtype=np.float32)
        size = self.policy.design.observation_size
        if given.shape != (size,):
            needed = "DDAGR-Turn-EKF-v0" if self.policy.design.needs_filter else "DDAGR-Turn-v0"
            needed += ' with filter="inertial", path_features=True' if self.policy.design.features == "path" else ""
            raise InputError(f"observation has shape {given.shape}: this policy needs {needed}, ({size},).")
        return np.asarray(self._alone(self._estimate(given, info)[None])[0])


class PolicyBatch:
    """Drives N turns side by side by a trained policy; each to the bit as :class:`PolicyController` does.

    Args:
        policy: what drives.
        count: N.
        silent: outputs of zero in place of the policy's, as the estimate "feed_forward".
        robot: nominal robot.
        sensors: nominal sensors.
    """

    def __init__(
        self, policy: Policy, count: int, silent: bool = False, robot: Robot | None = None, sensors: Sensors = Sensors()
    ) -> None:
        self.policy = policy
        self._silent = silent
        self._view = PolicyView(policy.design, ddagr() if robot is None else robot, sensors, count)

    def reset(self) -> None:
        """Forget the last episodes."""
        self._view.reset()

    def __call__(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """Actions (N, 2) for observations (N, entries)."""
        inputs = self._view.observe(observations)
        outputs = np.zeros((len(inputs), 2), dtype=np.float32) if self._silent else self.policy(inputs)
        return self._view.act(outputs, observations)


def policy_batch(name: str, count: int) -> PolicyBatch | None:
    """N robots by a policy's name as :func:`policy_controller` takes it; None where its estimate wants the truth.

    Raises:
        InputError: unknown policy or estimate, with the closest names.
    """
    stem, estimate = split_estimate(name)
    if estimate not in ESTIMATES:
        raise unknown_name("estimate", estimate, ESTIMATES)
    if estimate not in OF_EVERY_POLICY:
        return None
    return PolicyBatch(find_policy(stem), count, silent=estimate == "feed_forward")


def is_policy_name(name: str) -> bool:
    """Whether a controller's name means a policy: a trained one, or a path, with or without an estimate."""
    stem, _ = split_estimate(name)
    return stem.endswith(SUFFIX) or stem in policy_names()


def policy_controller(name: str) -> PolicyController:
    """Controller by name: ``ppo_ekf``, a path ending in ``.npz``, or either with an estimate, ``ppo_ekf@frozen``.

    Raises:
        InputError: unknown policy or estimate, with the closest names.
    """
    stem, estimate = split_estimate(name)
    return PolicyController(find_policy(stem), estimate=estimate)


def policy_needs_filter(name: str) -> bool:
    """Whether the environment must append the filter's features for this policy."""
    return find_policy(split_estimate(name)[0]).design.needs_filter


def policy_environment(name: str) -> dict[str, Any]:
    """What the environment must be given for this policy."""
    return find_policy(split_estimate(name)[0]).design.environment


def policy_title(name: str) -> str:
    """What a policy is, in a phrase."""
    stem, estimate = split_estimate(name)
    if estimate not in ESTIMATES:
        raise unknown_name("estimate", estimate, ESTIMATES)
    design = find_policy(stem).design
    sees = {"raw": "raw sensors", "ekf": "the filter's features", "path": "the estimated path errors"}[design.features]
    history = f" and {design.frames} instants" if design.frames > 1 else ""
    replaced = "" if estimate == "live" else f", {ESTIMATES[estimate][1]}"
    corrected = "path tracker" if design.features == "path" else "feed-forward"
    acts = "bank speeds" if design.action == "absolute" else f"a correction of the {corrected}"
    return f"learned policy: {sees}{history} to {acts}{replaced}"


def is_deployable_policy(name: str) -> bool:
    """Whether it does without the true state."""
    return split_estimate(name)[1] != "true"
