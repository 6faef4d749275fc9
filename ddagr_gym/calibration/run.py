"""All stages of a calibration in their order, each kept when it is finished."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from ddagr_gym.calibration.accelerometer_results import SlopeOfGround
from ddagr_gym.calibration.calibration_data import CalibrationData, prepare_drives
from ddagr_gym.calibration.current_evidence import current_evidence
from ddagr_gym.calibration.drive_scatter import DriveEstimates, drive_estimates
from ddagr_gym.calibration.final_parts import decide_with_all_windows
from ddagr_gym.calibration.fit_starts import fit_from_several
from ddagr_gym.calibration.forecast_errors import Forecasts, all_forecasts, explained_when_left_out, forecast_errors
from ddagr_gym.calibration.identifiability import covariance, unidentified
from ddagr_gym.calibration.imu_mounting import imu_mounting
from ddagr_gym.calibration.independent_steps import IndependentSteps
from ddagr_gym.calibration.input_requirements import check_drives, check_scales, drive_scale, with_gyro_forward
from ddagr_gym.calibration.joint_fit import (
    LAST_ITERATIONS,
    FittedModel,
    Standing,
    complete_model,
    model_at,
    weigh_and_fit,
)
from ddagr_gym.calibration.ordinary_drives import Ordinary, ordinary_drives
from ddagr_gym.calibration.part_comparison import Candidate, Comparison
from ddagr_gym.calibration.part_selection import Selection, select_parts
from ddagr_gym.calibration.parts import DATA_SHEET_PARTS, RobotModel
from ddagr_gym.calibration.residual_tables import spectra, unexplained
from ddagr_gym.calibration.result import SCHEMA, SCHEMA_VERSION, Calibration, Covariance
from ddagr_gym.calibration.settings import CalibrationSettings
from ddagr_gym.calibration.simulator_values import calibrated_robot, fitted_soil
from ddagr_gym.calibration.summary import drive_summaries, parameter_results
from ddagr_gym.diagnosis.gates.source_digest import code_digest, source_digest
from ddagr_gym.diagnosis.preprocessing.input_requirements import reading_hash
from ddagr_gym.diagnosis.store import StepStore
from ddagr_gym.identification.residual_weights import Weights
from ddagr_gym.identification.windows import WindowSet
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.tasks import TaskRunner
from ddagr_gym.version import __version__

Progress = Callable[[str], None]

_SOURCES = ("calibration", "replay_analysis")
"""Folders of the package whose code results depend on besides those of a diagnosis."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of a calibration.

    Attributes:
        calibration: the answer.
        robot: calibrated.
        soils: calibrated, by ground.
        data: drives as they were fitted.
        forecasts: of the left-out drives.
        model: fitted to some windows of all drives.
        weights: of the residuals of that fit.
        ordinary: what a comparison of other drives with these needs; None with a single drive, or where no bank was
            asked for.
    """

    calibration: Calibration
    robot: Robot
    soils: Mapping[str, Soil]
    data: CalibrationData
    forecasts: tuple[Forecasts, ...]
    model: FittedModel
    weights: Weights
    ordinary: Ordinary | None = None


class LittleExplainedError(Exception):
    """All parts of the drivetrain together explain less of left-out wheel speeds than the settings ask for.

    Attributes:
        share: of their squared error that is taken away from the data sheet's.
    """

    def __init__(self, share: float) -> None:
        super().__init__(f"all parts together explain {share:.0%} of the squared error of left-out wheel speeds")
        self.share = share


@dataclass(frozen=True, eq=False)
class FinalFit:
    """Joint fit of the parts that are kept.

    Attributes:
        standing: where it stands.
        weights: of the residuals.
        refused: parameters that the drives do not identify, with deviation after over before.
    """

    standing: Standing
    weights: Weights
    refused: dict[str, float]


def ready_drives(
    recordings: Sequence[Recording],
    grounds: Sequence[str],
    robot: Robot,
    soils: Mapping[str, Soil],
    settings: CalibrationSettings,
    progress: Progress = lambda line: None,
) -> CalibrationData:
    """Drives that a calibration can be made with, mended and cut into windows. Arguments as :func:`calibrate_drives`.

    Raises:
        InputError: drives that cannot be calibrated.
    """
    check_drives(recordings, robot)
    progress("what the sensors say about the robot's size")
    forward, turned = zip(*(with_gyro_forward(item, _rng(settings)) for item in recordings), strict=True)
    scales = [drive_scale(item, _rng(settings)) for item in forward]
    check_scales([recording.meta.source for recording in recordings], scales, robot)
    data = prepare_drives(forward, grounds, robot, soils, settings)
    return replace(data, notes=tuple((*a, *b) for a, b in zip(turned, data.notes, strict=True)))


def calibrate_drives(
    recordings: Sequence[Recording],
    grounds: Sequence[str],
    robot: Robot,
    soils: Mapping[str, Soil],
    settings: CalibrationSettings,
    *,
    data_sheet: str = "",
    soil_names: Mapping[str, str] | None = None,
    with_bank: bool = False,
    ready: CalibrationData | None = None,
    runner: TaskRunner | None = None,
    cache: Path | None = None,
    progress: Progress = lambda line: None,
) -> Outcome:
    """Calibrate a robot with its ordinary drives.

    Args:
        recordings: of one robot and period.
        grounds: ground of each.
        robot: of the data sheet.
        soils: nominal soil of each ground.
        settings: windows, threads and seed.
        data_sheet: name or file of the robot.
        soil_names: of the soils by ground.
        with_bank: also scan every drive for every effect of the library with the robot calibrated without it, where
            there are two drives or more.
        ready: the same drives as :func:`ready_drives` leaves them; made of them where it is None.
        runner: of steps that do not depend on each other: the fits from several starts and, for the bank, the drives;
            this process where it is None. The result is the same to the bit.
        cache: folder of finished steps, from which the same calibration goes on after an interruption; None keeps
            nothing.
        progress: called with what is being done.

    Raises:
        InputError: drives that cannot be calibrated, or a cache that holds something else.
        LittleExplainedError: less than ``settings.least_explained`` is explained.
        FailedTasksError: some of the independent steps failed; the others are kept.
    """
    began = time.monotonic()
    data = ready_drives(recordings, grounds, robot, soils, settings, progress) if ready is None else ready
    store = StepStore(cache, "" if cache is None else _key(recordings, grounds, robot, soils, settings), progress)
    with TaskRunner() if runner is None else nullcontext(runner) as shared:
        steps = IndependentSteps(shared, store, progress)
        fit = _fit_supported_parts(data, settings, store, steps)
        progress("forecasts of left-out drives")
        made = fit.comparison.forecasts(fit.model)
        compared = all_forecasts(data, fit.model, made, fit.held, settings.threads)
        soils_used = {ground: (soil_names or {}).get(ground, "") for ground in data.drives_on}
        names = (data_sheet or robot.name, soils_used)
        calibration = _answer(data, fit, recordings, compared, settings, names, began)
        found = {ground: fitted_soil(data, ground, fit.model.values) for ground in data.drives_on}
        calibrated = calibrated_robot(data, fit.model, calibration)
        ordinary = (
            ordinary_drives(data, fit.model, made, calibration, fit.estimates, calibrated, settings.threads, steps)
            if with_bank and data.count > 1
            else None
        )
    return Outcome(calibration, calibrated, found, data, compared, fit.model, fit.final.weights, ordinary)


@dataclass(frozen=True, eq=False)
class _SupportedFit:
    """Joint fit of the parts that the drives support.

    Attributes:
        complete: model with all parts.
        held: values at which parameters that never move are held.
        selection: parts that were kept and left out.
        final: joint fit, and parameters that the drives do not identify.
        comparison: windows and weights that models were compared by.
        model: the fit with its sensitivities.
        estimates: of every drive by itself.
    """

    complete: RobotModel
    held: dict[str, float]
    selection: Selection
    final: FinalFit
    comparison: Comparison
    model: FittedModel
    estimates: DriveEstimates


def _fit_supported_parts(
    data: CalibrationData, settings: CalibrationSettings, store: StepStore, steps: IndependentSteps
) -> _SupportedFit:
    """Choose parts by forecasts of left-out drives, fit them jointly, and each drive by itself about that fit."""
    progress, robot = steps.progress, data.robot
    complete, held = complete_model(data, settings.doubted)
    selection = _select(data, complete, held, settings, store, steps)
    kept = complete.without(selection.left_out, robot)
    progress("joint fit")
    windows = data.spread(settings.fitted)
    first = store.step(
        "joint fit", partial(_joint_fit, data, windows, kept, selection.standing.values, settings.threads)
    )
    comparison = Comparison.of(data, windows, first.weights, settings)
    selection = decide_with_all_windows(
        comparison, complete, replace(selection, standing=first.standing), store.step, progress
    )
    kept = complete.without(selection.left_out, robot)
    progress("parameters that the drives identify")
    final = store.step("identified", partial(_identified, comparison, kept, selection.standing))
    kept = kept.held(frozenset(final.refused), robot)
    model = model_at(data, windows, kept, final.weights, final.standing, settings.threads)
    progress("every drive by itself")
    estimates = store.step("drives", partial(drive_estimates, data, model, final.weights, settings.threads))
    return _SupportedFit(complete, held, selection, final, comparison, model, estimates)


def _answer(
    data: CalibrationData,
    fit: _SupportedFit,
    recordings: Sequence[Recording],
    compared: Sequence[Forecasts],
    settings: CalibrationSettings,
    names: tuple[str, dict[str, str]],
    began: float,
) -> Calibration:
    """What a calibration says; ``names`` are those of the data sheet and of the soils by ground."""
    model, windows = fit.model, fit.comparison.windows
    left_out, refused = fit.selection.left_out, fit.final.refused
    return Calibration(
        schema=SCHEMA,
        schema_version=SCHEMA_VERSION,
        program=__version__,
        robot=data.robot.name,
        data_sheet=names[0],
        soils=names[1],
        drives=drive_summaries(data, recordings, windows, compared),
        window=windows.duration,
        parts=fit.selection.decisions,
        parameters=parameter_results(data, fit.complete, model, left_out, refused, fit.estimates),
        covariance=Covariance(model.free, tuple(tuple(row) for row in covariance(model).tolist())),
        forecasts=forecast_errors(compared, settings.seed, settings.threads),
        spectra=spectra(compared),
        unexplained=unexplained(compared, data.prepared.sigma),
        converged=fit.final.standing.converged,
        seed=settings.seed,
        seconds=time.monotonic() - began,
        currents=current_evidence(data, model, compared),
        imu=imu_mounting(data, model),
        slopes=tuple(SlopeOfGround(ground, s.gradient, s.deviations) for ground, s in data.slopes.items()),
    )


def _rng(settings: CalibrationSettings) -> np.random.Generator:
    """Random numbers of the checks of one drive, the same whatever the others are."""
    return np.random.default_rng(settings.seed)


def _select(
    data: CalibrationData,
    model: RobotModel,
    held: Mapping[str, float],
    settings: CalibrationSettings,
    store: StepStore,
    steps: IndependentSteps,
) -> Selection:
    """Parts, but those of the data sheet, that forecasts of left-out drives ask for, by fits to some of the windows.

    Raises:
        LittleExplainedError: less than ``settings.least_explained`` is explained.
    """
    model = model.without(DATA_SHEET_PARTS, data.robot)
    windows = data.spread(settings.compared)
    rough = store.step("all parts", partial(_weigh, data, windows, model, held, settings.threads, steps))
    comparison = Comparison.of(data, windows, rough.weights, settings)
    asked = settings.least_explained > 0.0
    full, explained = store.step(
        "all parts forecast", partial(_all_parts, comparison, model, held, rough.standing, asked)
    )
    if explained is not None and explained < settings.least_explained:
        raise LittleExplainedError(explained)
    found = select_parts(comparison, model, full, store.step, steps.progress)
    return replace(found, left_out=found.left_out | DATA_SHEET_PARTS)


def _all_parts(
    comparison: Comparison, model: RobotModel, held: Mapping[str, float], standing: Standing, asked: bool
) -> tuple[Candidate, float | None]:
    """The model with all these parts by its forecasts; where asked, the share of the wheel speeds that they explain."""
    fitted = comparison.fitted(model, standing, iterations=0)
    made = comparison.forecasts(fitted)
    candidate = comparison.judge(fitted, made)
    if not asked:
        return candidate, None
    return candidate, explained_when_left_out(comparison.data, fitted, made, held, comparison.threads)


def _weigh(
    data: CalibrationData,
    windows: WindowSet,
    model: RobotModel,
    held: Mapping[str, float],
    threads: int,
    steps: IndependentSteps,
) -> FinalFit:
    found, weights = fit_from_several(data, windows, model, held, threads, steps)
    return FinalFit(found.standing, weights, {})


def _joint_fit(
    data: CalibrationData, windows: WindowSet, model: RobotModel, start: Mapping[str, float], threads: int
) -> FinalFit:
    found, weights = weigh_and_fit(data, windows, model, start, threads, LAST_ITERATIONS)
    return FinalFit(found.standing, weights, {})


def _identified(comparison: Comparison, model: RobotModel, standing: Standing) -> FinalFit:
    """The fit of the parts that are kept, again with the data sheet's values where the drives identify nothing."""
    refused = unidentified(comparison.fitted(model, standing, iterations=0))
    if refused:
        values = {name: 0.0 if name in refused else value for name, value in standing.values.items()}
        held = model.held(frozenset(refused), comparison.data.robot)
        standing = comparison.fitted(held, replace(standing, values=values), LAST_ITERATIONS).standing
    return FinalFit(standing, comparison.weights, refused)


def calibration_digest() -> str:
    """SHA-256 over the code on which calibrations depend; docstrings, comments and layout do not count."""
    digest = hashlib.sha256(source_digest().encode())
    package = Path(__file__).resolve().parents[1]
    for path in sorted(path for folder in _SOURCES for path in (package / folder).rglob("*.py")):
        digest.update(code_digest(path.read_text()).encode())
    return digest.hexdigest()


def _key(
    recordings: Sequence[Recording],
    grounds: Sequence[str],
    robot: Robot,
    soils: Mapping[str, Soil],
    settings: CalibrationSettings,
) -> str:
    """SHA-256 of all that results depend on; the number of threads is not among it."""
    digest = hashlib.sha256(calibration_digest().encode())
    for recording in recordings:
        digest.update(reading_hash(recording).encode())
    texts = [list(grounds), repr(robot), repr(soils), repr(replace(settings, threads=1))]
    digest.update(json.dumps(texts).encode())
    return digest.hexdigest()
