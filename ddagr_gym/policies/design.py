"""Inputs of a policy and meaning of its outputs: all that training and driving share, but the weights."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from ddagr_gym.control.observation import EKF_FEATURES, OBSERVATION, PATH_FEATURES
from ddagr_gym.control.tracker_settings import TrackerSettings
from ddagr_gym.errors import InputError
from ddagr_gym.validated import Validated, bounded

TASK_INPUTS = ("turning", "leaving", "heading_to_go", "run_in_to_go", "target_radius", "target_speed")
SENSOR_INPUTS = ("specific_force_x", "specific_force_y", "yaw_rate", "encoder_outer", "encoder_inner")
MEMORY_INPUTS = ("last_command_outer", "last_command_inner", "correction_0", "correction_1", "response_time")
SOIL_INPUTS = (
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
)
"""What any filter estimates of the soil, and the slips: of the arms with one."""

FILTER_INPUTS = (
    "estimated_speed",
    "estimated_yaw_rate",
    *SOIL_INPUTS,
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

PATH_INPUTS = (
    "estimated_speed",
    "estimated_side_speed",
    "estimated_yaw_rate",
    *SOIL_INPUTS,
    "gravity_x",
    "gravity_y",
    "path_cross_track_error",
    "path_course_error",
    "path_to_go",
    "path_curvature",
    "tracker_curvature",
)
"""Inputs of the arm with the path: what the inertial filter estimates of motion, soil and ground, the errors of its
pose on the commanded path, and the curvature that the path tracker asks for."""

Features = Literal["raw", "ekf", "path"]
FEATURES: tuple[Features, ...] = ("raw", "ekf", "path")


@dataclass(frozen=True)
class PolicyDesign(Validated):
    """How a policy is wired to the robot.

    All inputs are dimensionless (by R* and the reference speed) and mirrored, so that every turn is one to the left.

    Attributes:
        features: "raw" sees the sensors and the task, "ekf" the filter's features besides, "path" those of the inertial
            filter with its pose on the commanded path.
        action: "correction": outputs are a correction of curvature and one of speed on the feed-forward; "absolute":
            outputs are the bank speeds, outer and inner. The feed-forward is the force balance: with features "ekf" at
            the filter's estimate, for a curvature that follows a dead-reckoned reference; with "raw" at the filter's
            prior, for the commanded curvature. With "path" it is the path tracker, feed-forward and feedback.
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
        tracker: of "path", gains of the path tracker.
    """

    features: Features = "ekf"
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
    tracker: TrackerSettings | None = None

    def _check(self) -> None:
        for name, value, most in (("frames", self.frames, 64), ("frame_interval", self.frame_interval, 100)):
            if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= most:
                raise InputError(f"PolicyDesign.{name} is {value!r}: give a whole number from 1 to {most}.")
        for field, choice, allowed in (
            ("features", self.features, FEATURES),
            ("action", self.action, ("correction", "absolute")),
        ):
            if choice not in allowed:
                raise InputError(f"PolicyDesign.{field} is {choice!r}: give {' or '.join(map(repr, allowed))}.")

        if (self.features == "path") != (self.tracker is not None):
            raise InputError(
                f"PolicyDesign.tracker is {self.tracker!r}: give gains with features 'path', and only then."
            )

    @property
    def needs_filter(self) -> bool:
        """Whether the environment must append a filter's features."""
        return self.features != "raw"

    @property
    def environment(self) -> dict[str, Any]:
        """What the environment must be given for these features."""
        if self.features == "path":
            return {"ekf_features": True, "filter": "inertial", "path_features": True}
        return {"ekf_features": self.needs_filter}

    @property
    def observation_size(self) -> int:
        """Entries of the environment's observation."""
        appended = {"raw": 0, "ekf": len(EKF_FEATURES), "path": len(EKF_FEATURES) + len(PATH_FEATURES)}
        return len(OBSERVATION) + appended[self.features]

    @property
    def frame_inputs(self) -> tuple[str, ...]:
        """Names of the inputs of one instant."""
        appended: dict[Features, tuple[str, ...]] = {"raw": (), "ekf": FILTER_INPUTS, "path": PATH_INPUTS}
        return (*SENSOR_INPUTS, *MEMORY_INPUTS, *TASK_INPUTS, *appended[self.features])

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of all inputs, the present instant first."""
        past = [f"{name}@{-k * self.frame_interval}" for k in range(1, self.frames) for name in self.frame_inputs]
        return (*self.frame_inputs, *past)
