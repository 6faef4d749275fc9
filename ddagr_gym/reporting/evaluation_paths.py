"""Figures of driven turns: exits in the furrow, paths laid over each other, true against estimated path."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ddagr_gym.control.row_turn import (
    FURROW_SLACK,
    PRACTICE_HEADING_TOLERANCE,
    PRACTICE_LATERAL_TOLERANCE,
    RowTurn,
    side_sign,
)
from ddagr_gym.evaluation.report_data import Evaluation, ShownDrive, display_name
from ddagr_gym.parameters import Robot
from ddagr_gym.rendering import palette
from ddagr_gym.rendering.scene import turn_stage
from ddagr_gym.rendering.sketch import rounded_rectangle
from ddagr_gym.reporting.evaluation_figures import arm_colours
from ddagr_gym.reporting.figures import DASHED

_LATERAL_LIMIT = 0.30
"""Of the axis of lateral errors [m]; larger ones are drawn on its edge (ours)."""

_HEADING_LIMIT = math.radians(45.0)
"""Of the axis of heading errors [rad]; larger ones are drawn on its edge (ours)."""

_COLUMNS = 4
"""Panels in a row, at most, where a figure asks for no other number (ours: the width of the page)."""

_POINTS = 500
"""Exits of a panel that are drawn, about (ours: more only cover each other)."""


def _grid(count: int, panel: tuple[float, float], columns: int = _COLUMNS, top: float = 0.0) -> tuple[Any, list[Any]]:
    """Figure of small panels, as many in a row as fit; what is left over is taken away."""
    from matplotlib.figure import Figure

    across = min(columns, count)
    down = math.ceil(count / across)
    size = (0.5 + panel[0] * across, 0.5 + panel[1] * down + top)
    figure = Figure(figsize=size, layout="constrained")
    axes = list(figure.subplots(down, across, sharex=True, sharey=True, squeeze=False).ravel())
    for empty in axes[count:]:
        empty.remove()
    return figure, axes[:count]


def exit_figure(evaluation: Evaluation, robot: Robot) -> Any:
    """Lateral against heading error at the next row's start line, by arm, on the judged set; as if turned left.

    Args:
        evaluation: what was driven.
        robot: for half its wheelbase, in the tolerance.
    """
    arms = [arm for arm in evaluation.arms if evaluation.rows_of(arm.name, evaluation.judged)]
    figure, axes = _grid(len(arms), (1.75, 1.7), 5)
    for panel, arm in zip(axes, arms, strict=True):
        _tolerances(panel, robot.half_wheelbase)
        rows = evaluation.rows_of(arm.name, evaluation.judged)
        _exits(panel, rows)
        fit = sum(bool(row["success"]) for row in rows)
        panel.set_title(display_name(arm.name), fontsize=8.0, color=palette.INK if arm.deployable else palette.GREY)
        panel.text(
            0.98, 0.03, f"{fit} of {len(rows)} fit", transform=panel.transAxes, ha="right", va="bottom", fontsize=6.5,
            color=palette.GREY,
        )  # fmt: skip
        panel.set(xlim=(-1e3 * _LATERAL_LIMIT, 1e3 * _LATERAL_LIMIT), xticks=(-200, 0, 200), yticks=(-30, 0, 30))
        panel.set_ylim(-math.degrees(_HEADING_LIMIT), math.degrees(_HEADING_LIMIT))
        panel.tick_params(labelleft=True, labelbottom=True, length=2.0)
    figure.supxlabel("lateral error [mm], beyond the row positive", fontsize=8)
    figure.supylabel("heading error [°], turned too far positive", fontsize=8)
    return figure


def _exits(panel: Any, rows: Sequence[Any]) -> None:
    """Exits, those beyond the panel on its edge; episodes that never reached the row are not there."""
    reached = [row for row in rows if row["exit_lateral_error"] is not None]
    every = reached[:: max(1, len(reached) // _POINTS)]
    for success, colour in ((True, palette.BLUE), (False, palette.VERMILLION)):
        mine = [row for row in every if bool(row["success"]) == success]
        if not mine:
            continue
        side = np.array([side_sign(row["side"]) for row in mine])
        lateral = -side * np.clip([row["exit_lateral_error"] for row in mine], -_LATERAL_LIMIT, _LATERAL_LIMIT)
        heading = side * np.clip([row["exit_heading_error"] for row in mine], -_HEADING_LIMIT, _HEADING_LIMIT)
        panel.plot(
            1e3 * lateral, np.degrees(heading), "o", color=colour, markersize=2.2, alpha=0.6, mew=0, rasterized=True,
            clip_on=False,
        )  # fmt: skip


def _tolerances(panel: Any, half_wheelbase: float) -> None:
    """The furrow's diamond |e_y| + L |sin e_psi| <= slack, and the box of practice."""
    heading = np.linspace(0.0, min(math.asin(min(FURROW_SLACK / half_wheelbase, 1.0)), 0.5 * math.pi), 40)
    lateral = FURROW_SLACK - half_wheelbase * np.sin(heading)
    x = np.concatenate([lateral, -lateral[::-1], -lateral, lateral[::-1]])
    y = np.concatenate([heading, heading[::-1], -heading, -heading[::-1]])
    panel.fill(1e3 * x, np.degrees(y), color=palette.BED, linewidth=0.0)
    across, up = 1e3 * PRACTICE_LATERAL_TOLERANCE, math.degrees(PRACTICE_HEADING_TOLERANCE)
    panel.plot(
        [-across, across, across, -across, -across], [-up, -up, up, up, -up], color=palette.GREY, linewidth=0.7,
        linestyle=DASHED,
    )  # fmt: skip


