"""The filters on the turns of the bound: as they can be chosen, and told parts of the truth."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.filter_study.estimators import KNOWN_DEVIATION
from ddagr_gym.envs.settings import Episode
from ddagr_gym.estimation import (
    FilterModel,
    ForceLaw,
    InertialModel,
    SoilPrior,
    ThesisModel,
    run_filter,
    run_inertial_filter,
    run_thesis_filter,
)
from ddagr_gym.estimation.dead_reckoning import integrate_track
from ddagr_gym.evaluation.force_law_fits import drive_law_fit
from ddagr_gym.parameters import Sensors
from ddagr_gym.presets import ddagr

Array = NDArray[np.float64]
Columns = Mapping[str, Array]
Estimate = Callable[[Columns, Episode], Array]
"""(columns, episode) -> v_x, v_y, yaw rate (T, 3); the episode is for filters that are told of it."""

_CALIBRATED = 1e-4  # deviation of a bias that is told [m/s^2, rad/s]
_LEVEL = 1e-3  # deviation of gravity along ground that is told to be level [m/s^2]


def _thesis(columns: Columns, episode: Episode) -> Array:
    return run_thesis_filter(ThesisModel(ddagr(), sample_period=Sensors().period), columns).states[:, :3]


def _flat(columns: Columns, episode: Episode) -> Array:
    return run_filter(FilterModel.of(ddagr(), Sensors()), columns).states[:, :3]


def _flat_thesis_law(columns: Columns, episode: Episode) -> Array:
    return run_filter(FilterModel.of(ddagr(), Sensors(), law=ForceLaw.thesis), columns).states[:, :3]


def _inertial(columns: Columns, episode: Episode) -> Array:
    return run_inertial_filter(InertialModel.of(ddagr(), Sensors()), columns)[0][:, :3]


FILTERS: dict[str, tuple[str, Estimate]] = {
    "thesis": ("thesis's filter", _thesis),
    "flat_thesis_law": ("filter, thesis's force law", _flat_thesis_law),
    "flat": ("filter, ground level", _flat),
    "inertial": ("inertial filter", _inertial),
}
"""By name: title and estimate."""


def _told(columns: Columns, episode: Episode, parts: tuple[str, ...]) -> Array:
    """The inertial filter, told parts of the truth."""
    robot = episode.robot if "robot" in parts else ddagr()
    model = InertialModel.of(robot, Sensors())
    flat, knowledge, read = model.flat, model.knowledge, columns
    if "biases" in parts:
        read = _without_biases(columns, episode.sensors)
        flat = replace(flat, gyro_bias_deviation=_CALIBRATED, accelerometer_bias_deviation=_CALIBRATED)
    if "level" in parts:
        knowledge = replace(knowledge, gravity_deviation=_LEVEL, gravity_walk=0.0)
    if "soil" in parts:
        flat = replace(flat, prior=_best_law(flat, columns), noise=replace(flat.noise, soil=0.0))
    return run_inertial_filter(InertialModel(flat, knowledge), read)[0][:, :3]


def _without_biases(columns: Columns, sensors: Sensors) -> dict[str, Array]:
    imu = sensors.imu
    biases = dict(zip(("specific_force_x", "specific_force_y"), imu.accelerometer_bias, strict=True))
    biases["yaw_rate"] = imu.gyro_bias
    return dict(columns) | {name: columns[name] - bias for name, bias in biases.items()}


def _best_law(flat: FilterModel, columns: Columns) -> SoilPrior:
    """The force law that fits the drive's true wheel forces best, as a prior."""
    limit, rate, stiffness, resistance = np.exp(drive_law_fit(flat.robot, columns, ForceLaw.coupled).logs)
    return SoilPrior(
        limit / flat.wheel_load, rate, stiffness / (limit * rate), resistance / limit, *[KNOWN_DEVIATION] * 4
    )


TOLD = {
    "biases": ("biases",),
    "robot": ("robot",),
    "level": ("level",),
    "soil": ("soil",),
    "all": ("biases", "robot", "level", "soil"),
}
"""What the inertial filter is told, by the name of the arm."""

ESTIMATORS: dict[str, tuple[str, Estimate]] = FILTERS | {
    f"inertial_told_{name}": (
        f"inertial filter, told {'all of these' if name == 'all' else name}",
        lambda columns, episode, parts=parts: _told(columns, episode, parts),
    )
    for name, parts in TOLD.items()
}
"""FILTERS, and the inertial one told parts of the truth."""


def estimated_motion(name: str, columns: Columns, episode: Episode) -> Array:
    """v_x, v_y, yaw rate and, integrated from the known start, x, y, yaw (T, 6) by one of ESTIMATORS."""
    return placed_motion(ESTIMATORS[name][1](columns, episode), episode)


def placed_motion(velocities: Array, episode: Episode) -> Array:
    """v_x, v_y, yaw rate (T, 3) and, integrated from the known start of an episode, x, y, yaw: (T, 6)."""
    x, y, yaw = integrate_track(*velocities.T, Sensors().period).T
    start = -episode.turn.run_in, episode.lateral_offset, episode.heading_offset
    cosine, sine = np.cos(start[2]), np.sin(start[2])
    pose = [start[0] + cosine * x - sine * y, start[1] + sine * x + cosine * y, start[2] + yaw]
    return np.column_stack([velocities, *pose])
