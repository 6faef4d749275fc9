"""How drives are cut and weighed, and what their sensors read too much."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.change.expected_scatter import EXPECTED_DRIVES
from ddagr_gym.identification.residual_weights import LEAST_GYRO_BIAS

Array = NDArray[np.float64]

LEAST_ACCELEROMETER_BIAS = 0.02
"""Least prior [m/s^2] (ours): a tenth of a degree of slope under a drive."""

UNKNOWN_ACCELEROMETER_BIAS = 1.0
"""Prior before any drive was fitted [m/s^2] (ours): an IMU that is tilted by 6 degrees."""

SLOPE_ON_A_GROUND = 0.05
"""Deviation [m/s^2] of what accelerometers read too much between drives on one ground (ours): 0.3 degrees of slope."""


@dataclass(frozen=True, eq=False)
class SensorBias:
    """What sensors read too much in an ordinary drive.

    Attributes:
        drive: name of its file.
        ground: that it was on.
        value: (3,) of gyro [rad/s] and accelerometers forward and to the left [m/s^2].
    """

    drive: str
    ground: str
    value: Array


@dataclass(frozen=True, eq=False)
class Weighing:
    """How drives are cut and weighed, the same for ordinary drives and for those that are asked about.

    Attributes:
        window: length of the windows [s].
        history: commands kept from before a window [s].
        lateness: of the poses in ordinary drives [s], which are moved back by so much.
        gyro_scale: calibrated scale of the gyro [-].
        sigma: (8,) standard deviations of the channels' samples; infinite for those that no drive has.
        robust: (8,) weighted residuals from which the loss is linear.
        gyro_bias: between ordinary drives [rad/s].
        accelerometer_bias: the same, slopes included [m/s^2].
        offsets: (3,) what gyro [rad/s] and accelerometers [m/s^2] read too much in ordinary drives, which is taken off.
        biases: the same of each ordinary drive; none where that is not known.
        turning: usual yaw rate per difference of the wheel speeds, by which readings are compared relative to each
            other (:mod:`ddagr_gym.identification.relative_readings`); None where they are compared one by one.
        run_in: kept of what was driven right before a window [s].
    """

    window: float
    history: float
    lateness: float
    gyro_scale: float
    sigma: Array
    robust: Array
    gyro_bias: float
    accelerometer_bias: float
    offsets: Array = field(default_factory=lambda: np.zeros(3))
    turning: float | None = None
    biases: tuple[SensorBias, ...] = ()
    run_in: float = 0.0

    def on(self, ground: str, drive: str = "") -> Weighing:
        """The same for a drive on a known ground, where accelerometers lean as in the other drives on it.

        A robot that climbs out of the ruts that it makes leans back by degrees on sand and not on asphalt.

        Args:
            ground: of the drive; "" where it is not known.
            drive: its name, if it is one of the ordinary ones.
        """
        here = [item.value for item in self.biases if ground and item.ground == ground and item.drive != drive]
        if not here:
            return self
        offsets = np.array([self.offsets[0], *np.mean(here, axis=0)[1:]])
        scatter = self._accelerometers_on_one_ground * float(np.sqrt(1.0 + 1.0 / len(here)))
        return replace(self, offsets=offsets, accelerometer_bias=max(LEAST_ACCELEROMETER_BIAS, scatter))

    def of_fits(self, sigma: Array, robust: Array, scatter: Array, offsets: Array) -> Weighing:
        """The same drives, weighed by what fits leave of them.

        Args:
            sigma: (K, 8) standard deviations of the channels' samples in windows or drives; infinite where there are
                none.
            robust: (8,) weighted residuals from which the loss is linear.
            scatter: (3,) of what sensors read too much, between drives.
            offsets: (3,) what they read too much in all of them.
        """
        known = np.isfinite(sigma)
        square = np.where(known, sigma, 0.0) ** 2
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = np.where(known.any(axis=0), np.sqrt(square.sum(axis=0) / known.sum(axis=0)), np.inf)
        return replace(
            self,
            sigma=mean,
            robust=robust,
            gyro_bias=max(LEAST_GYRO_BIAS, float(scatter[0])),
            accelerometer_bias=max(LEAST_ACCELEROMETER_BIAS, float(np.sqrt(np.mean(scatter[1:] ** 2)))),
            offsets=offsets,
        )

    def without(self, drive: str) -> Weighing:
        """The same without what one of the drives says of biases."""
        return replace(self, biases=tuple(item for item in self.biases if item.drive != drive))

    @property
    def _accelerometers_on_one_ground(self) -> float:
        """Deviation of the accelerometers' biases between drives on one ground, drawn towards what is expected."""
        grounds = dict.fromkeys(item.ground for item in self.biases)
        groups = [np.array([item.value[1:] for item in self.biases if item.ground == ground]) for ground in grounds]
        square = sum(float(((group - group.mean(axis=0)) ** 2).sum()) for group in groups)
        degrees = sum(2.0 * (len(group) - 1) for group in groups)
        return float(np.sqrt((EXPECTED_DRIVES * SLOPE_ON_A_GROUND**2 + square) / (EXPECTED_DRIVES + degrees)))
