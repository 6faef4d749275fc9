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
    from ddagr_gym.calibration.settings import CalibrationSettings
    from ddagr_gym.diagnosis.answer.verdict import Finding
    from ddagr_gym.diagnosis.preprocessing.data_checks import DoubtedBanks
    from ddagr_gym.diagnosis.preprocessing.mended_recordings import MendedRecordings
    from ddagr_gym.diagnosis.result.drivetrain_names import CompletedNominal
    from ddagr_gym.physics.effects import Effect
    from ddagr_gym.physics.effects.encoder_scale import EncoderScale
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
        nominal: simulator.
        threads: of the simulator.
        seed: of resampled intervals.
        cache: of the diagnosis; the fit's own is a folder in it.
        progress: of the diagnosis.
        made: the calibration behind the fit; None before it.
    """

    nominal: Nominal
    threads: int
    seed: int
    cache: str | os.PathLike[str] | None
    progress: Callable[[str], None] | None
    made: CalibrationOutcome | None = None

    def complete(
        self, misfit: Mapping[str, float], mended: MendedRecordings, doubted: DoubtedBanks
    ) -> CompletedNominal | None:
        """The nominal simulator with the drivetrain that recordings ask for; None where they cannot tell it.

        Args:
            misfit: of the encoders over their limits.
            mended: recordings.
            doubted: what of the banks is fitted too.
        """
        from ddagr_gym.calibration.drivetrain_answer import drivetrain_answer, drivetrain_findings
        from ddagr_gym.calibration.sensor_findings import named_sensors
        from ddagr_gym.diagnosis.preprocessing.known_errors import without_known_errors
        from ddagr_gym.diagnosis.result.drivetrain_names import CompletedNominal
        from ddagr_gym.diagnosis.result.encoder_findings import with_encoders

        self._say("the wheels do not follow their commands as the simulator says: fitting its drivetrain")
        seen, encoders = self._seen(mended.recordings)
        undone = [effect for _, effect in (*seen, *encoders)]
        read = [without_known_errors(item, undone) for item in mended.in_their_channels]
        # what is undone is roughly known: the fit says the rest
        asked = dict.fromkeys((*(effect.name for _, effect in encoders), *doubted.factors))
        self.made = self._calibrated(read, self._settings(len(read), tuple(asked)))
        if self.made is None:
            return None
        found = self.made.calibration
        sensors = (*with_encoders(encoders, named_sensors(found, doubted)), *seen)
        return CompletedNominal(
            robot=self.made.robot,
            soil=self.made.soils[_GROUND],
            answer=drivetrain_answer(found, misfit),
            findings=(*drivetrain_findings(found), *(finding for finding, _ in sensors if finding is not None)),
            effects=tuple(effect for _, effect in sensors),
        )

    def _seen(
        self, recordings: Sequence[Recording]
    ) -> tuple[Sequence[tuple[Finding, Effect]], Sequence[tuple[Finding, EncoderScale]]]:
        """What rests, poses and commands say of the IMU and of the encoders before any fit."""
        from ddagr_gym.diagnosis.result.encoder_findings import encoder_findings, or_wheel_radius
        from ddagr_gym.diagnosis.result.inertial_findings import inertial_findings

        rng = np.random.default_rng(self.seed)
        seen, encoders = inertial_findings(recordings, rng), encoder_findings(recordings, rng)
        for _, scale in encoders:
            if scale.right == scale.left:
                warnings.warn(or_wheel_radius(scale, self.nominal.robot.name), InputWarning, stacklevel=3)
        return seen, encoders

    def _settings(self, count: int, doubted: tuple[str, ...]) -> CalibrationSettings:
        from ddagr_gym.calibration.settings import CalibrationSettings
        from ddagr_gym.diagnosis.result.drivetrain_names import LEAST_EXPLAINED

        usual = CalibrationSettings(
            threads=self.threads, seed=self.seed, least_explained=LEAST_EXPLAINED, doubted=doubted
        )
        if count > 1:
            return usual
        fitted, compared, settlings = (_ONE_DRIVE[name] for name in ("fitted", "compared", "settlings"))
        return replace(usual, fitted=fitted, compared=compared, settlings=settlings)

    def _calibrated(self, recordings: Sequence[Recording], settings: CalibrationSettings) -> CalibrationOutcome | None:
        """The joint fit; None, and why is said, where recordings are not fit for one or it explains little."""
        from ddagr_gym.calibration.run import LittleExplainedError, calibrate_drives, ready_drives

        grounds, soils = [_GROUND] * len(recordings), {_GROUND: self.nominal.soil}
        drives = (recordings, grounds, self.nominal.robot, soils, settings)
        try:
            ready = ready_drives(*drives, self._say)
        except InputError as error:
            warnings.warn(f"the drivetrain cannot be fitted: {error}", InputWarning, stacklevel=2)
            return None
        try:
            return calibrate_drives(
                *drives, soil_names={_GROUND: self.nominal.soil_name}, ready=ready,
                cache=None if self.cache is None else Path(self.cache) / _GROUND, progress=self._say,
            )  # fmt: skip
        except LittleExplainedError as error:
            self._say(f"{error}: no answer")
            return None

    def _say(self, line: str) -> None:
        if self.progress is not None:
            self.progress(f"  {line}")
