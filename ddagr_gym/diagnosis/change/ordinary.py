"""What a calibration says of ordinary drives: the robot, how far its parameters vary, and what effects seem to be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.change.expected_scatter import EXPECTED_DRIVES, ExpectedScatter
from ddagr_gym.diagnosis.change.ground_slope import GroundSlope, deviations_of, effects_of
from ddagr_gym.diagnosis.change.robot_on_ground import RobotOnGround, uncertain_robot
from ddagr_gym.diagnosis.change.weighing import Weighing
from ddagr_gym.errors import InputError
from ddagr_gym.identification.nuisances import NuisancePriors
from ddagr_gym.identification.parameters import (
    KIND_STIFFNESS_DEVIATION,
    ModelParameter,
    sensor_parameters,
    slope_parameters,
    soil_parameters,
)
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.registry import effect_kinds
from ddagr_gym.recordings.pose_frames import frames_apart, in_one_frame
from ddagr_gym.recordings.schema import Recording

Array = NDArray[np.float64]

NEWER = "the calibration is older than this effect: calibrate again"
APART = "it needs ordinary drives whose poses are in one frame, and theirs begin anew from stretch to stretch"

OF_ANOTHER_GROUND = "on another ground it is another one in any case"
SOIL_EFFECTS = ("soil_change", "soil_split", "slip_sinkage", "multipass", "lateral_bulldozing")
"""Effects that say how a ground gives way, and that no drive on an unknown one can tell from that ground."""


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
class Comparison:
    """What drives are compared with.

    Attributes:
        drives: scores of ordinary drives.
        pieces: scores of parts of the only one, where there is one.
        expected: scatter between drives before any data.
        unnamed: effects that cannot be what changed, with the reason.
        moved: by how many of its prior deviations the fit to each ordinary drive moved every parameter.
        misfits: mean square of what fits leave of the channels of each drive from before on the same ground; else none.
        misfit_errors: relative standard errors of these by the windows of the drive.
    """

    drives: tuple[Scores, ...]
    pieces: tuple[Scores, ...] = ()
    expected: ExpectedScatter = field(default_factory=ExpectedScatter)
    unnamed: Mapping[str, str] = field(default_factory=dict)
    moved: tuple[Mapping[str, float], ...] = ()
    misfits: tuple[Mapping[str, float], ...] = ()
    misfit_errors: tuple[Mapping[str, float], ...] = ()

    @property
    def move_degrees(self) -> float:
        """Of freedom of the parameters' moves."""
        known = self.expected.degrees if self.expected.moves else EXPECTED_DRIVES
        return known + len(self.drives) - 1.0

    def usual_move(self, parameter: str) -> float:
        """Prior deviations by which ordinary drives move a parameter (r.m.s., drawn to the expected), at least 1.

        What is expected has the weight of few drives: those of this robot say more of it than simulated ones.
        """
        known = [item[parameter] for item in self.moved if parameter in item]
        square = EXPECTED_DRIVES * self.expected.move(parameter) ** 2 + sum(value**2 for value in known)
        return max(1.0, float(np.sqrt(square / (EXPECTED_DRIVES + len(known)))))


