"""The learned estimator: velocities, and by some networks the place, of a trained network; the rest of a filter.

Theory: filter, section 11.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.estimation.columns import known_commands, sample_times, stack_columns
from ddagr_gym.estimation.filter_model import FilterModel
from ddagr_gym.estimation.inertial_filter import InertialBatch, InertialFilter, InertialModel
from ddagr_gym.estimation.layout import CHANNELS
from ddagr_gym.estimation.learned_inputs import (
    MEMORY_SIZE,
    Filtered,
    block_inputs,
    mean_rim_speed,
    rest_deviations,
)
from ddagr_gym.estimation.learned_network import VelocityNetwork, load_network, velocity_base
from ddagr_gym.files import shipped_folder
from ddagr_gym.parameters import Robot, Sensors

Array = NDArray[np.float64]

FILE = "network.npz"
"""Of a published estimator, in a folder of its name."""


def estimator_names() -> tuple[str, ...]:
    """Names of the estimators that come with the package."""
    return tuple(sorted(file.parent.name for file in shipped_folder("estimators").glob(f"*/{FILE}")))


_PERIOD_TOLERANCE = 0.02
"""Share of the period by which usual samples may come earlier or later (ours: stamps of loggers)."""


@lru_cache(maxsize=16)
def find_network(name: str) -> VelocityNetwork:
    """Network of a published estimator by name, or of a path that ends in ``.npz``.

    Raises:
        InputError: no such estimator, with the closest names, or a file that is not one.
    """
    if name.endswith(".npz"):
        return load_network(name)
    if name not in estimator_names():
        raise unknown_name("estimator", name, estimator_names())
    return load_network(Path(shipped_folder("estimators")) / name / FILE)


DEFAULT_ESTIMATOR = "correction"
"""That ``filter="learned"`` stands for: robots of an environment need not stand first, and on straight starts
without it this one is nearer than ``pose``, the one of least errors in turns (:mod:`benchmarks.hard_starts`,
:mod:`benchmarks.learned_estimator`)."""


NOISY = 2.0
"""Times the data sheet's noise in the readings at rest before a drive, from which on the network is left out (ours)."""

_LEAST_DEVIATION = 1e-9
"""Of readings at rest that a data sheet may state [m/s^2, rad/s]: ideal sensors have none."""


@dataclass(frozen=True)
class LearnedModel:
    """Model of the learned estimator.

    Attributes:
        inertial: of the filter that runs beside the network and makes soil, gravity and yaw rate.
        network: of velocities and place.
    """

    inertial: InertialModel
    network: VelocityNetwork

    def __post_init__(self) -> None:
        period, own = self.inertial.flat.sample_period, self.network.description.sample_period
        if abs(period - own) > 1e-6 * own:
            raise InputError(
                f"the sensors' period is {period:g} s and the network was trained for {own:g} s: give sensors of that "
                "rate."
            )

    @classmethod
    def of(cls, robot: Robot, sensors: Sensors, estimator: str = DEFAULT_ESTIMATOR) -> LearnedModel:
        """Model of a robot with its instruments, and a published estimator or a file (:func:`find_network`)."""
        return cls(InertialModel.of(robot, sensors).with_known_vibration(), find_network(estimator))

    @property
    def flat(self) -> FilterModel:
        """Robot, sensors and soil, as for the filter that takes the ground for level."""
        return self.inertial.flat

    @property
    def rest_deviations(self) -> Array:
        """(3,) of both axes of the accelerometer [m/s^2] and the gyro [rad/s] at rest, by the data sheet."""
        noise = self.flat.noise
        return np.array([noise.accelerometer, noise.accelerometer, noise.gyro])


