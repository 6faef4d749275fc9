"""Ordinary drives as a comparison sees them: how all of them are weighed, and what effects seem to be in each.

Each drive is fitted and scanned with the robot that was calibrated without it, so that what the calibration adapted to
a drive is no part of what that drive says.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.calibration.calibration_data import CalibrationData
from ddagr_gym.calibration.drive_scatter import DriveEstimates
from ddagr_gym.calibration.independent_steps import IndependentSteps
from ddagr_gym.calibration.joint_fit import FittedModel
from ddagr_gym.calibration.left_out import Forecast
from ddagr_gym.calibration.result import Calibration
from ddagr_gym.calibration.robots_on_grounds import GroundModel, ground_model
from ddagr_gym.calibration.settings import HISTORY
from ddagr_gym.calibration.simulator_values import SOIL_PARAMETERS, fitted_soil
from ddagr_gym.diagnosis.change.drive_fit import change_problem, change_windows, fit_nominal, misfit_of_compared
from ddagr_gym.diagnosis.change.ground_slope import deviations_of, effects_of
from ddagr_gym.diagnosis.change.ordinary import Reference, field_deviations, uncertain_parameters
from ddagr_gym.diagnosis.change.reference import OrdinaryDrive, scan_ordinary
from ddagr_gym.diagnosis.change.robot_on_ground import RobotOnGround, uncertain_robot
from ddagr_gym.diagnosis.change.weighing import UNKNOWN_ACCELEROMETER_BIAS, SensorBias, Weighing
from ddagr_gym.identification.fitted_values import robot_with_values
from ddagr_gym.identification.recording_noise import RecordingNoise
from ddagr_gym.identification.relative_readings import usual_turning
from ddagr_gym.identification.residual_weights import UNKNOWN_GYRO_BIAS, noise_weights
from ddagr_gym.identification.timing_repair import aligned_poses
from ddagr_gym.identification.window_model import RUN_IN
from ddagr_gym.parameters import Robot
from ddagr_gym.tasks import Task

Array = NDArray[np.float64]

MENDED_SIGN = "sign was turned"
"""In a calibration's note on a drive whose gyro was reversed."""


@dataclass(frozen=True, eq=False)
class Ordinary:
    """What a comparison needs of ordinary drives besides the calibration's own files.

    Attributes:
        weighing: of all drives.
        references: one for each drive.
        on_grounds: the robot on each ground; none in files of before.
    """

    weighing: Weighing
    references: tuple[Reference, ...]
    on_grounds: Mapping[str, RobotOnGround] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class _Left:
    """What a first fit leaves of one drive.

    Attributes:
        sigma: (8,) of the channels' residuals.
        robust: (8,) limits of the loss.
        bias: what its sensors read too much.
    """

    sigma: Array
    robust: Array
    bias: SensorBias


def robot_deviations(calibration: Calibration) -> dict[str, float]:
    """By how much the calibrated parameters of the robot may be off in another drive, as the fit moves them."""
    found = {item.name: item for item in calibration.parameters if item.calibrated and not item.ground}
    return {name: item.deviation_elsewhere for name, item in found.items()}


def soil_deviations(calibration: Calibration) -> dict[str, dict[str, float]]:
    """The same of each ground's soil; as within one field where a single drive was on it."""
    found = {ground: field_deviations() for ground in calibration.grounds}
    for item in calibration.parameters:
        base = item.name.partition("/")[0]
        if item.calibrated and item.ground and base in SOIL_PARAMETERS and item.scatter.same_ground is not None:
            found[item.ground][base] = float(np.hypot(item.deviation or 0.0, item.scatter.same_ground))
    return found


def ordinary_drives(
    data: CalibrationData,
    model: FittedModel,
    made: Sequence[Forecast],
    calibration: Calibration,
    estimates: DriveEstimates,
    robot: Robot,
    threads: int,
    steps: IndependentSteps,
) -> Ordinary:
    """Weigh and scan every drive with the robot that was calibrated without it.

    Args:
        data: drives.
        model: joint fit.
        made: forecasts of the left-out drives, with the values of the fit without each.
        estimates: of the robot by each drive.
        calibration: the answer.
        robot: calibrated, with the deviations of another drive.
        threads: of the simulator.
        steps: run the drives.
    """
    deviations = {item.name: item.deviation or 0.0 for item in calibration.parameters}
    together = _Drives(data, model, calibration, estimates, ground_model(estimates, data.grounds, deviations))
    without = [together.without(forecast, robot) for forecast in made]
    noise = [data.prepared.noise[int(forecast.windows.recording[0])] for forecast in made]
    blank = Weighing(
        data.windows.duration, HISTORY, _lateness(data), _gyro_scale(calibration), *_UNKNOWN,
        turning=usual_turning(data.windows), run_in=RUN_IN,
    )  # fmt: skip
    # two rounds of tasks need them
    drives = [steps.runner.share(item) for item in without]
    left = steps.results(
        "what the calibrated robot leaves of each drive",
        [
            Task(item.name, left_of, (drive, blank, own, data.prepared.dead, threads), f"ordinary {number} left")
            for number, (item, drive, own) in enumerate(zip(without, drives, noise, strict=True))
        ],
    )
    weighing = pooled(blank, left)
    tasks = [
        Task(item.name, scan_ordinary, (drive, weighing, threads), f"ordinary {number}")
        for number, (item, drive) in enumerate(zip(without, drives, strict=True))
    ]
    references = tuple(steps.results("every effect of the library in each drive", tasks))
    on_grounds = {ground: together.on(drives, model.values) for ground, drives in data.drives_on.items()}
    return Ordinary(weighing, references, on_grounds)


