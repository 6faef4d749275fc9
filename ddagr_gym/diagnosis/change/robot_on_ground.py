"""A calibrated robot on one ground: parameters as the drives on it tell them, and how far another drive deviates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from ddagr_gym.identification.fitted_values import robot_with_values
from ddagr_gym.identification.parameters import ModelParameter, robot_parameters
from ddagr_gym.parameters import Robot

LEAST_SHARE = 0.1
"""Of the step of its finite difference, below which a parameter's deviation means nothing (ours)."""


def uncertain_robot(robot: Robot, deviations: Mapping[str, float]) -> tuple[ModelParameter, ...]:
    """Parameters of a robot with the deviations that another drive may have, by name, as priors; those alone.

    Args:
        robot: calibrated.
        deviations: by parameter; what is no part of the robot, as a gyro's scale, is passed over.
    """
    return tuple(
        replace(p, prior=max(deviations[p.name], LEAST_SHARE * p.step))
        for p in robot_parameters(robot)
        if p.name in deviations
    )


@dataclass(frozen=True)
class RobotOnGround:
    """What is known of a robot's parameters on one ground beside its calibrated values.

    Attributes:
        changes: from the calibrated values, by parameter: logarithms of factors, or differences.
        deviations: of another drive on that ground from these, likewise.
    """

    changes: Mapping[str, float] = field(default_factory=dict)
    deviations: Mapping[str, float] = field(default_factory=dict)

    def robot(self, robot: Robot) -> Robot:
        """The calibrated robot as it is on the ground."""
        return robot_with_values(robot, self.changes_of(robot)) if self.changes else robot

    def changes_of(self, robot: Robot) -> dict[str, float]:
        """The changes of a robot, as far as its parameters have no bounds (no delay is less than nothing)."""
        found = [p for p in robot_parameters(robot) if p.name in self.changes]
        return {p.name: min(max(self.changes[p.name], p.low), p.high) for p in found}

    def parameters(self, robot: Robot, anywhere: Sequence[ModelParameter]) -> tuple[ModelParameter, ...]:
        """Parameters of a robot with the deviations of another drive on the ground.

        Args:
            robot: calibrated.
            anywhere: its parameters with the deviations of another drive wherever it is; on a known ground nothing is
                less certain than that.
        """
        if not self.deviations:
            return tuple(anywhere)
        narrower = {p.name: min(p.prior, self.deviations.get(p.name, p.prior)) for p in anywhere}
        return uncertain_robot(self.robot(robot), narrower)
