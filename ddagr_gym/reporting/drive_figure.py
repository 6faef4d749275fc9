"""Figure of any simulated drive: its path, and what its wheels did."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ddagr_gym.parameters import Robot
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import (
    TURN_FIGURE_COLUMNS,
    draw_motion,
    draw_robot,
    drawn_columns,
    house_style,
    save_figure,
)

DRIVE_FIGURE_COLUMNS = (*TURN_FIGURE_COLUMNS, "true_v_x", "true_v_y")
"""Columns of a simulated drive that :func:`drive_figure` draws."""


def drive_figure(
    columns: Mapping[str, ArrayLike], path: str | Path, *, robot: Robot, soil_name: str, title: str
) -> tuple[Path, Path]:
    """Path, bank speeds, body speeds, yaw rate, slip and sinkage of a simulated drive.

    Args:
        columns: :data:`DRIVE_FIGURE_COLUMNS`, each (T,).
        path: where, with or without a suffix.
        robot: for its outline.
        soil_name: for the title.
        title: of the drive.

    Returns:
        Paths of the PNG and of the SVG.

    Raises:
        InputError: a column is missing, or matplotlib is not installed.
    """
    data = drawn_columns(columns, DRIVE_FIGURE_COLUMNS)
    with house_style():
        from matplotlib.figure import Figure

        # fixed places: a layout engine would push titles and the legends beside them into each other
        figure = Figure(figsize=(7.4, 5.6))
        _draw_path(figure.add_axes((0.078, 0.1, 0.425, 0.83)), data, robot, f"{title} on {soil_name}")
        axes = [figure.add_axes((0.605, 0.835 - 0.1835 * row, 0.385, 0.115)) for row in range(5)]
        _draw_time_series(axes, data)
        figure.align_ylabels(axes)
        return save_figure(figure, path)


def _draw_path(axes: Any, data: Mapping[str, Any], robot: Robot, title: str) -> None:
    for index in np.linspace(0, len(data["t"]) - 1, 6).astype(int):
        draw_robot(axes, robot, [float(data[f"true_{name}"][index]) for name in ("x", "y", "yaw")])
    axes.plot(data["true_x"], data["true_y"], color=palette.TRUE, linewidth=1.6)
    axes.plot(data["true_x"][0], data["true_y"][0], "o", color=palette.INK, markersize=4)
    axes.set(xlabel="x [m]", ylabel="y [m]")
    axes.set_aspect("equal", anchor="NW")
    axes.margins(0.05)
    axes.set_title(title)


def _draw_time_series(axes: list[Any], data: Mapping[str, Any]) -> None:
    t = data["t"]
    speeds, body, yaw_rate, slip, sinkage = axes
    draw_motion(speeds, yaw_rate, slip, sinkage, data)
    body.plot(t, data["true_v_x"], color=palette.TRUE, label="forward")
    body.plot(t, data["true_v_y"], color=palette.TARGET, label="to the left")
    titles = (
        (speeds, "Bank speed", "[rad/s]", 3),
        (body, "Body speed", "[m/s]", 2),
        (yaw_rate, "Yaw rate", "[rad/s]", 2),
        (slip, "Slip ratio", "[-]", 0),
        (sinkage, "Sinkage", "[mm]", 0),
    )
    for panel, title, unit, columns in titles:
        panel.set_title(title, fontsize=8.0, pad=4.0)
        panel.set(ylabel=unit, xlim=(t[0], t[-1]))
        panel.tick_params(labelbottom=panel is sinkage, length=2.5)
        if columns:
            panel.legend(
                loc="lower right", bbox_to_anchor=(1.01, 0.955), ncols=columns, columnspacing=1.0, fontsize=7.0
            )
        else:
            panel.text(1.0, 1.07, "front solid, rear dashed", transform=panel.transAxes, fontsize=7.0, ha="right")
    sinkage.set_xlabel("time [s]")