class _Corrections:
    """The network of N robots, what it remembers of them and what it says."""

    def __init__(self, model: LearnedModel, count: int) -> None:
        flat = model.inertial.flat
        self.network = model.network
        self.estimates = np.zeros((count, 2))
        self.covariances = np.zeros((count, 2, 2))
        self.places = np.zeros((count, 2))
        self.place_covariances = np.zeros((count, 2, 2))
        self.units = model.network.new_memory(count)
        self.blocks = np.zeros((count, MEMORY_SIZE))
        self._chosen = model.network.chosen
        self._period, self._outer_radius = flat.sample_period, flat.outer_radius
        self._prior = flat.soil_prior.logs(flat.wheel_load)[0]
        self._known = np.maximum(model.rest_deviations, _LEAST_DEVIATION)

    def reset(self, chosen: NDArray[np.intp], covariance: Array) -> None:
        """Forget robots; they are at rest with a covariance (2, 2) of the velocities, and stand where they start."""
        for own in (self.estimates, self.places, self.place_covariances, self.units, self.blocks):
            own[chosen] = 0.0
        self.covariances[chosen] = covariance

    def update(self, commands: Array, readings: Array, filtered: Filtered) -> NDArray[np.intp]:
        """Through one block (:func:`~ddagr_gym.estimation.learned_inputs.block_inputs`); returns :attr:`noisy`."""
        described = self.network.description
        if readings.shape[1] != described.samples:
            raise InputError(
                f"{readings.shape[1]} samples under one command: the network takes {described.samples} at a time."
            )
        inputs = block_inputs(self.blocks, commands, readings, filtered, self._period, self._outer_radius, self._prior)
        outputs = self.network.step(inputs[:, self._chosen], self.units)
        rim = mean_rim_speed(readings, self._outer_radius)
        base = velocity_base(described.base, rim, filtered.states[:, :2])
        self.estimates[:], self.covariances[:] = self.network.estimate(outputs, base)
        self.places[:], self.place_covariances[:] = filtered.poses[:, :2], filtered.pose_covariances[:, :2, :2]
        if described.place:
            self.places[:], self.place_covariances[:] = self.network.place(outputs, filtered.poses[:, :2])
        noisy = self.noisy
        self._leave_out(noisy, filtered)
        return noisy

    @property
    def noisy(self) -> NDArray[np.intp]:
        """Indices of the robots whose sensors scattered far beyond the data sheet at rest."""
        times = rest_deviations(self.blocks) / self._known
        return np.flatnonzero(np.sqrt((times**2).mean(axis=1)) > NOISY)

    def _leave_out(self, chosen: NDArray[np.intp], filtered: Filtered) -> None:
        """Let the inertial filter speak for some robots: with such sensors it is nearer than the network."""
        self.estimates[chosen] = filtered.states[chosen, :2]
        self.covariances[chosen] = filtered.covariances[chosen, :2, :2]
        self.places[chosen] = filtered.poses[chosen, :2]
        self.place_covariances[chosen] = filtered.pose_covariances[chosen, :2, :2]


class LearnedBatch:
    """Learned estimators of N robots that share one model, with the face of :class:`~ddagr_gym.estimation.BatchFilter`.

    A step takes the samples of one block, as many as the network was trained for.

    Args:
        model: what the estimators know.
        count: N.
    """

    REMEMBERED = (
        "works", "counts", "estimates", "velocity_covariances", "places", "place_covariances", "units", "blocks",
    )  # fmt: skip
    """Arrays that it goes on from."""

    def __init__(self, model: LearnedModel, count: int = 1) -> None:
        self.model = model
        self.count = count
        self._inertial = InertialBatch(model.inertial, count)
        self._corrections = _Corrections(model, count)
        self.works, self.counts = self._inertial.works, self._inertial._counts
        own = self._corrections
        self.estimates, self.velocity_covariances = own.estimates, own.covariances
        self.places, self.place_covariances = own.places, own.place_covariances
        self.units, self.blocks = own.units, own.blocks
        self.reset()

    @property
    def states(self) -> Array:
        """(N, 15) of the inertial filter, with the network's v_x and v_y; a copy."""
        found = self._inertial.states
        found[:, :2] = self.estimates
        return found

    @property
    def covariances(self) -> Array:
        """(N, 15, 15) of the inertial filter, with the network's for v_x and v_y; a copy."""
        return with_velocity_block(self._inertial.covariances, self.velocity_covariances)

    @property
    def poses(self) -> Array:
        """(N, 3) x, y [m] and continuous yaw [rad] since the start; a copy."""
        found = self._inertial.poses
        found[:, :2] = self.places
        return found

    def reset(self, chosen: ArrayLike | None = None) -> None:
        """Start from the prior, at rest; ``chosen``: indices of robots, all by default."""
        indices = np.arange(self.count) if chosen is None else np.atleast_1d(np.asarray(chosen))
        self._inertial.reset(indices)
        self._corrections.reset(indices, self.model.inertial.initial()[1][:2, :2])

    def step(self, commands: ArrayLike, readings: ArrayLike) -> Array:
        """Through the samples of one block.

        Args:
            commands: (N, 2) right and left bank speed commands, constant over the samples [rad/s].
            readings: (N, K, 5) in the order of ``CHANNELS``; NaN where a channel has no sample.

        Returns:
            Standardised innovations of the inertial filter (N, K, 5).

        Raises:
            InputError: shapes that do not fit.
        """
        drive = np.ascontiguousarray(commands, dtype=np.float64)
        samples = np.ascontiguousarray(readings, dtype=np.float64)
        innovations = self._inertial.step(drive, samples)
        inertial = self._inertial
        filtered = Filtered(
            inertial.states, inertial.covariances, innovations, inertial.poses, inertial.pose_covariances
        )
        inertial.learn_vibration(self._corrections.update(drive, samples, filtered))
        return innovations


