"""Drives from before as what later ones are compared with: one robot and one soil are fitted to all of them.

As the ordinary drives of a calibration, but with the parameters that the data sheet calls uncertain alone, and without
leaving drives out: what the robot has wrong is the same in drives from before and after, and falls out of their
difference.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.change.drive_fit import change_problem, change_windows, fit_nominal, misfit_of_compared
from ddagr_gym.diagnosis.change.ground_slope import SLOPE_OF_FIELDS, GroundSlope
from ddagr_gym.diagnosis.change.measured_scatter import measured_scatter
from ddagr_gym.diagnosis.change.ordinary import OrdinaryRobot, Reference, uncertain_parameters
from ddagr_gym.diagnosis.change.reference import OrdinaryDrive, scan_pieces
from ddagr_gym.diagnosis.change.weighing import UNKNOWN_ACCELEROMETER_BIAS, Weighing
from ddagr_gym.diagnosis.preprocessing.input_requirements import content_hash
from ddagr_gym.diagnosis.preprocessing.mended_recordings import MendedRecordings
from ddagr_gym.diagnosis.setting import HISTORY
from ddagr_gym.identification.fitted_values import with_values
from ddagr_gym.identification.gauss_newton import Fitted, linearised
from ddagr_gym.identification.parameters import ModelParameter, robot_parameters
from ddagr_gym.identification.problem import Problem
from ddagr_gym.identification.recording_noise import recording_noise
from ddagr_gym.identification.relative_readings import usual_turning
from ddagr_gym.identification.residual_weights import UNKNOWN_GYRO_BIAS, Weights, noise_weights
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.recordings.pose_frames import in_one_frame

Array = NDArray[np.float64]

GROUND = "same"
"""Name of the ground of drives from before, for drives that are on it too."""

WINDOW = 4.0
"""Length of the windows [s] (ours): a turn, and twelve of them in a drive of 50 s."""

PIECES = 4
"""Most parts of a single drive from before whose scatter counts (ours)."""

DAY = {"motor_rate": 0.03, "maximum_wheel_speed": 0.03}
"""Deviations of the logarithms of a robot's parameters from one day to another (ours: a battery's charge, temperature);
the others are the same, and what changes in them is an effect."""

SAME_GROUND = {"soil_strength": 0.05, "soil_stiffness": 0.1, "shear_modulus": 0.1, "exit_angle_ratio": 0.03}
"""Deviations of a ground's parameters from one drive on it to another: those of one window against its field in
:class:`~ddagr_gym.identification.nuisances.NuisancePriors`, and of a surveyed one's shear."""

SLOPES = ("slope_x", "slope_y")
"""Parameters of the ground's gradient."""


@dataclass(frozen=True, eq=False)
class JointFit:
    """Robot and soil of all drives from before.

    Attributes:
        robot: with fitted parameters.
        soil: the same.
        weighing: of the drives.
        deviations: with which they tell every parameter, by name.
        gradient: of the ground along the world's axes [-]; None where the poses do not tell it.
    """

    robot: Robot
    soil: Soil
    weighing: Weighing
    deviations: Mapping[str, float]
    gradient: tuple[float, float] | None = None

    @property
    def slope(self) -> GroundSlope | None:
        """Slope of the ground; None where the poses do not tell it."""
        if self.gradient is None:
            return None
        return GroundSlope.estimated(self.gradient, [self.deviations[name] for name in SLOPES])

    @property
    def same_ground(self) -> dict[str, float]:
        """Deviations of the soil of a drive on the same ground from the fitted one, by parameter."""
        return {name: float(np.hypot(own, self.deviations[name])) for name, own in SAME_GROUND.items()}


def robot_of_before(
    mended: MendedRecordings,
    robot: Robot,
    soil: Soil,
    *,
    window: float = WINDOW,
    seed: int = 0,
    threads: int = 1,
    progress: Callable[[str], None] = lambda line: None,
) -> OrdinaryRobot:
    """The robot as drives from before show it, with what each of them says of every effect.

    Args:
        mended: drives from before, of one robot on one ground.
        robot: nominal.
        soil: nominal.
        window: length of the windows [s].
        seed: of everything random.
        threads: of the simulator.
        progress: called with what is being done.

    Raises:
        InputError: too few windows.
    """
    progress("fitting robot and soil to the drives from before")
    joint = joint_fit(mended, robot, soil, window, np.random.default_rng(seed), threads)
    parameters = day_parameters(joint.robot)
    count = len(mended.recordings)
    most = PIECES if count == 1 else 1
    scanned: list[list[Reference]] = []
    for recording in mended.recordings:
        progress(f"every effect of the library in {recording.meta.source}")
        drive = OrdinaryDrive(
            recording.meta.source, GROUND, False, recording, joint.robot, joint.soil, parameters, joint.same_ground,
            mended.reversed_gyro is not None, joint.slope, holds=mended.holds,
        )  # fmt: skip
        scanned.append(scan_pieces(drive, joint.weighing, most, threads))
    scatter = measured_scatter()
    return OrdinaryRobot(
        joint.robot,
        {GROUND: joint.soil},
        parameters,
        {GROUND: joint.same_ground},
        joint.weighing,
        tuple(as_left_out(found[0], count) for found in scanned),
        digest=hashlib.sha256("".join(content_hash(item) for item in mended.given).encode()).hexdigest(),
        pieces=tuple(piece for found in scanned for piece in found[1:]),
        known_scatter=scatter.same_ground,
        other_scatter=scatter.other_ground,
        given=True,
        slopes={} if joint.slope is None else {GROUND: joint.slope},
    )