@dataclass(frozen=True, eq=False)
class Reference:
    """An ordinary drive, scanned with the robot that was calibrated without it.

    Attributes:
        drive: name of its file.
        ground: that it was on.
        reversed_gyro: whether its gyro turned the wrong way, which was mended.
        known_ground: with the soil of its ground; that of an unknown one where no other drive was on it.
        other_ground: with a soil of which only the kind is known.
        losses: (W,) of windows as forecast by fits without them, by the known ground; none in files of before.
        robot: that was calibrated without the drive; None in files of before.
        soil: of its ground as calibrated without it, likewise.
        on_ground: the robot on its ground without the drive; nothing where no other drive was on it.
        moved: by how many of its prior deviations the fit moved every parameter; none in files of before.
        column_map: by which it was read; "" where that is not known.
        misfit: mean square of what the fit leaves of each channel; none in files of calibrations.
        misfit_error: relative standard error of that by the windows.
        period: between its rows [s]; 0 in files of before.
        holds: by sensor, time for which it repeats its readings [s]; None in files of before.
    """

    drive: str
    ground: str
    reversed_gyro: bool
    known_ground: Scores
    other_ground: Scores
    losses: Array = field(default_factory=lambda: np.zeros(0))
    robot: Robot | None = None
    soil: Soil | None = None
    moved: Mapping[str, float] = field(default_factory=dict)
    column_map: str = ""
    misfit: Mapping[str, float] = field(default_factory=dict)
    misfit_error: Mapping[str, float] = field(default_factory=dict)
    on_ground: RobotOnGround = field(default_factory=RobotOnGround)
    period: float = 0.0
    holds: Mapping[str, float] | None = None


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
        pieces: parts of the only drive, where there is one.
        known_scatter: expected between drives on the same ground.
        other_scatter: expected between drives on two grounds.
        given: whether the drives were given as those from before, without a calibration.
        slopes: of grounds that are known to slope, or whose drives tell how far they do.
        slope: of the ground of drives that are asked about (:meth:`seen_by`); None where nothing is said of it.
        on_grounds: the robot on each ground, as the drives on it tell.
    """

    robot: Robot
    soils: Mapping[str, Soil]
    parameters: tuple[ModelParameter, ...]
    soil_deviations: Mapping[str, Mapping[str, float]]
    weighing: Weighing
    references: tuple[Reference, ...]
    source: str = ""
    digest: str = ""
    pieces: tuple[Reference, ...] = ()
    known_scatter: ExpectedScatter = field(default_factory=ExpectedScatter)
    other_scatter: ExpectedScatter = field(default_factory=ExpectedScatter)
    given: bool = False
    slopes: Mapping[str, GroundSlope] = field(default_factory=dict)
    slope: GroundSlope | None = None
    on_grounds: Mapping[str, RobotOnGround] = field(default_factory=dict)

    def robot_on(self, ground: str) -> Robot:
        """The robot on a ground ("" for an unknown one)."""
        return self._on(ground).robot(self.robot)

    def _on(self, ground: str) -> RobotOnGround:
        return self.on_grounds.get(ground, RobotOnGround())

    @property
    def known(self) -> tuple[Effect, ...]:
        """What drives that are asked about share with ordinary ones and the robot has not."""
        return effects_of(self.slope)

    def uncertain(self, ground: str, recordings: Sequence[Recording]) -> tuple[ModelParameter, ...]:
        """All that may differ between ordinary drives, for drives on one ground ("" for an unknown one)."""
        soil = next(iter(self.soils.values())) if not ground else self.soils[ground]
        known = {item.column_map for item in self.references}
        other = any(recording.meta.column_map not in known for recording in recordings)
        parameters = self._on(ground).parameters(self.robot, self.parameters)
        return uncertain_parameters(
            soil,
            of_another_logger(parameters, recordings[0].period) if other else parameters,
            self.soil_deviations.get(ground) if ground else None,
            self.weighing.on(ground),
            len(recordings),
            deviations_of(self.slope),
        )

    def seen_by(self, recordings: Sequence[Recording], ground: str) -> OrdinaryRobot:
        """The same for drives on a ground, which may not know where they head.

        Where some grounds slope, an unknown one may as well. In a drive without headings the ground slopes as steeply
        as it is known to, in a direction that is not; of several of them, or of stretches in frames of their own,
        nothing is said of it.

        Args:
            recordings: that are asked about.
            ground: of them; "" where it is not known.
        """
        unknown = GroundSlope.of_any_field() if self.slopes else None
        slope = self.slopes.get(ground) if ground else unknown
        if slope is not None and not in_one_frame(recordings):
            alone = len(recordings) == 1 and not frames_apart(recordings[0])
            slope = slope.turned if alone else None
        return replace(self, slope=slope)

    def comparison(self, ground: str) -> Comparison:
        """What drives on a ground that is known or ("") not are compared with."""
        moved, new = tuple(item.moved for item in self.references), self._unscanned
        if ground:
            drives, pieces = ([item.known_ground for item in found] for found in (self.references, self.pieces))
            # of calibrations' drives, on several grounds, it is not known how far channels differ between grounds
            known = [item for item in self.references if item.misfit] if self.given else []
            misfits, errors = tuple(item.misfit for item in known), tuple(item.misfit_error for item in known)
            return Comparison(tuple(drives), tuple(pieces), self.known_scatter, new, moved, misfits, errors)
        drives, pieces = ([item.other_ground for item in found] for found in (self.references, self.pieces))
        unnamed = {**dict.fromkeys(SOIL_EFFECTS, OF_ANOTHER_GROUND), **new}
        return Comparison(tuple(drives), tuple(pieces), self.other_scatter, unnamed, moved)

    @property
    def usual_holds(self) -> dict[str, float] | None:
        """Longest time for which ordinary drives repeat readings, by sensor [s]; None in files of before."""
        known = [item.holds for item in self.references if item.holds is not None]
        if len(known) < len(self.references):
            return None
        sensors = dict.fromkeys(name for holds in known for name in holds)
        return {name: max(holds.get(name, 0.0) for holds in known) for name in sensors}

    @property
    def _unscanned(self) -> dict[str, str]:
        """Effects for which no ordinary drive was scanned, and why."""
        scanned = {key.rpartition(" ")[0] for item in self.references for key in item.known_ground.keys}
        absent = {name: kind for name, kind in effect_kinds().items() if name not in scanned}
        return {name: APART if kind.needs_one_frame else NEWER for name, kind in absent.items()}

    def without(self, drive: str) -> OrdinaryRobot:
        """The same from the other drives alone: robot and soil as calibrated without one, whose scan is left out.

        Weights, priors of robot and soil and the scans of the others stay as they are with all drives.

        Args:
            drive: name of an ordinary drive.

        Raises:
            InputError: no such drive, a single one, or a calibration of before, which did not keep the robots.
        """
        own = next((item for item in self.references if item.drive == drive), None)
        if own is None:
            known = ", ".join(item.drive for item in self.references)
            raise InputError(f"{drive} is not among the ordinary drives: {known}.")
        others = tuple(item for item in self.references if item is not own)
        if own.robot is None or own.soil is None or not others:
            raise InputError(f"{self.source} cannot do without {drive}: calibrate again with two drives or more.")
        beside = sum(item.ground == own.ground for item in others)
        soils = {ground: soil for ground, soil in self.soils.items() if ground != own.ground}
        deviations = dict(self.soil_deviations)
        if beside == 1:
            deviations[own.ground] = field_deviations()
        return replace(
            self,
            robot=own.robot,
            soils={**soils, own.ground: own.soil} if beside else soils,
            slopes={ground: slope for ground, slope in self.slopes.items() if beside or ground != own.ground},
            parameters=uncertain_robot(own.robot, {p.name: p.prior for p in self.parameters}),
            soil_deviations=deviations,
            weighing=self.weighing.without(drive),
            references=others,
            on_grounds={own.ground: own.on_ground} if beside else {},
        )

    @property
    def losses(self) -> Array:
        """(W,) of the ordinary drives' windows as forecast by fits without them."""
        return np.concatenate([item.losses for item in self.references])


