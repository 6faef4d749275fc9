"""The drivetrain of a diagnosis: fitted where the wheels do not follow their commands as the nominal robot's would."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ddagr_gym.api.nominal import Nominal
from ddagr_gym.errors import InputError, InputWarning

if TYPE_CHECKING:
    from ddagr_gym.calibration.run import Outcome as CalibrationOutcome
    from ddagr_gym.diagnosis.result.drivetrain_names import CompletedNominal
    from ddagr_gym.recordings.schema import Recording

_GROUND = "ground"
"""Name of the one that all recordings of a diagnosis are on."""

_ONE_DRIVE = {"fitted": 36, "compared": 20, "settlings": 1}
"""Windows of a single drive that a fit of its drivetrain uses, and those that decide on parts (ours): a quarter of them
is left out at a time; and how often a fit without a part goes on (more changed no name on real drives)."""


@dataclass
class DrivetrainFit:
    """Fits the drivetrain to the recordings that are diagnosed, where that is asked for.

    Attributes:
        recordings: that are diagnosed.
        nominal: simulator.
        threads: of the simulator.
        seed: of resampled intervals.
        cache: of the diagnosis; the fit's own is a folder in it.
        progress: of the diagnosis.
        made: the calibration behind the fit; None before it.
    """

    recordings: Sequence[Recording]
    nominal: Nominal
    threads: int
    seed: int
    cache: str | os.PathLike[str] | None
    progress: Callable[[str], None] | None
    made: CalibrationOutcome | None = None

    def complete(self, misfit: Mapping[str, float], encoders_doubted: bool = False) -> CompletedNominal | None:
        """The nominal simulator with the drivetrain that the recordings ask for; None where they cannot tell it.

        Args:
            misfit: of the encoders over their limits.
            encoders_doubted: whether the gyro contradicts the encoders of one bank, whose scales are fitted then.
        """
        from ddagr_gym.calibration.drivetrain_answer import drivetrain_answer, drivetrain_findings
        from ddagr_gym.calibration.input_requirements import with_gyro_forward
        from ddagr_gym.calibration.run import LittleExplainedError, calibrate_drives, ready_drives
        from ddagr_gym.calibration.sensor_findings import named_sensors
        from ddagr_gym.calibration.settings import CalibrationSettings
        from ddagr_gym.diagnosis.preprocessing.scaled_readings import without_scales
        from ddagr_gym.diagnosis.result.drivetrain_names import LEAST_EXPLAINED, CompletedNominal
        from ddagr_gym.diagnosis.result.gyro_findings import gyro_findings

        settings = CalibrationSettings(
            threads=self.threads, seed=self.seed, least_explained=LEAST_EXPLAINED,
            encoder_scales=encoders_doubted,
        )  # fmt: skip
        if len(self.recordings) == 1:
            fitted, compared, settlings = (_ONE_DRIVE[name] for name in ("fitted", "compared", "settlings"))
            settings = replace(settings, fitted=fitted, compared=compared, settlings=settlings)
        self._say("the wheels do not follow their commands as the simulator says: fitting its drivetrain")
        rng = np.random.default_rng(self.seed)
        gyro = gyro_findings([with_gyro_forward(item, rng)[0] for item in self.recordings], rng)
        recordings = [without_scales(item, [effect for _, effect in gyro]) for item in self.recordings]
        grounds, soils = [_GROUND] * len(recordings), {_GROUND: self.nominal.soil}
        drives = (recordings, grounds, self.nominal.robot, soils, settings)
        try:
            ready = ready_drives(*drives, self._say)
        except InputError as error:
            warnings.warn(f"the drivetrain cannot be fitted: {error}", InputWarning, stacklevel=2)
            return None
        try:
            self.made = calibrate_drives(
                *drives, soil_names={_GROUND: self.nominal.soil_name}, ready=ready,
                cache=None if self.cache is None else Path(self.cache) / _GROUND, progress=self._say,
            )  # fmt: skip
        except LittleExplainedError as error:
            self._say(f"{error}: no answer")
            return None
        found = self.made.calibration
        answer = drivetrain_answer(found, misfit)
        robot, soil = self.made.robot, self.made.soils[_GROUND]
        sensors = (*named_sensors(found), *gyro)
        findings = (*drivetrain_findings(found), *(finding for finding, _ in sensors))
        return CompletedNominal(robot, soil, answer, findings, tuple(effect for _, effect in sensors))

    def _say(self, line: str) -> None:
        if self.progress is not None:
            self.progress(f"  {line}")