def with_velocity_block(covariances: Array, velocities: Array) -> Array:
    """Covariances (N, 15, 15), changed: with another block of v_x and v_y (N, 2, 2), independent of the rest."""
    covariances[:, :2, :] = covariances[:, :, :2] = 0.0
    covariances[:, :2, :2] = velocities
    return covariances


class LearnedFilter:
    """Learned estimator of one robot.

    Args:
        model: what the estimator knows.
    """

    def __init__(self, model: LearnedModel) -> None:
        self.model = model
        self._inertial = InertialFilter(model.inertial)
        self._corrections = _Corrections(model, 1)
        self.reset()

    @property
    def state(self) -> Array:
        """(15,) of the inertial filter, with the network's v_x and v_y; a copy."""
        found = self._inertial.state.copy()
        found[:2] = self._corrections.estimates[0]
        return found

    @property
    def covariance(self) -> Array:
        """(15, 15) of the inertial filter, with the network's for v_x and v_y; a copy."""
        return with_velocity_block(self._inertial.covariance[None].copy(), self._corrections.covariances)[0]

    @property
    def pose(self) -> Array:
        """(3,) x, y [m] and continuous yaw [rad] since the start; a copy."""
        found = self._inertial.pose.copy()
        found[:2] = self._corrections.places[0]
        return found

    @property
    def place_covariance(self) -> Array:
        """(2, 2) of x and y [m^2]; a copy."""
        return self._corrections.place_covariances[0].copy()

    def reset(self) -> None:
        """Start again from the prior, at rest."""
        self._inertial.reset()
        self._corrections.reset(np.arange(1), self.model.inertial.initial()[1][:2, :2])

    def run(self, commands: Array, readings: Array) -> tuple[Array, Array]:
        """Through the samples of one block.

        Args:
            commands: (1, 2) right and left bank speed commands [rad/s].
            readings: (K, 5) in the order of ``CHANNELS``; NaN where a channel has no sample.

        Returns:
            States after each sample (K, 15), in which the network's velocities lie on a line from block to block, and
            the inertial filter's standardised innovations (K, 5).
        """
        before = self._corrections.estimates[0].copy()
        states, innovations = self._inertial.run(commands, np.ascontiguousarray(readings))
        own = self._inertial
        filtered = Filtered(
            own.state[None], own.covariance[None], innovations[None], own.pose[None], own.pose_covariance[None]
        )
        if self._corrections.update(commands, readings[None], filtered).size:
            own.learn_vibration()
        share = np.arange(1.0, len(readings) + 1.0)[:, None] / len(readings)
        states[:, :2] = before + share * (self._corrections.estimates[0] - before)
        return states, innovations


def run_learned_filter(model: LearnedModel, columns: Mapping[str, ArrayLike]) -> tuple[Array, Array, Array]:
    """Filter a recording at the sensors' rate, whose commands change at every block.

    Returns:
        States after each sample (T, 15), and v_x, v_y after each block (B, 2) with their covariances (B, 2, 2); an
        incomplete last block is left out.

    Raises:
        InputError: columns missing, of different lengths, of another rate than the network's or shorter than a block,
            or commands that are not known throughout.
    """
    one, samples = LearnedFilter(model), model.network.description.samples
    _check_samples(columns, model, samples)
    commands, readings = known_commands(columns, "a learned filter"), stack_columns(columns, CHANNELS, np.nan)
    states, velocities, covariances = [], [], []
    for first in range(0, len(readings) - samples + 1, samples):
        block = slice(first, first + samples)
        states.append(one.run(commands[first : first + 1], readings[block])[0])
        velocities.append(one.state[:2])
        covariances.append(one.covariance[:2, :2])
    return np.concatenate(states), np.array(velocities), np.array(covariances)


def _check_samples(columns: Mapping[str, ArrayLike], model: LearnedModel, samples: int) -> None:
    """Refuse rows that no block of the network holds; InputError."""
    period = model.network.description.sample_period
    t, durations = sample_times(columns, period)
    usual = float(np.median(durations))
    if abs(usual - period) > _PERIOD_TOLERANCE * period:
        raise InputError(
            f"the samples come every {usual:g} s and the network was trained for {period:g} s: import the recording at "
            f"{1.0 / period:g} Hz."
        )
    if t.size < samples:
        raise InputError(
            f"there are {t.size} samples and a block of the network has {samples}: give a longer recording."
        )
