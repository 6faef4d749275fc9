"""What a learned model makes of the quarters of a single drive, trained on the other three: a ceiling for a diagnosis.

The windows are those on which a diagnosis that fits the drivetrain is judged.
"""

from __future__ import annotations

import numpy as np

from benchmarks.real_drives.compare import LEARNED
from benchmarks.real_drives.learned import learned_forecast
from ddagr_gym.calibration.forecast_errors import Forecasts, forecast_errors
from ddagr_gym.calibration.left_out import fold_name, folds
from ddagr_gym.calibration.result import ForecastError
from ddagr_gym.calibration.run import ready_drives
from ddagr_gym.calibration.settings import CalibrationSettings
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.recordings.schema import Recording

GROUND = "ground"


def learned_errors(recording: Recording, robot: Robot, soil: Soil, seed: int = 0) -> tuple[ForecastError, ...]:
    """Errors on every quarter of networks that were trained on the other three, by metric and horizon.

    Args:
        recording: a drive.
        robot: of the data sheet.
        soil: nominal.
        seed: of the networks.

    Raises:
        InputError: a drive that cannot be calibrated.
    """
    settings = CalibrationSettings(seed=seed)
    data = ready_drives([recording], [GROUND], robot, {GROUND: soil}, settings)
    judged = data.spread(settings.judged)
    by_window, by_judged = folds(data, data.windows), folds(data, judged)
    made = []
    for fold in np.unique(by_judged):
        asked = judged.subset(np.flatnonzero(by_judged == fold))
        training = data.windows.subset(np.flatnonzero(by_window != fold))
        said = learned_forecast(training, asked, robot.outer_radius, seed)
        made.append(Forecasts(fold_name(data, int(fold)), GROUND, "", asked, {LEARNED: said}, robot, soil, ()))
    return forecast_errors(made, seed)
