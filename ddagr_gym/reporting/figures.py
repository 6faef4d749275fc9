"""Figures in the house style, by matplotlib (the extra ``report``); nothing global changes.

Figures are made without pyplot, so that no window system and no figure registry are touched. The same data give
the same bytes.
"""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.control.circle import taubin_circle, turn_window
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.errors import InputError
from ddagr_gym.extras import need
from ddagr_gym.frames import body_to_world
from ddagr_gym.parameters import Robot
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.rendering.panel import signed
from ddagr_gym.rendering.scene import turn_stage
from ddagr_gym.rendering.sketch import rounded_rectangle

Array = NDArray[np.float64]

HOUSE_STYLE: dict[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 8.0,
    "axes.titlesize": 9.0,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.labelcolor": palette.INK,
    "axes.edgecolor": palette.GREY,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": palette.HAIRLINE,
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.3,
    "lines.solid_capstyle": "round",
    "text.color": palette.INK,
    "xtick.color": palette.GREY,
    "ytick.color": palette.GREY,
    "xtick.labelcolor": palette.INK,
    "ytick.labelcolor": palette.INK,
    "legend.frameon": False,
    "legend.fontsize": 7.5,
    "legend.handlelength": 1.8,
    "legend.borderaxespad": 0.2,
    "figure.dpi": 100.0,
    "savefig.dpi": 220.0,
    "path.simplify_threshold": 0.4,
    "svg.fonttype": "path",
    "svg.hashsalt": "ddagr-gym",
}

COLOURS = (
    palette.BLUE, palette.ORANGE, palette.GREEN, palette.VERMILLION, palette.PURPLE, palette.SKY_BLUE, palette.INK
)  # fmt: skip
"""Cycle of line colours."""

PAGE_WIDTH = 10.8
"""Of a figure that takes the whole page [inches]."""

WHEELS = (
    (1, "front right", palette.RIGHT, "-"),
    (2, "front left", palette.LEFT, "-"),
    (3, "rear right", palette.SKY_BLUE, (0, (2.2, 1.8))),
    (4, "rear left", palette.PALE_ORANGE, (0, (2.2, 1.8))),
)
"""Number, name, colour and line of the wheels; rear ones, dashed, show the front ones that they cover."""

DASHED = (0, (4, 2.2))
"""Dashes of matplotlib: offset, then lengths of stroke and gap [line widths]."""

TURN_FIGURE_COLUMNS = (
    "t",
    "command_right",
    "command_left",
    "true_omega_right",
    "true_omega_left",
    "yaw_rate",
    "true_yaw_rate",
    "true_x",
    "true_y",
    "true_yaw",
    *(f"true_slip_ratio_{i}" for i in (1, 2, 3, 4)),
    *(f"true_sinkage_{i}" for i in (1, 2, 3, 4)),
)
"""Columns of a simulated drive that :func:`turn_figure` draws."""

_MOST_READINGS = 800
"""Of a line of readings, about (ours: two for each pixel of its width)."""


