"""Drives cut into windows and fitted by the calibrated robot, all that may differ between ordinary drives left free."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.change.weighing import Weighing
from ddagr_gym.errors import InputError
from ddagr_gym.identification.block_means import BlockedWindows, sample_windows
from ddagr_gym.identification.data_split import evenly
from ddagr_gym.identification.fit_numerics import FIELD_TOLERANCE, field_numerics
from ddagr_gym.identification.gauss_newton import Fitted, fit
from ddagr_gym.identification.nuisances import Nuisances
from ddagr_gym.identification.parameters import ModelParameter
from ddagr_gym.identification.problem import Point, Problem
from ddagr_gym.identification.relative_readings import relative_windows
from ddagr_gym.identification.residual_weights import Weights, weights_by_residuals
from ddagr_gym.identification.timing_repair import aligned_poses, bridged
from ddagr_gym.identification.windows import WindowSet, cut_windows, with_presumed_past
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.physics.effects import Effect
from ddagr_gym.recordings.schema import Recording

Array = NDArray[np.float64]

MOST_WINDOWS = 40
"""Windows of a drive that are compared, evenly chosen (ours): 4 min of it, whose scan takes about a minute."""

FEWEST_WINDOWS = 8
"""Windows below which their scatter has no meaning: that of a calibration."""

ITERATIONS = 6
"""Most Gauss-Newton steps of a fit (ours): ordinary drives start near their end."""

OFFSET_CHANNELS = ("yaw_rate", "specific_force_x", "specific_force_y")
"""Whose biases belong to a drive."""


def change_windows(recordings: Sequence[Recording], robot: Robot, weighing: Weighing) -> WindowSet:
    """Windows of drives, poses and gyro as ordinary drives have them.

    Args:
        recordings: mended, of one robot and period.
        robot: calibrated.
        weighing: of its ordinary drives.

    Raises:
        InputError: too few windows of the calibration's length.
    """
    even = [_as_ordinary(aligned_poses(bridged(r), weighing.lateness), weighing) for r in recordings]
    windows = cut_windows(
        even, weighing.window, wheel_radius=robot.outer_radius, half_track=robot.half_track, history=weighing.history,
        run_in=weighing.run_in,
    )  # fmt: skip
    if windows.count < FEWEST_WINDOWS:
        names = ", ".join(recording.meta.source for recording in recordings)
        raise InputError(
            f"{names}: {windows.count} windows of {weighing.window:.3g} s without a gap and with commands are too few "
            f"to compare with ordinary drives: give {FEWEST_WINDOWS * weighing.window:.0f} s at least."
        )
    rows = [np.flatnonzero(windows.recording == number) for number in range(len(recordings))]
    chosen = np.concatenate([found[evenly(found.size, MOST_WINDOWS)] for found in rows if found.size])
    return with_presumed_past(windows.subset(chosen))


def _as_ordinary(recording: Recording, weighing: Weighing) -> Recording:
    """The drive with the readings of a gyro of sensitivity 1, and without what sensors always read too much."""
    scales = dict.fromkeys(OFFSET_CHANNELS, 1.0) | {"yaw_rate": weighing.gyro_scale}
    changed = {
        name: (recording[name] - offset) / scales[name]
        for name, offset in zip(OFFSET_CHANNELS, weighing.offsets.tolist(), strict=True)
        if recording.has(name) and (offset, scales[name]) != (0.0, 1.0)
    }
    return replace(recording, channels={**recording.channels, **changed}) if changed else recording


def change_problem(
    robot: Robot,
    soil: Soil,
    windows: WindowSet,
    parameters: tuple[ModelParameter, ...],
    weighing: Weighing,
    threads: int,
    known: Sequence[Effect] = (),
) -> Problem:
    """The fit of windows with the weights of ordinary drives.

    Args:
        robot: calibrated.
        soil: to start from.
        windows: of the drives.
        parameters: that may move.
        weighing: of ordinary drives.
        threads: of the simulator.
        known: what ordinary drives have and the robot has not, such as a slope of their ground.
    """
    return Problem(
        robot, soil, compared_windows(windows, weighing, robot), Nuisances(parameters), robust=weighing.robust,
        threads=threads, numerics=field_numerics(), known=known,
    )  # fmt: skip


def compared_windows(windows: WindowSet, weighing: Weighing, robot: Robot) -> BlockedWindows:
    """Samples of windows as they are compared: relative to each other where the weighing says so, else one by one."""
    if weighing.turning is None:
        return sample_windows(windows, weighing.sigma)
    return relative_windows(windows, weighing.sigma, robot.outer_radius, weighing.turning)


def misfit_of_compared(windows: BlockedWindows, prediction: Array, before: Weights) -> Weights:
    """Weights by what a prediction (W, T, 8) leaves of windows as they are compared."""
    return weights_by_residuals(windows.differences(prediction), before)


def moved_parameters(problem: Problem, fitted: Fitted) -> dict[str, float]:
    """By how many of its prior deviations a fit moved every parameter that it may move, by name."""
    parameters, values = problem.nuisances.parameters, fitted.point.values.tolist()
    return {p.name: abs(value) / p.prior for p, value in zip(parameters, values, strict=True) if p.prior > 0.0}


def fit_nominal(problem: Problem, start: Point | None = None) -> Fitted:
    """Fit of a problem, without effects where it does not start with some."""
    return fit(problem, start, iterations=ITERATIONS, tolerance=FIELD_TOLERANCE, renewals=ITERATIONS)
