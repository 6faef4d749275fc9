"""A calibration's folder as a comparison takes it."""

from __future__ import annotations

import hashlib
from pathlib import Path

from ddagr_gym.calibration.files import load, load_robot, load_soil
from ddagr_gym.calibration.ordinary_drives import robot_deviations, soil_deviations
from ddagr_gym.calibration.ordinary_files import NAME, load_ordinary
from ddagr_gym.diagnosis.change.ground_slope import GroundSlope
from ddagr_gym.diagnosis.change.measured_scatter import measured_scatter
from ddagr_gym.diagnosis.change.ordinary import OrdinaryRobot
from ddagr_gym.diagnosis.change.robot_on_ground import uncertain_robot


def load_ordinary_robot(folder: Path) -> OrdinaryRobot:
    """The calibrated robot of a folder with what its ordinary drives are like.

    Args:
        folder: that ``ddagr calibrate`` wrote.

    Raises:
        InputError: no such folder, no bank in it, or one that an earlier version wrote.
    """
    calibration = load(folder)
    ordinary = load_ordinary(folder / NAME)
    robot = load_robot(folder)
    scatter = measured_scatter()
    return OrdinaryRobot(
        robot,
        {ground: load_soil(folder, ground)[1] for ground in calibration.grounds},
        uncertain_robot(robot, robot_deviations(calibration)),
        soil_deviations(calibration),
        ordinary.weighing,
        ordinary.references,
        folder.name,
        hashlib.sha256((folder / NAME).read_bytes()).hexdigest(),
        known_scatter=scatter.same_ground.of_calibrations,
        other_scatter=scatter.other_ground.of_calibrations,
        slopes={item.ground: GroundSlope(item.gradient, item.deviations) for item in calibration.slopes},
        on_grounds=ordinary.on_grounds,
    )
