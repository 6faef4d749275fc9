"""Where a simulated drive ended, as text."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.reporting.text_table import format_table

HEADER = ("at the end", "value", "unit")


def drive_text(columns: Mapping[str, NDArray[np.float64]]) -> str:
    """Table of the end of a drive, and whether a wheel bogged down.

    Args:
        columns: as :func:`ddagr_gym.simulator.simulate` returns them.
    """
    note = "\nA wheel bogged down: no sinkage carried its load." if bogged_down(columns) else ""
    return format_table(HEADER, end_rows(columns)) + note


def bogged_down(columns: Mapping[str, NDArray[np.float64]]) -> bool:
    """Whether no sinkage carried the load of a wheel at some time."""
    return any(bool(columns[f"true_bogged_{i}"].any()) for i in (1, 2, 3, 4))


def end_rows(columns: Mapping[str, NDArray[np.float64]]) -> list[tuple[str, float, str]]:
    """State at the end, and the largest slip ratio and sinkage of any wheel, under :data:`HEADER`."""
    last = {name: float(values[-1]) for name, values in columns.items()}
    slip = max(float(np.abs(columns[f"true_slip_ratio_{i}"]).max()) for i in (1, 2, 3, 4))
    sinkage = max(float(columns[f"true_sinkage_{i}"].max()) for i in (1, 2, 3, 4))
    return [
        ("time", last["t"], "s"),
        ("position x", last["true_x"], "m"),
        ("position y", last["true_y"], "m"),
        ("heading", float(np.degrees(last["true_yaw"])), "deg"),
        ("speed", float(np.hypot(last["true_v_x"], last["true_v_y"])), "m/s"),
        ("yaw rate", last["true_yaw_rate"], "rad/s"),
        ("largest slip ratio", slip, "-"),
        ("largest sinkage", 1e3 * sinkage, "mm"),
    ]
