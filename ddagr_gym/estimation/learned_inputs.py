"""What the learned estimator sees: means of the samples of a block, what was read at rest, and the inertial filter.

A block is the samples that share one command. Every function works on N robots; a robot's numbers do not depend on the
others.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.estimation.inertial_layout import GRAVITY, PATCH_AHEAD
from ddagr_gym.estimation.layout import CHANNEL_SIZE, ENCODER_CHANNEL, PARAMETER, PARAMETER_SIZE

Array = NDArray[np.float64]

HALVES = 2
"""Means of a block: at 125 Hz and ten samples the network sees the sensors at 25 Hz."""

SENSOR_INPUTS = (
    *(f"{name}_{half}" for half in ("first", "second") for name in
      ("specific_force_x", "specific_force_y", "yaw_rate", "rim_right", "rim_left")),
    "command_right", "command_left", "heading_cosine", "heading_sine", "centripetal",
    "rest_specific_force_x", "rest_specific_force_y", "rest_yaw_rate", "rest_share",
)  # fmt: skip
"""From sensors and commands alone: means of the first and the second half of a block [m/s^2, rad/s, m/s], commanded
rim speeds [m/s], the heading by the gyro as cosine and sine, yaw rate times mean rim speed [m/s^2], the means of all
samples at rest before the drive [m/s^2, rad/s], and the number of these over 125."""

FILTER_INPUTS = (
    "filter_v_x", "filter_v_y", "filter_yaw_rate",
    *(f"filter_log_{name}" for name in ("limit", "rate", "stiffness", "resistance")),
    "filter_gyro_bias", "filter_bias_x", "filter_bias_y", "filter_gravity_x", "filter_gravity_y", "filter_patch_ahead",
    *(f"filter_deviation_{name}" for name in
      ("v_x", "v_y", "limit", "rate", "stiffness", "resistance", "gravity_x", "gravity_y")),
    *(f"innovation_{name}" for name in ("force_x", "force_y", "yaw_rate", "right", "left")),
)  # fmt: skip
"""From the inertial filter: its state, logs of standard deviations, and mean standardised innovations of a block."""

POSE_INPUTS = ("pose_x", "pose_y", "pose_turned", "pose_deviation_x", "pose_deviation_y", "pose_deviation_turned")
"""The pose that the inertial filter carries, from where it started [m, m, rad], and logs of its standard deviations."""

INPUTS = SENSOR_INPUTS + FILTER_INPUTS + POSE_INPUTS
"""All of them, in the order of :func:`block_inputs`."""

REST_SAMPLES = 125.0
"""Samples at rest that count as one in ``rest_share`` (ours)."""

FEWEST_AT_REST = 25
"""Samples at rest from which their scatter is known to a seventh (ours)."""

_STATES = np.array([*range(3), *range(PARAMETER, PATCH_AHEAD + 1)])
_DEVIATIONS = np.array([0, 1, *range(PARAMETER, PARAMETER + PARAMETER_SIZE), GRAVITY, GRAVITY + 1])
_LARGEST_INNOVATION = 10.0  # (ours) an outlier beyond counts as this many standard deviations
_LEAST_VARIANCE = 1e-12
_REST = 1e-9  # [rad/s] commands and counted speeds below are none

# Memory of a robot between blocks
_HEADING, _SUM, _COUNT, _MOVED, _SQUARES = 0, slice(1, 4), 4, 5, slice(6, 9)
MEMORY_SIZE = 9
"""Heading by the gyro [rad], sums of three channels at rest, samples in them, whether it has moved, sums of squares."""


class Filtered(NamedTuple):
    """What the inertial filters of N robots say after a block of K samples.

    Attributes:
        states: (N, 15).
        covariances: (N, 15, 15).
        innovations: standardised (N, K, 5); NaN: no sample.
        poses: (N, 3) x, y [m], yaw [rad] from where they started.
        pose_covariances: (N, 3, 3).
    """

    states: Array
    covariances: Array
    innovations: Array
    poses: Array
    pose_covariances: Array


def block_inputs(
    memory: Array, commands: Array, readings: Array, filtered: Filtered, period: float, outer_radius: float,
    prior: Array,
) -> Array:  # fmt: skip
    """Inputs (N, len(INPUTS)) after a block, whose samples enter the memory.

    Args:
        memory: (N, MEMORY_SIZE), zero before the first block; changed.
        commands: (N, 2) right and left bank speed commands [rad/s].
        readings: (N, K, 5) samples in the order of ``CHANNELS``, K even; NaN: no sample.
        filtered: by the inertial filters.
        period: between samples [s].
        outer_radius: of the wheels [m].
        prior: logs of the soil's parameters (4,) before driving.
    """
    halves = _means(readings.reshape(len(readings), HALVES, -1, CHANNEL_SIZE))
    whole = halves.mean(axis=1)
    _rest(memory, commands, readings)
    memory[:, _HEADING] += period * readings.shape[1] * whole[:, 2]
    halves[..., ENCODER_CHANNEL:] *= outer_radius
    rim = mean_rim_speed(readings, outer_radius)
    count = memory[:, _COUNT : _COUNT + 1]
    heading = memory[:, _HEADING]
    logs = filtered.states[:, _STATES]
    logs[:, 3 : 3 + PARAMETER_SIZE] -= prior
    return np.concatenate(
        [
            halves.reshape(len(halves), -1),
            outer_radius * commands,
            np.column_stack([np.cos(heading), np.sin(heading), whole[:, 2] * rim]),
            memory[:, _SUM] / np.maximum(count, 1.0),
            count / REST_SAMPLES,
            logs,
            _log_deviations(filtered.covariances)[:, _DEVIATIONS],
            np.clip(_means(filtered.innovations), -_LARGEST_INNOVATION, _LARGEST_INNOVATION),
            filtered.poses,
            _log_deviations(filtered.pose_covariances),
        ],
        axis=1,
    )


def _log_deviations(covariances: Array) -> Array:
    """Logs of standard deviations (N, S) from covariances (N, S, S)."""
    variances = np.diagonal(covariances, axis1=1, axis2=2)
    return np.asarray(0.5 * np.log(np.maximum(variances, _LEAST_VARIANCE)))


def mean_rim_speed(readings: Array, outer_radius: float) -> Array:
    """Of both banks over a block (N,) [m/s], from readings (N, K, 5)."""
    return np.asarray(outer_radius * _means(readings[..., ENCODER_CHANNEL:]).mean(axis=1))


def _means(samples: Array) -> Array:
    """Means over the last axis but one of what is not missing; 0 where all is."""
    known = np.isfinite(samples)
    return np.asarray(np.where(known, samples, 0.0).sum(axis=-2) / np.maximum(known.sum(axis=-2), 1))


def _rest(memory: Array, commands: Array, readings: Array) -> None:
    """Add a block at rest to the sums; the first command, or count of a wheel, ends the rest before the drive."""
    moving = (np.abs(commands) > _REST).any(axis=1)
    moving |= (np.abs(np.nan_to_num(readings[..., ENCODER_CHANNEL:])) > _REST).any(axis=(1, 2))
    memory[:, _MOVED] = np.maximum(memory[:, _MOVED], moving)
    at_rest = (memory[:, _MOVED] == 0.0)[:, None] & np.isfinite(readings[..., :3]).all(axis=2)
    resting = np.where(at_rest[..., None], readings[..., :3], 0.0)
    memory[:, _SUM] += resting.sum(axis=1)
    memory[:, _SQUARES] += (resting**2).sum(axis=1)
    memory[:, _COUNT] += at_rest.sum(axis=1)


def rest_deviations(memory: Array) -> Array:
    """Standard deviations (N, 3) of both axes of the accelerometer [m/s^2] and the gyro [rad/s] at rest before a drive.

    Args:
        memory: (N, MEMORY_SIZE) of :func:`block_inputs`.

    Returns:
        NaN where a robot did not rest long enough.
    """
    count = memory[:, _COUNT : _COUNT + 1]
    squares = memory[:, _SQUARES] - memory[:, _SUM] ** 2 / np.maximum(count, 1.0)
    deviations = np.sqrt(np.maximum(squares, 0.0) / np.maximum(count - 1.0, 1.0))
    return np.where(count >= FEWEST_AT_REST, deviations, np.nan)
