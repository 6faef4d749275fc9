"""Errors of all models on the left-out drives, as one picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.real_drives.compare import (
    BY_COMMANDS,
    CALIBRATED_BY_SPEEDS,
    LATENESS_KNOWN,
    ROLLING,
    TRACK_BY_SPEEDS,
)
from ddagr_gym.calibration.result import CALIBRATED, DATA_SHEET, KINEMATIC
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

STYLE = {
    DATA_SHEET: (palette.PALE, "data sheet"),
    ROLLING: (palette.GREY, "kinematic, no slip"),
    KINEMATIC: (palette.ORANGE, "effective track, delay, lag"),
    CALIBRATED: (palette.BLUE, "calibrated simulator"),
    "learned": (palette.GREEN, "learned (GRU)"),
    LATENESS_KNOWN: (palette.PURPLE, "calibrated, lateness of each command known"),
    TRACK_BY_SPEEDS: (palette.PALE_ORANGE, "by wheel speeds: effective track"),
    CALIBRATED_BY_SPEEDS: (palette.SKY_BLUE, "by wheel speeds: calibrated simulator"),
}
"""Colour and words of each model."""

PANELS = (
    ("heading", 5.0, "heading after 5 s [rad]"),
    ("position", 5.0, "position after 5 s [m]"),
    ("encoder", None, "wheel speeds, all samples [rad/s]"),
)


def draw(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Median absolute errors with 95 % intervals by drive and model, as PNG, all or nothing.

    Args:
        rows: of :func:`benchmarks.real_drives.compare.errors_of`.
        path: where.
    """
    drives = list(dict.fromkeys(row["drive"] for row in rows))
    grounds = {row["drive"]: row["ground"] for row in rows}
    models = (*BY_COMMANDS, LATENESS_KNOWN, TRACK_BY_SPEEDS, CALIBRATED_BY_SPEEDS)
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(9.0, 8.0), layout="constrained")
        for axes, (metric, horizon, label) in zip(figure.subplots(len(PANELS), 1), PANELS, strict=True):
            for place, model in enumerate(models):
                _bars(axes, rows, drives, model, place, len(models), metric, horizon)
            axes.set_ylabel(f"median {label}")
            axes.set_xticks(range(len(drives)), [f"{_short(name)}\n{grounds[name]}" for name in drives])
            axes.set_yscale("log")
        figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
        write_atomically(path, lambda temporary: figure.savefig(temporary, format="png", dpi=130))


def _bars(
    axes: Any,
    rows: Sequence[Mapping[str, Any]],
    drives: Sequence[str],
    model: str,
    place: int,
    count: int,
    metric: str,
    horizon: float | None,
) -> None:
    colour, words = STYLE[model]
    for number, drive in enumerate(drives):
        found = [
            row
            for row in rows
            if (row["drive"], row["model"], row["metric"], row["horizon"]) == (drive, model, metric, horizon)
        ]
        if not found or found[0]["median_interval"] is None:
            continue
        low, high = found[0]["median_interval"]
        at, value = number + 0.8 * ((place + 0.5) / count - 0.5), found[0]["median"]
        axes.errorbar(
            at, value, [[max(value - low, 0.0)], [max(high - value, 0.0)]], fmt="o", color=colour, markersize=5,
            label=words if number == 0 else None,
        )  # fmt: skip


def _short(name: str) -> str:
    return Path(name).name.removesuffix(".gz").removesuffix(".csv")
