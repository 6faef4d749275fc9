"""The object that all stages of a diagnosis share: recordings, problem, gates and seed, prepared once."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from ddagr_gym.diagnosis.gates.source_digest import source_digest
from ddagr_gym.diagnosis.gates.thresholds import Thresholds
from ddagr_gym.diagnosis.preprocessing.input_requirements import check_recordings, reading_hash, warn_of_unmeasured
from ddagr_gym.diagnosis.preprocessing.known_errors import without_known_errors
from ddagr_gym.diagnosis.preprocessing.mended_recordings import MendedRecordings, mend_recordings
from ddagr_gym.diagnosis.setting import Setting, make_problem
from ddagr_gym.identification.problem import Problem
from ddagr_gym.identification.spells import Spell
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.physics.effects import Effect
from ddagr_gym.recordings.schema import Recording

Progress = Callable[[str], None]
"""Function that takes one line of text: what is being done."""


def be_silent(text: str) -> None:
    """A :data:`Progress` that says nothing."""


@dataclass(frozen=True, eq=False)
class DiagnosisSession:
    """What is diagnosed, against what, and how. Stages read it and never change it.

    Attributes:
        robot: nominal.
        soil: nominal.
        mended: recordings without the faults that show in their values.
        setting: choices; its windows are those of the problem.
        problem: windows with their noise, the nominal simulator, and what is uncertain.
        bank: thresholds of the null bank, for the length of its own drives.
        gates: the same for the time that the windows of the problem cover.
        seed: of everything random.
        progress: called with what is being done inside a stage.
    """

    robot: Robot
    soil: Soil
    mended: MendedRecordings
    setting: Setting
    problem: Problem
    bank: Thresholds
    gates: Thresholds
    seed: int = 0
    progress: Progress = be_silent

    def rng(self, stage: str) -> np.random.Generator:
        """Random numbers of one stage, the same whatever was done before it."""
        return np.random.default_rng([self.seed, *stage.encode()])

    def with_windows(self, duration: float, stride: float) -> DiagnosisSession:
        """The same recordings cut into other windows.

        Args:
            duration: of a window [s].
            stride: between their starts [s].
        """
        return self._with(self.setting.with_windows(duration, stride))

    def as_far_off(self) -> DiagnosisSession:
        """The same with a simulator that is only as accurate as a model that is far off needs."""
        return self._with(replace(self.setting, far_off=True))

    def _with(self, setting: Setting) -> DiagnosisSession:
        problem = make_problem(self.robot, self.soil, self.mended.recordings, setting)
        return replace(self, setting=setting, problem=problem, gates=self.bank.for_length(problem.covered))

    def during(self, spells: Mapping[str, Spell]) -> DiagnosisSession:
        """The same recordings with effects that are present in a part of them only, by name."""
        return replace(self, problem=self.problem.during(spells))

    def with_nominal(self, robot: Robot, soil: Soil, sensors: Sequence[Effect] = ()) -> DiagnosisSession:
        """The same drives beside another nominal simulator.

        Args:
            robot: nominal.
            soil: nominal.
            sensors: what is known of sensors and of the gains of commands; such factors are undone in the recordings.
        """
        read = tuple(without_known_errors(recording, sensors) for recording in self.mended.recordings)
        problem = make_problem(robot, soil, read, self.setting).during(self.problem.spells)
        gates, mended = self.bank.for_length(problem.covered), replace(self.mended, recordings=read)
        return replace(self, robot=robot, soil=soil, mended=mended, problem=problem, gates=gates)

    def key(self) -> str:
        """SHA-256 of all that results depend on; the number of threads is not among it."""
        digest = hashlib.sha256(source_digest().encode())
        for recording in self.mended.given:
            digest.update(reading_hash(recording).encode())
        setting = replace(self.setting, threads=1)
        texts = [repr(self.robot), repr(self.soil), repr(setting), asdict(self.bank), self.seed]
        digest.update(json.dumps(texts, sort_keys=True).encode())
        return digest.hexdigest()


def prepare(
    recordings: Sequence[Recording],
    robot: Robot,
    soil: Soil,
    thresholds: Thresholds,
    setting: Setting,
    *,
    seed: int = 0,
    progress: Progress = be_silent,
) -> DiagnosisSession:
    """Check and mend recordings, estimate their noise, cut their windows, and bring the gates to their length.

    Args:
        recordings: at least one, of one robot and period.
        robot: nominal.
        soil: nominal.
        thresholds: of the null bank.
        setting: choices.
        seed: of everything random.
        progress: called with what is being done inside a stage.

    Raises:
        InputError: recordings that cannot be diagnosed.
        InputWarning: (a warning) a channel has too few samples to measure its noise and is left out.
    """
    check_recordings(recordings, robot, setting)
    mended = mend_recordings(recordings, seed)
    # beside ordinary drives, that readings repeat is no difference
    mended = replace(mended, left_out=()) if thresholds.of_ordinary_drives else mended
    warn_of_unmeasured(mended.recordings)
    problem = make_problem(robot, soil, mended.recordings, setting)
    gates = thresholds.for_length(problem.covered)
    return DiagnosisSession(robot, soil, mended, setting, problem, thresholds, gates, seed, progress)
