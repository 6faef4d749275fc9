"""What a calibration says of ordinary drives: the robot, how far its parameters vary, and what effects seem to be."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.nuisances import NuisancePriors
from ddagr_gym.identification.parameters import (
    KIND_STIFFNESS_DEVIATION,
    ModelParameter,
    sensor_parameters,
    soil_parameters,
)
from ddagr_gym.parameters import Robot, Soil

Array = NDArray[np.float64]

LEAST_GYRO_BIAS = 2e-4
"""Least prior [rad/s] (ours): the bias of a gyro wanders by so much in a drive."""

LEAST_ACCELEROMETER_BIAS = 0.02
"""Least prior [m/s^2] (ours): a tenth of a degree of slope under a drive."""


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
    """

    window: float
    history: float
    lateness: float
    gyro_scale: float
    sigma: Array
    robust: Array
    gyro_bias: float
    accelerometer_bias: float


@dataclass(frozen=True, eq=False)
class Scores:
    """What a drive says about the size of every probe beside all that may differ between ordinary drives.

    Attributes:
        keys: (K,) of the probes.
        gradient: (K,) of the cost by their multiples, downhill.
        information: (K, K).
        within: (K, K) covariance of the gradient by the scatter of the windows.
        between: (K, K) covariance of the gradient by what the priors expect between drives.
        gradients: (W, K) of each window; None where only sums were kept.
        informations: (W, K, K) the same.
    """

    keys: tuple[str, ...]
    gradient: Array
    information: Array
    within: Array
    between: Array
    gradients: Array | None = None
    informations: Array | None = None


@dataclass(frozen=True, eq=False)
class Reference:
    """An ordinary drive, scanned with the robot that was calibrated without it.

    Attributes:
        drive: name of its file.
        ground: that it was on.
        reversed_gyro: whether its gyro turned the wrong way, which was mended.
        known_ground: with the soil of its ground; that of an unknown one where no other drive was on it.
        other_ground: with a soil of which only the kind is known.
    """

    drive: str
    ground: str
    reversed_gyro: bool
    known_ground: Scores
    other_ground: Scores


@dataclass(frozen=True, eq=False)
class OrdinaryRobot:
    """A calibrated robot and what its ordinary drives are like.

    Attributes:
        robot: calibrated.
        soils: calibrated, by ground.
        parameters: of the robot that were calibrated, with the deviations that another drive may have as priors.
        soil_deviations: of each ground, by parameter, that another drive on it may have.
        weighing: of the drives.
        references: ordinary drives.
        source: name of the calibration.
        digest: of what it says of ordinary drives.
    """

    robot: Robot
    soils: Mapping[str, Soil]
    parameters: tuple[ModelParameter, ...]
    soil_deviations: Mapping[str, Mapping[str, float]]
    weighing: Weighing
    references: tuple[Reference, ...]
    source: str = ""
    digest: str = ""

    def uncertain(self, ground: str, recordings: int) -> tuple[ModelParameter, ...]:
        """All that may differ between ordinary drives, for drives on one ground ("" for an unknown one)."""
        soil = next(iter(self.soils.values())) if not ground else self.soils[ground]
        return uncertain_parameters(
            soil, self.parameters, self.soil_deviations.get(ground) if ground else None, self.weighing, recordings
        )

    def scores(self, ground: str) -> tuple[Scores, ...]:
        """Of the ordinary drives, with a ground that is known or ("") not."""
        return tuple(item.known_ground if ground else item.other_ground for item in self.references)


def uncertain_parameters(
    soil: Soil,
    robot: tuple[ModelParameter, ...],
    deviations: Mapping[str, float] | None,
    weighing: Weighing,
    recordings: int,
) -> tuple[ModelParameter, ...]:
    """Soil, robot and biases as a fit moves them.

    Args:
        soil: of the ground.
        robot: calibrated parameters.
        deviations: of the soil's parameters; None for a ground of which only the kind is known.
        weighing: of the drives.
        recordings: how many.
    """
    kind = soil_parameters(soil, KIND_STIFFNESS_DEVIATION)
    made = kind if deviations is None else tuple(replace(p, prior=deviations[p.name]) for p in kind)
    return (*made, *robot, *sensor_parameters(recordings, weighing.gyro_bias, weighing.accelerometer_bias))


def field_deviations() -> dict[str, float]:
    """By how much a soil differs within one field, by parameter: for a ground with a single ordinary drive."""
    priors = NuisancePriors()
    return {
        "soil_strength": priors.strength,
        "soil_stiffness": priors.stiffness,
        "shear_modulus": priors.shear_modulus,
        "exit_angle_ratio": priors.exit_angle,
    }