def blank_figure(height: float, width: float = 0.5 * PAGE_WIDTH) -> Any:
    """Empty figure of a size [inches] on nothing, for light pages."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained", facecolor="none")


@contextmanager
def house_style() -> Iterator[None]:
    """Within this context matplotlib draws in the house style; afterwards it is as it was."""
    need("matplotlib")
    from cycler import cycler
    from matplotlib import style

    with style.context(["default", HOUSE_STYLE | {"axes.prop_cycle": cycler(color=COLOURS)}]):
        yield


def svg_data(figure: Any, dpi: float | None = None) -> str:
    """Data URL of a figure as SVG, its text as paths so that it looks the same everywhere; its layout is then fixed.

    Paths and places have two decimals: a fiftieth of a pixel, and a third less to carry.

    Args:
        figure: of matplotlib, inside :func:`house_style`.
        dpi: of what is drawn as points; the figure's own by default.
    """
    if dpi is not None:
        figure.set_dpi(dpi)
    _lay_out(figure)
    stream = io.StringIO()
    figure.savefig(stream, format="svg", metadata={"Date": None}, **({} if dpi is None else {"dpi": dpi}))
    svg = re.sub(r'(?<= )(?:d|x|y)="[^"]*"', lambda found: re.sub(r"(\.\d\d)\d+", r"\1", found[0]), stream.getvalue())
    return f"data:image/svg+xml;base64,{base64.b64encode(svg.encode()).decode()}"


def _lay_out(figure: Any) -> None:
    """Place everything once and for all; with a layout engine matplotlib draws a figure twice for each file."""
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
        figure.set_layout_engine(None)


def save_figure(figure: Any, path: str | Path) -> tuple[Path, Path]:
    """Save a figure as PNG and SVG, each file whole or absent, and fix its layout; call inside :func:`house_style`.

    Args:
        figure: a matplotlib figure.
        path: where, with or without a suffix; parent folders are made.

    Returns:
        Paths of the PNG and of the SVG.
    """
    stem = Path(path).with_suffix("") if Path(path).suffix in (".png", ".svg") else Path(path)
    png, svg = stem.with_name(stem.name + ".png"), stem.with_name(stem.name + ".svg")
    _lay_out(figure)
    write_atomically(png, lambda to: figure.savefig(to, format="png", metadata={"Software": None}))
    write_atomically(svg, lambda to: figure.savefig(to, format="svg", metadata={"Date": None}))
    return png, svg


def turn_figure(
    columns: Mapping[str, ArrayLike], turn: RowTurn, path: str | Path, *, robot: Robot, soil_name: str
) -> tuple[Path, Path]:
    """Figure of a simulated row turn: path with target and beds; speeds, yaw rate, slip and sinkage over time.

    Args:
        columns: :data:`TURN_FIGURE_COLUMNS`, each (T,); ``estimated_x``, ``estimated_y`` are drawn where present.
        turn: the commanded manoeuvre.
        path: where, with or without a suffix.
        robot: for its outline.
        soil_name: for the title.

    Returns:
        Paths of the PNG and of the SVG.

    Raises:
        InputError: a column is missing, or matplotlib is not installed.
    """
    data = drawn_columns(columns, TURN_FIGURE_COLUMNS)
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(7.4, 4.6))
        _draw_path(figure.add_axes((0.078, 0.125, 0.425, 0.7)), data, turn, robot, soil_name)
        axes = [figure.add_axes((0.605, 0.795 - 0.2233 * row, 0.385, 0.145)) for row in range(4)]
        _draw_time_series(axes, data, turn)
        figure.align_ylabels(axes)
        return save_figure(figure, path)


def drawn_columns(columns: Mapping[str, ArrayLike], needed: Sequence[str]) -> dict[str, Array]:
    """Columns as arrays; InputError where a needed one is missing."""
    missing = [name for name in needed if name not in columns]
    if missing:
        raise InputError(f"column {missing[0]!r} is missing: this figure needs {', '.join(needed)}.")
    return {name: np.asarray(values, dtype=float) for name, values in columns.items()}


def nothing_to_draw(axes: Any, text: str) -> None:
    """Say in empty axes why there is nothing in them."""
    axes.text(0.5, 0.5, text, ha="center", va="center", color=palette.GREY, transform=axes.transAxes)
    axes.set_xticks([])
    axes.set_yticks([])
    axes.grid(False)


def _draw_path(axes: Any, data: Mapping[str, Array], turn: RowTurn, robot: Robot, soil_name: str) -> None:
    stage = turn_stage(turn, robot, soil_name)
    view, beds = stage.view, stage.beds
    if beds is not None:
        for centre in beds.centres:
            across = (centre - beds.width / 2.0, centre + beds.width / 2.0)
            outline = rounded_rectangle((view.x_min - 1.0, beds.end), across, 0.12)
            axes.fill(*outline.T, color=palette.BED, linewidth=0.0)
    axes.axvline(0.0, color=palette.GREY, linewidth=0.7, linestyle=(0, (1, 3)))
    instants = np.linspace(0, len(data["t"]) - 1, 3).astype(int)
    for index in instants:
        draw_robot(axes, robot, [float(data[f"true_{name}"][index]) for name in ("x", "y", "yaw")])
    target = stage.target_path if stage.target_path is not None else np.zeros((0, 2))
    axes.plot(*target.T, color=palette.TARGET, linestyle=DASHED, label="commanded", linewidth=1.6)
    axes.plot(data["true_x"], data["true_y"], color=palette.TRUE, label="driven", linewidth=1.6)
    if "estimated_x" in data:
        dots = (0, (0.1, 2.6))
        axes.plot(data["estimated_x"], data["estimated_y"], color=palette.ESTIMATE, linestyle=dots, label="estimated",
                  linewidth=1.2, dash_capstyle="round")  # fmt: skip
    axes.set(xlim=(view.x_min, view.x_max), ylim=(view.y_min, view.y_max), xlabel="x [m]", ylabel="y [m]")
    axes.set_aspect("equal", anchor="NW")
    axes.grid(False)
    axes.set_title(f"{stage.title}, on {soil_name}", pad=33.0)
    axes.text(0.0, 1.095, _radius_line(data, turn), transform=axes.transAxes, fontsize=7.5, color=palette.GREY)
    axes.legend(loc="lower left", bbox_to_anchor=(-0.015, 1.0), ncols=3, columnspacing=1.2)


def _radius_line(data: Mapping[str, Array], turn: RowTurn) -> str:
    text = f"commanded radius {turn.radius:.2f} m"
    window, _ = turn_window(data["true_yaw"], turn.side)
    fit = None if window is None else taubin_circle(data["true_x"][window], data["true_y"][window])
    if fit is None:
        return text
    return f"{text}, driven {fit.radius:.3f} m ({signed(100.0 * (fit.radius / turn.radius - 1.0), 1, '%')})"


def draw_robot(axes: Any, robot: Robot, pose: list[float]) -> None:
    """Tyres and deck in outline at a pose (x, y, yaw) [m, m, rad]."""
    parts = []
    for x, y, tyre in zip(robot.wheel_x, robot.wheel_y, robot.wheels, strict=True):
        length, width = tyre.outer_radius, tyre.half_width
        parts.append(rounded_rectangle((x - length, x + length), (y - width, y + width), 0.5 * width))
    inner = 0.55 * robot.half_track
    parts.append(rounded_rectangle((-robot.half_wheelbase, robot.half_wheelbase), (-inner, inner), 0.06))
    for part in parts:
        outline = body_to_world(part, *pose)
        axes.fill(*outline.T, facecolor=(1.0, 1.0, 1.0, 0.55), edgecolor=palette.GREY, linewidth=0.5)


def _draw_time_series(axes: list[Any], data: Mapping[str, Array], turn: RowTurn) -> None:
    draw_motion(axes[0], axes[1], axes[2], axes[3], data)
    asked = turn.sign * turn.speed / turn.radius
    axes[1].axhline(asked, color=palette.TARGET, linewidth=0.9, linestyle=DASHED, label="commanded")
    _label_time_series(axes, data)


def draw_motion(speeds: Any, yaw_rate: Any, slip: Any, sinkage: Any, data: Mapping[str, Array]) -> None:
    """Bank speeds with commands, yaw rate with the gyro, slip and sinkage of the wheels over time, each in its axes."""
    t = data["t"]
    for bank, colour in (("right", palette.RIGHT), ("left", palette.LEFT)):
        speeds.plot(t, data[f"true_omega_{bank}"], color=colour, label=bank)
        speeds.plot(t, data[f"command_{bank}"], color=palette.INK, linewidth=0.8, linestyle=DASHED)
    speeds.plot([], [], color=palette.INK, linewidth=0.8, linestyle=DASHED, label="command")
    measured = np.flatnonzero(np.isfinite(data["yaw_rate"]))
    measured = measured[:: max(1, len(measured) // _MOST_READINGS)]
    yaw_rate.plot(t[measured], data["yaw_rate"][measured], color=palette.PALE, linewidth=0.8, label="gyro")
    yaw_rate.plot(t, data["true_yaw_rate"], color=palette.TRUE, label="true")
    for index, _, colour, line in WHEELS:
        slip.plot(t, data[f"true_slip_ratio_{index}"], color=colour, linestyle=line)
        sinkage.plot(t, 1000.0 * data[f"true_sinkage_{index}"], color=colour, linestyle=line)
    sinkage.set_ylim(bottom=0.0)


def headland_times(t: Array, x: Array) -> list[tuple[float, float]]:
    """Intervals (start, end) [s] in which the robot's centre is on the headland, x >= 0."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], x >= 0.0, [False]]).astype(int)))
    return [(float(t[first]), float(t[last - 1])) for first, last in edges.reshape(-1, 2)]


def _label_time_series(axes: list[Any], data: Mapping[str, Array]) -> None:
    titles = ("Bank speed", "Yaw rate", "Slip ratio", "Sinkage")
    for axis, title, unit in zip(axes, titles, ("rad/s", "rad/s", "-", "mm"), strict=True):
        axis.set_title(title, fontsize=8.0, pad=4.0)
        axis.set(ylabel=f"[{unit}]", xlim=(data["t"][0], data["t"][-1]))
        axis.tick_params(labelbottom=axis is axes[-1], length=2.5)
        for start, end in headland_times(data["t"], data["true_x"]):
            axis.axvspan(start, end, color=palette.SHADE, linewidth=0.0, zorder=0.0)
    for axis in axes[:2]:
        axis.legend(loc="lower right", bbox_to_anchor=(1.01, 0.96), ncols=3, columnspacing=1.0, fontsize=7.0)
    for axis in axes[2:]:
        axis.text(1.0, 1.055, "front solid, rear dashed", transform=axis.transAxes, fontsize=7.0, ha="right")
    axes[-1].set_xlabel("time [s] (shaded: on the headland)")