def path_figure(evaluation: Evaluation, robot: Robot) -> Any:
    """True paths of each shown arm on the same scenarios over the commanded path and the rows; right turns mirrored."""
    arms = [arm for arm in evaluation.arms if any(drive.arm == arm.name for drive in evaluation.drives)]
    figure, axes = _grid(len(arms), (2.0, 2.45))
    colours = arm_colours(evaluation)
    radius = evaluation.drives[0].turn.radius
    for panel, arm in zip(axes, arms, strict=True):
        mine = [drive for drive in evaluation.drives if drive.arm == arm.name]
        _field(panel, mine[0].turn, robot)
        for drive in mine:
            # scaled, so that turns of other radii lie on one commanded circle
            scale = radius / drive.turn.radius
            path = drive.path * [scale, scale * drive.turn.sign]
            panel.plot(*path.T, color=colours[arm.name], linewidth=0.9, alpha=0.8)
        panel.set_title(display_name(arm.name), fontsize=8.0, color=palette.INK if arm.deployable else palette.GREY)
    figure.supxlabel("x [m]", fontsize=8)
    figure.supylabel("y [m]", fontsize=8)
    return figure


def _field(panel: Any, turn: RowTurn, robot: Robot) -> None:
    """Beds, headland boundary and commanded path of a turn, as if to the left."""
    stage = turn_stage(turn, robot, "")
    assert stage.beds is not None
    assert stage.target_path is not None
    for centre in stage.beds.centres:
        across = (centre - stage.beds.width / 2.0, centre + stage.beds.width / 2.0)
        outline = rounded_rectangle((stage.view.x_min - 1.0, stage.beds.end), across, 0.12)
        panel.fill(*outline.T, color=palette.BED, linewidth=0.0)
    panel.axvline(0.0, color=palette.GREY, linewidth=0.7, linestyle=(0, (1, 3)))
    panel.plot(*(stage.target_path * [1.0, turn.sign]).T, color=palette.INK, linestyle=DASHED, linewidth=1.0)
    panel.set(xlim=(-turn.run_in - 0.1, 2.1 * turn.radius), ylim=(-0.6 * turn.radius, 2.9 * turn.radius))
    panel.set_aspect("equal")
    panel.grid(False)


def estimate_figure(drives: Sequence[ShownDrive], robot: Robot) -> Any:
    """True and estimated path of one turn of each arm that steers by the filter.

    Args:
        drives: with estimates; at least one.
        robot: for the distance of the rows.
    """
    figure, axes = _grid(len(drives), (2.5, 3.1), 3, 0.3)
    for panel, drive in zip(axes, drives, strict=True):
        _field(panel, drive.turn, robot)
        mirror = [1.0, drive.turn.sign]
        panel.plot(*(drive.path * mirror).T, color=palette.TRUE, linewidth=1.6, label="true")
        if drive.estimate is not None:
            dots = (0, (0.1, 2.0))
            panel.plot(
                *(drive.estimate * mirror).T, color=palette.TARGET, linestyle=dots, linewidth=1.8, label="estimated",
                dash_capstyle="round",
            )  # fmt: skip
        panel.set_title(f"{display_name(drive.arm)}, {drive.set_name} {drive.number}", fontsize=8.0)
        words = "" if drive.estimate_error is None else f"estimate off by {100.0 * drive.estimate_error:.1f} %\nof path"
        radius = "no radius" if drive.radius_error is None else f"$e_R$ {100.0 * drive.radius_error:+.1f} %"
        panel.text(0.97, 0.98, f"{radius}\n{words}", transform=panel.transAxes, ha="right", va="top", fontsize=6.5)
    axes[0].plot([], [], color=palette.INK, linestyle=DASHED, linewidth=1.0, label="commanded")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper left", ncols=3)
    figure.supxlabel("x [m]", fontsize=8)
    figure.supylabel("y [m]", fontsize=8)
    return figure
