"""An ordinary drive as others are compared with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.change.drive_fit import change_problem, change_windows, fit_nominal, moved_parameters
from ddagr_gym.diagnosis.change.drive_scan import DriveScan, Priors, scan_drive
from ddagr_gym.diagnosis.change.ground_slope import GroundSlope, deviations_of, effects_of
from ddagr_gym.diagnosis.change.left_out import left_out_losses
from ddagr_gym.diagnosis.change.ordinary import Reference, of_another_logger, uncertain_parameters
from ddagr_gym.diagnosis.change.robot_on_ground import RobotOnGround
from ddagr_gym.diagnosis.change.weighing import Weighing
from ddagr_gym.identification.misfit import channel_misfit, channel_scatter
from ddagr_gym.identification.parameters import ModelParameter
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.recordings.schema import Recording

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class OrdinaryDrive:
    """An ordinary drive and the robot that was calibrated without it.

    Attributes:
        name: of its file.
        ground: that it was on.
        alone: whether no other ordinary drive was on that ground.
        recording: mended, poses where they came.
        robot: calibrated without the drive.
        soil: of its ground, without the drive.
        parameters: of the robot that may differ between drives, wherever they are.
        deviations: of the soil on its ground, by parameter.
        reversed_gyro: whether its gyro turned the wrong way, which was mended.
        slope: of its ground; None where that is not known.
        on_ground: the robot on its ground, without the drive; nothing where no other drive was on it.
        logger: period of the rows [s] where no other drive was read with its column map; else 0.
        holds: by sensor, time for which it repeats its readings [s].
    """

    name: str
    ground: str
    alone: bool
    recording: Recording
    robot: Robot
    soil: Soil
    parameters: tuple[ModelParameter, ...]
    deviations: Mapping[str, float]
    reversed_gyro: bool = False
    slope: GroundSlope | None = None
    on_ground: RobotOnGround = field(default_factory=RobotOnGround)
    logger: float = 0.0
    holds: Mapping[str, float] = field(default_factory=dict)

    @property
    def robot_there(self) -> Robot:
        """The robot on the drive's ground."""
        return self.on_ground.robot(self.robot)

    @property
    def parameters_there(self) -> tuple[ModelParameter, ...]:
        """Of the robot on the drive's ground, with what may differ between drives on it."""
        return of_another_logger(self.on_ground.parameters(self.robot, self.parameters), self.logger)

    @property
    def parameters_anywhere(self) -> tuple[ModelParameter, ...]:
        """Of the robot, with what may differ between drives wherever they are."""
        return of_another_logger(self.parameters, self.logger)


def scan_ordinary(drive: OrdinaryDrive, weighing: Weighing, threads: int = 1) -> Reference:
    """What an ordinary drive says of every effect, with its ground known and not.

    Args:
        drive: with its robot.
        weighing: of all ordinary drives.
        threads: of the simulator.
    """
    return scan_pieces(drive, weighing, 1, threads)[0]


def scan_pieces(drive: OrdinaryDrive, weighing: Weighing, most: int, threads: int = 1) -> list[Reference]:
    """The same, and after it that of parts of the drive, at most so many; none where it is too short for two.

    Args:
        drive: with its robot.
        weighing: of all ordinary drives.
        most: parts.
        threads: of the simulator.
    """
    known = weighing if drive.alone else weighing.on(drive.ground, drive.name)
    robot = drive.robot_there
    windows = change_windows([drive.recording], robot, known)
    deviations = None if drive.alone else drive.deviations
    slopes = deviations_of(drive.slope)
    parameters = uncertain_parameters(drive.soil, drive.parameters_there, deviations, known, 1, slopes)
    problem = change_problem(robot, drive.soil, windows, parameters, known, threads, effects_of(drive.slope))
    fitted = fit_nominal(problem)
    scan = scan_drive(problem, fitted)
    anywhere = GroundSlope.of_any_field().deviations if drive.slope else ()
    wide = uncertain_parameters(drive.soil, drive.parameters_anywhere, None, weighing, 1, anywhere)
    other = _of_unknown_ground(scan, wide, known.offsets - weighing.offsets, drive)
    whole = replace(
        _reference(drive, scan, other, left_out_losses(problem, fitted)),
        moved=moved_parameters(problem, fitted),
        misfit=channel_misfit(problem, fitted),
        misfit_error=channel_scatter(problem, fitted),
    )
    pieces = scan.pieces(most)
    return [whole, *(_reference(drive, piece, other, np.zeros(0)) for piece in pieces if len(pieces) > 1)]


def _of_unknown_ground(scan: DriveScan, wide: Sequence[ModelParameter], leaning: Array, drive: OrdinaryDrive) -> Priors:
    """Deviations of what may differ where the ground is not known, and the middle of robot, biases and slope there."""
    place = {p.name: k for k, p in enumerate(wide)}
    middle = np.zeros(len(wide))
    middle[-len(leaning) :] = -leaning
    for name, change in drive.on_ground.changes_of(drive.robot).items():
        if name in place:
            middle[place[name]] = -change
    if drive.slope is not None:
        middle[place["slope_x"]], middle[place["slope_y"]] = np.negative(drive.slope.gradient)
    return Priors(np.array([wide[k].prior for k in scan.free]), middle[scan.free])


def _reference(drive: OrdinaryDrive, scan: DriveScan, other: Priors, losses: Array) -> Reference:
    return Reference(
        drive.name,
        drive.ground,
        drive.reversed_gyro,
        scan.scores(),
        scan.scores(other),
        losses,
        drive.robot,
        drive.soil,
        on_ground=drive.on_ground,
        column_map=drive.recording.meta.column_map,
        period=drive.recording.period,
        holds=drive.holds,
    )