def uncertain_parameters(
    soil: Soil,
    robot: tuple[ModelParameter, ...],
    deviations: Mapping[str, float] | None,
    weighing: Weighing,
    recordings: int,
    slopes: Sequence[float] = (),
) -> tuple[ModelParameter, ...]:
    """Soil, slope of the ground, robot and biases as a fit moves them.

    Args:
        soil: of the ground.
        robot: calibrated parameters.
        deviations: of the soil's parameters; None for a ground of which only the kind is known.
        weighing: of the drives.
        recordings: how many.
        slopes: deviations of the ground's gradient along the world's axes; none where it stays as it is.
    """
    kind = soil_parameters(soil, KIND_STIFFNESS_DEVIATION)
    made = kind if deviations is None else tuple(replace(p, prior=deviations[p.name]) for p in kind)
    ground = (*made, *(slope_parameters(slopes) if slopes else ()))
    return (*ground, *robot, *sensor_parameters(recordings, weighing.gyro_bias, weighing.accelerometer_bias))


def of_another_logger(robot: Sequence[ModelParameter], period: float) -> tuple[ModelParameter, ...]:
    """Parameters of a robot with the delay of its commands as uncertain as what a row's command means.

    Loggers differ in that by a sample or two: a command is that of the row's time, or the one since the row before.

    Args:
        robot: parameters that may differ between drives.
        period: of the rows [s].
    """
    return tuple(replace(p, prior=float(np.hypot(p.prior, period))) if p.name == "command_delay" else p for p in robot)


def field_deviations() -> dict[str, float]:
    """By how much a soil differs within one field, by parameter: for a ground with a single ordinary drive."""
    priors = NuisancePriors()
    return {
        "soil_strength": priors.strength,
        "soil_stiffness": priors.stiffness,
        "shear_modulus": priors.shear_modulus,
        "exit_angle_ratio": priors.exit_angle,
    }
