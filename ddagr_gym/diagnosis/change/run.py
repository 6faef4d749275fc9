"""What changed in drives of a calibrated robot: all stages in their order."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ddagr_gym.diagnosis.answer.change import ChangeCertificate
from ddagr_gym.diagnosis.answer.verdict import Diagnosis
from ddagr_gym.diagnosis.change.before_drives import GROUND, WINDOW, robot_of_before
from ddagr_gym.diagnosis.change.conclusion import conclude_change
from ddagr_gym.diagnosis.change.drive_fit import change_problem, change_windows, fit_nominal
from ddagr_gym.diagnosis.change.left_out import certificate, left_out_losses
from ddagr_gym.diagnosis.change.mid_drive import name_in_parts
from ddagr_gym.diagnosis.change.naming import Named, name_changes
from ddagr_gym.diagnosis.change.ordinary import OrdinaryRobot
from ddagr_gym.diagnosis.change.requirements import check_before, check_comparable
from ddagr_gym.diagnosis.mid_drive.onsets import onsets_of, with_onsets
from ddagr_gym.diagnosis.preprocessing.data_checks import data_doubts
from ddagr_gym.diagnosis.preprocessing.mended_recordings import MendedRecordings, mend_recordings
from ddagr_gym.diagnosis.preprocessing.repeated_readings import hold_effect
from ddagr_gym.diagnosis.result.channel_fault_findings import new_holds, with_new_faults
from ddagr_gym.diagnosis.result.sentences import change_headline
from ddagr_gym.identification.gauss_newton import Fitted
from ddagr_gym.identification.problem import Problem
from ddagr_gym.parameters import Robot, Soil
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
        mended: the drives.
    """

    diagnosis: Diagnosis
    effects: tuple[Effect, ...]
    problem: Problem
    named: Named
    mended: MendedRecordings


def what_changed(
    recordings: Sequence[Recording],
    ordinary: OrdinaryRobot,
    ground: str = "",
    *,
    usual: MendedRecordings | None = None,
    seed: int = 0,
    threads: int = 1,
    progress: Callable[[str], None] = lambda line: None,
) -> Outcome:
    """What changed against a robot's ordinary drives.

    Args:
        recordings: of one robot on one ground.
        ordinary: the calibrated robot.
        ground: of the calibration; "" where it is not known.
        usual: the drives that they are compared with; what is wrong with the channels of these too is no change.
        seed: of everything random.
        threads: of the simulator.
        progress: called with what is being done.

    Raises:
        InputError: recordings that cannot be compared.
    """
    began = time.monotonic()
    check_comparable(recordings, ordinary, ground)
    mended = mend_recordings(recordings, seed)
    ordinary = ordinary.seen_by(mended.recordings, ground)
    progress("fitting the robot of the ordinary drives")
    problem, fitted = fit_ordinary(mended, ordinary, ground, threads)
    rng = np.random.default_rng(seed)
    comparison = ordinary.comparison(ground)
    named = name_changes(problem, fitted, comparison, rng, progress)
    problem, named = name_in_parts(problem, fitted, named, comparison, rng, progress)
    doubts = data_doubts(mended.given, rng)
    progress("forecasting windows that were left out")
    certified = _certified(problem, ordinary, named)
    diagnosis, effects = conclude_change(problem, mended, ordinary, ground, named, certified)
    diagnosis = _timed(diagnosis, problem, named)
    held = new_holds(mended, ordinary.usual_holds)
    diagnosis = with_new_faults(diagnosis, mended, usual, held)
    effects = ((hold_effect(held),) if held else ()) + effects
    diagnosis = replace(diagnosis, checks=doubts, seconds=time.monotonic() - began)
    return Outcome(diagnosis, effects, problem, named, mended)


def _timed(diagnosis: Diagnosis, problem: Problem, named: Named) -> Diagnosis:
    """The answer with when each effect began."""
    found = with_onsets(diagnosis, onsets_of(problem, named.models[-1].fitted))
    if found.change is None:
        raise ValueError("a comparison says what changed")
    return replace(found, sentence=change_headline(found.verdict, found.complete, found.findings, found.change))


def what_changed_since(
    after: Sequence[Recording],
    before: Sequence[Recording],
    robot: Robot,
    soil: Soil,
    *,
    same_ground: bool = False,
    window: float = WINDOW,
    seed: int = 0,
    threads: int = 1,
    progress: Callable[[str], None] = lambda line: None,
) -> tuple[Outcome, OrdinaryRobot]:
    """What changed since drives from before, and the robot that was fitted to these.

    Args:
        after: of one robot on one ground.
        before: of the same robot on one ground, when it was ordinary.
        robot: nominal, from which the fit to the drives from before begins.
        soil: nominal, likewise.
        same_ground: whether the ground is the same after as before; else its soil is free, and no change of soil named.
        window: length of the windows [s].
        seed: of everything random.
        threads: of the simulator.
        progress: called with what is being done.

    Raises:
        InputError: drives that cannot be compared.
    """
    began = time.monotonic()
    check_before(after, before, robot, window)
    usual = mend_recordings(before, seed)
    known = robot_of_before(usual, robot, soil, window=window, seed=seed, threads=threads, progress=progress)
    outcome = what_changed(
        after, known, GROUND if same_ground else "", usual=usual, seed=seed, threads=threads, progress=progress
    )
    diagnosis = replace(outcome.diagnosis, seconds=time.monotonic() - began)
    return replace(outcome, diagnosis=diagnosis), known


def fit_ordinary(
    mended: MendedRecordings, ordinary: OrdinaryRobot, ground: str, threads: int = 1
) -> tuple[Problem, Fitted]:
    """The calibrated robot fitted to drives; on an unknown ground from the soil that leaves least.

    Args:
        mended: drives.
        ordinary: calibrated robot.
        ground: that they are on; "" where it is not known.
        threads: of the simulator.
    """
    weighing = ordinary.weighing.on(ground)
    robot = ordinary.robot_on(ground)
    windows = change_windows(mended.recordings, robot, weighing)
    soils = ordinary.soils if not ground else {ground: ordinary.soils[ground]}
    parameters = ordinary.uncertain(ground, mended.recordings)
    problems = [
        change_problem(robot, soil, windows, parameters, weighing, threads, ordinary.known) for soil in soils.values()
    ]
    found = [(problem, fit_nominal(problem)) for problem in problems]
    return min(found, key=lambda item: item[1].cost)


def _certified(problem: Problem, ordinary: OrdinaryRobot, named: Named) -> ChangeCertificate | None:
    """Forecasts with what changed and without it; None where those of ordinary drives are not known."""
    if not ordinary.losses.size:
        return None
    without = left_out_losses(problem, named.models[0].fitted)
    corrected = left_out_losses(problem, named.models[-1].fitted) if named.steps else without
    return certificate(without, corrected, ordinary.losses)
