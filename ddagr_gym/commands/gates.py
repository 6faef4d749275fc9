"""Thresholds that a command is given, with a word on those that were made for something else."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ddagr_gym.diagnosis.thresholds import Thresholds


def gates_for(path: Path | None, robot: str, soil: str, soil_uncertainty: float = 1.0) -> Thresholds | None:
    """Thresholds of a file, or those that ship for a robot; None where none do. A mismatch is warned of.

    Args:
        path: of ``ddagr null-bank``.
        robot: name of the run's nominal one.
        soil: name of the run's nominal one.
        soil_uncertainty: of the run.

    Raises:
        InputError: the file cannot be read.
    """
    from ddagr_gym.diagnosis.threshold_files import load_thresholds, shipped_thresholds

    thresholds = shipped_thresholds(robot) if path is None else load_thresholds(path)
    if thresholds is not None and thresholds.origin is not None:
        warning = thresholds.origin.mismatch(robot, soil, soil_uncertainty)
        if warning:
            print(f"ddagr: warning: {warning}", file=sys.stderr)
    return thresholds
