"""Thresholds that a command is given, with a word on those that were made for something else."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ddagr_gym.diagnosis.gates.thresholds import Thresholds


def gates_for(path: Path | None, robot: str, soil: str, soil_uncertainty: float = 1.0) -> Thresholds | None:
    """Thresholds of a file, or those that ship for a robot; None where none do. A mismatch is warned of.

    Args:
        path: of ``ddagr null-bank``.
        robot: name or file of the run's nominal one.
        soil: name or file of the run's nominal one.
        soil_uncertainty: of the run.

    Raises:
        InputError: the file cannot be read.
    """
    from ddagr_gym.diagnosis.gates.threshold_files import load_thresholds, shipped_thresholds
    from ddagr_gym.presets import full_name, get_robot

    name = get_robot(robot).name
    thresholds = shipped_thresholds(name) if path is None else load_thresholds(path)
    if thresholds is not None and thresholds.origin is not None:
        warning = thresholds.origin.mismatch(name, full_name(soil), soil_uncertainty)
        if warning:
            print(f"ddagr: warning: {warning}", file=sys.stderr)
    return thresholds
