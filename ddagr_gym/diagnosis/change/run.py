"""What changed in drives of a calibrated robot: all stages in their order."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ddagr_gym.diagnosis.answer.verdict import Diagnosis
from ddagr_gym.diagnosis.change.conclusion import conclude_change
from ddagr_gym.diagnosis.change.drive_fit import change_problem, change_windows, fit_nominal
from ddagr_gym.diagnosis.change.naming import Named, name_changes
from ddagr_gym.diagnosis.change.ordinary import OrdinaryRobot
from ddagr_gym.diagnosis.change.requirements import check_comparable
from ddagr_gym.diagnosis.preprocessing.data_checks import data_doubts
from ddagr_gym.diagnosis.preprocessing.mended_recordings import MendedRecordings, mend_recordings
from ddagr_gym.identification.gauss_newton import Fitted
from ddagr_gym.identification.problem import Problem
from ddagr_gym.physics.effects import Effect
from ddagr_gym.recordings.schema import Recording


@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of a comparison with ordinary drives.

    Attributes:
        diagnosis: the answer.
        effects: what it names, with fitted sizes.
        problem: windows and weights.
        named: models behind the answer.
    """

    diagnosis: Diagnosis
    effects: tuple[Effect, ...]
    problem: Problem
    named: Named


def what_changed(
    recordings: Sequence[Recording],
    ordinary: OrdinaryRobot,
    ground: str = "",
    *,
    seed: int = 0,
    threads: int = 1,
    progress: Callable[[str], None] = lambda line: None,
) -> Outcome:
    """What changed against a robot's ordinary drives.

    Args:
        recordings: of one robot on one ground.
        ordinary: the calibrated robot.
        ground: of the calibration; "" where it is not known.
        seed: of everything random.
        threads: of the simulator.
        progress: called with what is being done.

    Raises:
        InputError: recordings that cannot be compared.
    """
    began = time.monotonic()
    check_comparable(recordings, ordinary, ground)
    mended = mend_recordings(recordings)
    progress("fitting the calibrated robot")
    problem, fitted = _fitted(mended, ordinary, ground, threads)
    rng = np.random.default_rng(seed)
    named = name_changes(problem, fitted, ordinary.scores(ground), rng, progress)
    doubts = data_doubts(mended.given, rng)
    diagnosis, effects = conclude_change(problem, mended, ordinary, ground, named)
    diagnosis = replace(diagnosis, checks=doubts, seconds=time.monotonic() - began)
    return Outcome(diagnosis, effects, problem, named)


def _fitted(mended: MendedRecordings, ordinary: OrdinaryRobot, ground: str, threads: int) -> tuple[Problem, Fitted]:
    """The calibrated robot fitted to drives; on an unknown ground from the soil that leaves least."""
    windows = change_windows(mended.recordings, ordinary.robot, ordinary.weighing)
    soils = ordinary.soils if not ground else {ground: ordinary.soils[ground]}
    parameters = ordinary.uncertain(ground, len(mended.recordings))
    problems = [
        change_problem(ordinary.robot, soil, windows, parameters, ordinary.weighing, threads) for soil in soils.values()
    ]
    found = [(problem, fit_nominal(problem)) for problem in problems]
    return min(found, key=lambda item: item[1].cost)
