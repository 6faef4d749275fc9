"""What a controller sees of a row turn: the layout and the scaling of the observation."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

OBSERVATION = (
    ("specific_force_x", "m/s^2", 1.0),
    ("specific_force_y", "m/s^2", 1.0),
    ("yaw_rate", "rad/s", 0.5),
    ("encoder_right", "rad/s", 2.0),
    ("encoder_left", "rad/s", 2.0),
    ("last_action_right", "-", 1.0),
    ("last_action_left", "-", 1.0),
    ("side", "-", 1.0),
    ("target_radius", "m", 1.0),
    ("target_speed", "m/s", 0.25),
    ("heading_to_go", "rad", math.pi),
    ("run_in_to_go", "m", 1.0),
)
"""Entries: name, unit, and the value that is observed as 1."""

SCALES = np.array([entry[2] for entry in OBSERVATION])

EKF_FEATURES = (
    ("estimated_v_x", "m/s", 0.25),
    ("estimated_yaw_rate", "rad/s", 0.5),
    ("log_traction_limit", "-", 1.0),
    ("log_traction_rate", "-", 1.0),
    ("log_lateral_stiffness", "-", 1.0),
    ("log_motion_resistance", "-", 1.0),
    ("estimated_slip_right", "-", 1.0),
    ("estimated_slip_left", "-", 1.0),
    ("deviation_log_traction_limit", "-", 1.0),
    ("deviation_log_traction_rate", "-", 1.0),
    ("deviation_log_lateral_stiffness", "-", 1.0),
    ("deviation_log_motion_resistance", "-", 1.0),
)
"""Entries that the filter's features append, in the same form. The logs are those of a1, a2, b, Rc over their prior
medians; their standard deviations say how much has been observed."""

FEATURE_SCALES = np.array([entry[2] for entry in EKF_FEATURES])


PATH_FEATURES = (
    ("estimated_x", "m", 1.0),
    ("estimated_y", "m", 1.0),
    ("estimated_yaw", "rad", math.pi),
    ("estimated_v_y", "m/s", 0.25),
    ("gravity_x", "m/s^2", 1.0),
    ("gravity_y", "m/s^2", 1.0),
    ("cross_track_error", "m", 0.1),
    ("course_error", "rad", 0.5),
    ("path_to_go", "m", 1.0),
    ("path_curvature", "1/m", 1.0),
)
"""Entries that the inertial filter's pose appends behind :data:`EKF_FEATURES`, in the same form: pose in the frame of
the rows, velocity to the left, pull of gravity along the body's axes, and by
:func:`~ddagr_gym.control.path_tracker.path_errors` the distance to the left of the commanded path, the direction of
motion against the path's, the way to the next row's start line and the path's curvature there."""

PATH_SCALES = np.array([entry[2] for entry in PATH_FEATURES])

PLACES = {name: place for place, (name, _, _) in enumerate((*OBSERVATION, *EKF_FEATURES, *PATH_FEATURES))}
"""Places of all entries in an observation that has them, by name."""


class TurnObservation(NamedTuple):
    """An observation in its units; see :data:`OBSERVATION`."""

    specific_force_x: float
    specific_force_y: float
    yaw_rate: float
    encoder_right: float
    encoder_left: float
    last_action_right: float
    last_action_left: float
    side: float
    target_radius: float
    target_speed: float
    heading_to_go: float
    run_in_to_go: float


class TurnColumns(NamedTuple):
    """Observations of N turns in their units, (N,) an entry; see :data:`OBSERVATION`."""

    specific_force_x: Array
    specific_force_y: Array
    yaw_rate: Array
    encoder_right: Array
    encoder_left: Array
    last_action_right: Array
    last_action_left: Array
    side: Array
    target_radius: Array
    target_speed: Array
    heading_to_go: Array
    run_in_to_go: Array


class FilterColumns(NamedTuple):
    """What filters of N turns append, in its units, (N,) an entry; see :data:`EKF_FEATURES`."""

    estimated_v_x: Array
    estimated_yaw_rate: Array
    log_traction_limit: Array
    log_traction_rate: Array
    log_lateral_stiffness: Array
    log_motion_resistance: Array
    estimated_slip_right: Array
    estimated_slip_left: Array
    deviation_log_traction_limit: Array
    deviation_log_traction_rate: Array
    deviation_log_lateral_stiffness: Array
    deviation_log_motion_resistance: Array

    @property
    def log_soil(self) -> tuple[Array, Array, Array, Array]:
        """Logs of a1, a2, b, Rc over their prior medians."""
        return self.log_traction_limit, self.log_traction_rate, self.log_lateral_stiffness, self.log_motion_resistance

    @property
    def deviations(self) -> tuple[Array, Array, Array, Array]:
        """Standard deviations of :attr:`log_soil`."""
        return (
            self.deviation_log_traction_limit,
            self.deviation_log_traction_rate,
            self.deviation_log_lateral_stiffness,
            self.deviation_log_motion_resistance,
        )


class PathColumns(NamedTuple):
    """What poses of N turns append, in its units, (N,) an entry; see :data:`PATH_FEATURES`."""

    estimated_x: Array
    estimated_y: Array
    estimated_yaw: Array
    estimated_v_y: Array
    gravity_x: Array
    gravity_y: Array
    cross_track_error: Array
    course_error: Array
    path_to_go: Array
    path_curvature: Array


def decode(observation: ArrayLike) -> TurnObservation:
    """Observation (entries,) of the environment in SI units; entries beyond the basic ones are ignored."""
    values = np.asarray(observation, dtype=float)[: len(SCALES)] * SCALES
    return TurnObservation(*values.tolist())