_UNKNOWN = (np.ones(8), np.ones(8), UNKNOWN_GYRO_BIAS, UNKNOWN_ACCELEROMETER_BIAS)


@dataclass(frozen=True, eq=False)
class _Drives:
    """What the drives together say of robot and grounds.

    Attributes:
        data: the drives.
        model: joint fit.
        calibration: the answer.
        estimates: of the robot by each drive.
        by_ground: how that differs between grounds.
    """

    data: CalibrationData
    model: FittedModel
    calibration: Calibration
    estimates: DriveEstimates
    by_ground: GroundModel

    def without(self, forecast: Forecast, robot: Robot) -> OrdinaryDrive:
        """The left-out drive of a forecast and the robot that was fitted to the others.

        Args:
            forecast: of the drive.
            robot: calibrated, with the deviations of another drive.
        """
        number = int(forecast.windows.recording[0])
        data, ground = self.data, self.data.grounds[number]
        values = forecast.values_of(self.model)
        own = replace(robot_with_values(self.model.model.robot, values), standard_deviations=robot.standard_deviations)
        recordings = data.prepared.recordings
        maps = {recording.meta.column_map for k, recording in enumerate(recordings) if k != number}
        beside = [drive for drive in data.drives_on[ground] if drive != number]
        return OrdinaryDrive(
            name=data.names[number],
            ground=ground,
            alone=not beside,
            # the drive's own lateness was taken out of its poses
            recording=aligned_poses(recordings[number], -data.prepared.noise[number].pose_lateness),
            robot=own,
            soil=fitted_soil(data, ground, values),
            parameters=uncertain_robot(own, robot_deviations(self.calibration)),
            deviations=soil_deviations(self.calibration)[ground],
            reversed_gyro=any(MENDED_SIGN in note for note in data.notes[number]),
            slope=data.slopes.get(ground),
            on_ground=self.on(beside, values) if beside else RobotOnGround(),
            logger=0.0 if recordings[number].meta.column_map in maps else recordings[number].period,
            holds=data.holds[number],
        )

    def on(self, drives: Sequence[int], values: Mapping[str, float]) -> RobotOnGround:
        """The robot on the ground of some drives, as changes from values of a fit."""
        joint = self.model.values
        centre = {name: values[name] - joint[name] for name in self.by_ground.names}
        return self.by_ground.on([self.estimates.drives[drive] for drive in drives], centre)


def _lateness(data: CalibrationData) -> float:
    """Mean of the drives in which it is known."""
    known = [item.pose_lateness for item in data.prepared.noise if item.pose_lateness > 0.0]
    return float(np.mean(known)) if known else 0.0


def _gyro_scale(calibration: Calibration) -> float:
    found = [item.value for item in calibration.parameters if item.name == "gyro_scale" and item.calibrated]
    return 1.0 if not found or found[0] is None else found[0]


def left_of(item: OrdinaryDrive, blank: Weighing, noise: RecordingNoise, dead: Sequence[str], threads: int) -> _Left:
    """Weights and biases by a first fit with those of the sensors' noise; workers call it by name."""
    robot = item.robot_there
    windows = change_windows([item.recording], robot, blank)
    weights = noise_weights([noise], windows, imposed=False, dead=dead, unfitted=())
    parameters = uncertain_parameters(
        item.soil, item.parameters_there, item.deviations, blank, 1, deviations_of(item.slope)
    )
    first = replace(blank, sigma=weights.sigma, robust=weights.robust)
    problem = change_problem(robot, item.soil, windows, parameters, first, threads, effects_of(item.slope))
    rough = misfit_of_compared(problem.blocked, problem.predict(problem.start()), weights)
    second = replace(blank, sigma=rough.sigma, robust=rough.robust)
    problem = change_problem(robot, item.soil, windows, parameters, second, threads, effects_of(item.slope))
    fitted = fit_nominal(problem)
    left = misfit_of_compared(problem.blocked, fitted.prediction, weights)
    return _Left(left.sigma[0, 0], left.robust, SensorBias(item.name, item.ground, fitted.point.values[-3:]))


def pooled(blank: Weighing, left: Sequence[_Left]) -> Weighing:
    """Weights of all drives, what sensors read too much in all of them, and how much that differs between them.

    Args:
        blank: how drives are cut.
        left: of each drive.
    """
    biases = np.array([item.bias.value for item in left])
    scatter = biases.std(axis=0, ddof=1) if len(left) > 1 else np.abs(biases[0])
    offsets = biases.mean(axis=0) if len(left) > 1 else np.zeros(3)
    sigma, robust = np.stack([item.sigma for item in left]), np.min([item.robust for item in left], axis=0)
    return replace(blank.of_fits(sigma, robust, scatter, offsets), biases=tuple(item.bias for item in left))