def as_left_out(reference: Reference, drives: int) -> Reference:
    """A drive whose parameters moved as far as from a fit to the other drives alone: the common fit has its share.

    Args:
        reference: the drive beside the common fit.
        drives: number of them in that fit.
    """
    share = drives / max(drives - 1.0, 1.0)
    return replace(reference, moved={name: share * moved for name, moved in reference.moved.items()})


def day_parameters(robot: Robot) -> tuple[ModelParameter, ...]:
    """Parameters of a robot that differ from one day to another, with what that makes of them as priors."""
    return tuple(replace(p, prior=min(p.prior, DAY[p.name])) for p in robot_parameters(robot) if p.name in DAY)


def joint_fit(
    mended: MendedRecordings, robot: Robot, soil: Soil, window: float, rng: np.random.Generator, threads: int
) -> JointFit:
    """One robot and one soil fitted to drives, by what the nominal ones leave and then by what that fit leaves.

    Args:
        mended: drives.
        robot: nominal.
        soil: nominal.
        window: length of the windows [s].
        rng: of the interval of the poses' lateness.
        threads: of the simulator.
    """
    noise = [recording_noise(recording, rng) for recording in mended.recordings]
    late = [item.pose_lateness for item in noise if item.pose_lateness > 0.0]
    lateness = float(np.mean(late)) if late else 0.0
    blank = Weighing(
        window, HISTORY, lateness, 1.0, np.ones(8), np.ones(8), UNKNOWN_GYRO_BIAS, UNKNOWN_ACCELEROMETER_BIAS
    )
    windows = change_windows(mended.recordings, robot, blank)
    blank = replace(blank, turning=usual_turning(windows))
    slopes = 2 * (SLOPE_OF_FIELDS,) if in_one_frame(mended.recordings) else ()
    parameters = uncertain_parameters(soil, robot_parameters(robot), None, blank, len(noise), slopes)
    of_noise = noise_weights(noise, windows, imposed=False, dead=(), unfitted=())

    def problem_of(weights: Weights) -> Problem:
        weighing = replace(blank, sigma=weights.sigma, robust=weights.robust)
        return change_problem(robot, soil, windows, parameters, weighing, threads)

    first = problem_of(of_noise)
    begun = fit_nominal(problem_of(misfit_of_compared(first.blocked, first.predict(first.start()), of_noise)))
    # a nominal model that is far off leaves so much that it weighs nothing
    problem = problem_of(misfit_of_compared(first.blocked, begun.prediction, of_noise))
    fitted = fit_nominal(problem, begun.point)
    values = {p.name: float(value) for p, value in zip(parameters, fitted.point.values, strict=True)}
    left = misfit_of_compared(problem.blocked, fitted.prediction, of_noise)
    biases = _biases(fitted, len(noise))
    scatter = biases.std(axis=0, ddof=1) if len(biases) > 1 else np.zeros(3)
    sigma = left.sigma.reshape(-1, len(CHANNELS))
    weighing = blank.of_fits(sigma, left.robust, scatter, biases.mean(axis=0))
    gradient = (values[SLOPES[0]], values[SLOPES[1]]) if slopes else None
    return JointFit(*with_values(robot, soil, values), weighing, _deviations(problem, fitted), gradient)


def _deviations(problem: Problem, fitted: Fitted) -> dict[str, float]:
    """Deviations of the free parameters, by name: the larger ones of the information and of the windows' scatter."""
    names = [p.name for p, free in zip(problem.nuisances.parameters, problem.free, strict=True) if free]
    found = np.maximum(*linearised(problem, fitted).deviations())
    return dict(zip(names, found.tolist(), strict=True))


def _biases(fitted: Fitted, recordings: int) -> Array:
    """(R, 3) of gyro and accelerometers, which are the last parameters."""
    return fitted.point.values[-3 * recordings :].reshape(recordings, 3)
