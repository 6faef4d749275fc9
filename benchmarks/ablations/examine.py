"""What every arm says of one case, with what it cost."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.ablations.arms import (
    First,
    bic_thresholds,
    first_of,
    from_values,
    noise_thresholds,
    scan_raw_nominal,
)
from benchmarks.ablations.sparse import sparse_first
from ddagr_gym.diagnosis.gates.thresholds import Thresholds
from ddagr_gym.diagnosis.preprocessing.session import DiagnosisSession, prepare
from ddagr_gym.diagnosis.search.rivals import scans_of
from ddagr_gym.diagnosis.search.scanned_model import ScannedModel, scan_model
from ddagr_gym.diagnosis.search.starting_models import refit_nominal, starting_models
from ddagr_gym.diagnosis.setting import Setting, make_problem
from ddagr_gym.identification.gauss_newton import Fitted
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.load import load_recording
from ddagr_gym.recordings.schema import Recording

ARMS = {
    "as it is": "first scan of the diagnosis",
    "nominal fixed": "raw nominal model, soil, robot and biases not refitted",
    "no null bank": "gates and limits from white noise alone",
    "BIC forward": "gates by the Bayesian information criterion",
    "one roll-out": "one window per drive, states free at its start only",
    "SINDy": "sparse regression of the residual accelerations",
}
ROBOT, SOIL = "ddagr", "thesis_a1"

_WHOLE_DRIVE = 1e6
"""Longer than any drive [s]; windows are then as long as the drives."""


def read_runs(folder: Path) -> list[Recording]:
    """Recordings of a case's drives, in their order."""
    return [load_recording(path, "concealed", ROBOT) for path in sorted(folder.glob("run_*.csv.gz"))]


@dataclass(frozen=True, eq=False)
class _FirstScan:
    """The case as the diagnosis sees it before its search."""

    session: DiagnosisSession
    raw: Fitted
    scans: tuple[ScannedModel, ...]


def examine(folder: Path, thresholds: Thresholds) -> dict[str, dict[str, Any]]:
    """First names of every arm for the drives of one case.

    Args:
        folder: of the case.
        thresholds: of the null bank.

    Returns:
        By arm: name, passes, ratio, rough, alarm, and seconds of CPU that it needs beyond those of "as it is" where it
        builds on its refit.
    """
    robot, soil = get_robot(ROBOT), get_soil(SOIL)
    began = time.process_time()
    case = _first_scan(robot, soil, folder, thresholds)
    values = from_values(case.session.mended)
    problem, candidates = case.session.problem, case.scans[0].terms.candidates
    found = {"as it is": _timed(lambda: values or first_of(case.scans, case.session.gates), began)}
    arms: dict[str, Callable[[], First]] = {
        "nominal fixed": lambda: values or first_of((scan_raw_nominal(problem, case.raw, soil),), case.session.gates),
        "no null bank": lambda: values or first_of(case.scans, noise_thresholds(problem)),
        "BIC forward": lambda: values or first_of(case.scans, bic_thresholds(problem, candidates)),
        "one roll-out": lambda: values or _one_roll_out(robot, soil, case),
        "SINDy": lambda: sparse_first(problem, case.scans[0].fitted, robot.outer_radius),
    }
    return found | {name: _timed(work, time.process_time()) for name, work in arms.items()}


def _timed(work: Callable[[], First], began: float) -> dict[str, Any]:
    first = work()
    return first.as_mapping() | {"seconds": time.process_time() - began}


def _first_scan(robot: Robot, soil: Soil, folder: Path, thresholds: Thresholds) -> _FirstScan:
    setting = Setting().with_windows(thresholds.duration)
    start = starting_models(prepare(read_runs(folder), robot, soil, thresholds, setting))
    problem = start.session.problem
    return _FirstScan(
        start.session, start.raw, tuple(scans_of(problem, scan_model(problem, start.refitted), start.raw))
    )


def _one_roll_out(robot: Robot, soil: Soil, case: _FirstScan) -> First:
    """The same with windows as long as the drives."""
    setting = Setting(duration=_WHOLE_DRIVE, stride=_WHOLE_DRIVE)
    problem = make_problem(robot, soil, case.session.mended.recordings, setting)
    return first_of((scan_model(problem, refit_nominal(problem)[1]),), case.session.gates)
