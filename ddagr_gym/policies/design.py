"""Inputs of a policy and meaning of its outputs: all that training and driving share, but the weights."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ddagr_gym.control.observation import EKF_FEATURES, OBSERVATION
from ddagr_gym.errors import InputError
from ddagr_gym.validated import Validated, bounded

TASK_INPUTS = ("turning", "leaving", "heading_to_go", "run_in_to_go", "target_radius", "target_speed")
SENSOR_INPUTS = ("specific_force_x", "specific_force_y", "yaw_rate", "encoder_outer", "encoder_inner")
MEMORY_INPUTS = ("last_command_outer", "last_command_inner", "correction_0", "correction_1", "response_time")
FILTER_INPUTS = (
    "estimated_speed",
    "estimated_yaw_rate",
    "log_traction_limit",
    "log_traction_rate",
    "log_lateral_stiffness",
    "log_motion_resistance",
    "estimated_slip_outer",
    "estimated_slip_inner",
    "deviation_log_traction_limit",
    "deviation_log_traction_rate",
    "deviation_log_lateral_stiffness",
    "deviation_log_motion_resistance",
    "curvature_error",
    "curvature_error_integral",
    "cross_track_error",
    "heading_error",
    "estimated_heading_to_go",
    "estimated_distance_to_go",
    "sideslip",
    "sideslip_deviation",
    "course_cross_track_error",
    "course_error",
    "reference_cross_track_error",
    "reference_course_error",
    "reference_to_go",
)
"""Inputs of the arm with the filter: its features, and dead reckoning with them, without and with sideslip, against the
commanded path and against the reference of :mod:`ddagr_gym.policies.reckoning`."""


@dataclass(frozen=True)
class PolicyDesign(Validated):
    """How a policy is wired to the robot.

    All inputs are dimensionless (by R* and the reference speed) and mirrored, so that every turn is one to the left.

    Attributes:
        features: "raw" sees the sensors and the task, "ekf" the filter's features besides.
        action: "correction": outputs are a correction of curvature and one of speed on the feed-forward; "absolute":
            outputs are the bank speeds, outer and inner. The feed-forward is the force balance: with features "ekf" at
            the filter's estimate, for a curvature that follows a dead-reckoned reference; with "raw" at the filter's
            prior, for the commanded curvature.
        frames: how many past instants of the inputs are seen, the present one included.
        frame_interval: control steps between them.
        curvature_scale: correction of curvature at output 1, over 1/R* [-].
        speed_scale: correction of speed at output 1, over the reference speed [-].
        rate_limit: largest change of an output per control step [-].
        lead_time: how long before the start and the end of the turn the feed-forward bends and straightens, beyond the
            response time of the motors that commands and encoders of the run-in tell [s].
        heading_gain: of "raw", curvature of the feed-forward per heading error on straights [1/(m rad)].
        offset_gain: of "ekf", curvature over 1/R* per distance over R* from the reference [-].
        course_gain: of "ekf", curvature over 1/R* per course error [1/rad].
    """

    features: Literal["raw", "ekf"] = "ekf"
    action: Literal["correction", "absolute"] = "correction"
    frames: int = 1
    frame_interval: int = 4
    curvature_scale: float = bounded("-", 0.0, 5.0, default=0.5, open_low=True)
    speed_scale: float = bounded("-", 0.0, 0.9, default=0.25)
    rate_limit: float = bounded("-", 0.0, 2.0, default=0.25, open_low=True)
    lead_time: float = bounded("s", 0.0, 2.0, default=0.15)
    heading_gain: float = bounded("1/(m rad)", 0.0, 50.0, default=1.0)
    offset_gain: float = bounded("-", 0.0, 100.0, default=1.0)
    course_gain: float = bounded("1/rad", 0.0, 100.0, default=4.0)

    def _check(self) -> None:
        for name, value, most in (("frames", self.frames, 64), ("frame_interval", self.frame_interval, 100)):
            if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= most:
                raise InputError(f"PolicyDesign.{name} is {value!r}: give a whole number from 1 to {most}.")
        for field, choice, allowed in (
            ("features", self.features, ("raw", "ekf")),
            ("action", self.action, ("correction", "absolute")),
        ):
            if choice not in allowed:
                raise InputError(f"PolicyDesign.{field} is {choice!r}: give {' or '.join(map(repr, allowed))}.")

    @property
    def needs_filter(self) -> bool:
        """Whether the environment must append the filter's features."""
        return self.features == "ekf"

    @property
    def observation_size(self) -> int:
        """Entries of the environment's observation."""
        return len(OBSERVATION) + (len(EKF_FEATURES) if self.needs_filter else 0)

    @property
    def frame_inputs(self) -> tuple[str, ...]:
        """Names of the inputs of one instant."""
        names = (*SENSOR_INPUTS, *MEMORY_INPUTS, *TASK_INPUTS)
        return (*names, *FILTER_INPUTS) if self.needs_filter else names

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of all inputs, the present instant first."""
        past = [f"{name}@{-k * self.frame_interval}" for k in range(1, self.frames) for name in self.frame_inputs]
        return (*self.frame_inputs, *past)
