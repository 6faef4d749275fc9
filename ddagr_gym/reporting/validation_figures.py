"""Figures of the validation: measured wheels, and another simulator's turns, beside the model."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import DASHED, house_style, save_figure

Array = NDArray[np.float64]

_WHEEL_ROWS = (
    ("drawbar", "drawbar / load [-]", (-2.6, 1.5)),
    ("lateral", "lateral / load [-]", (-0.3, 3.4)),
    ("sinkage", "sinkage [mm]", (0.0, 80.0)),
)
"""Quantity, label and limits (ours, the same for all angles) of each row of panels."""


def single_wheel_figure(
    measured: Mapping[str, ArrayLike], curves: Mapping[str, Mapping[str, ArrayLike]], path: str | Path
) -> tuple[Path, Path]:
    """Drawbar, lateral force and sinkage against slip, one column of panels per slip angle.

    Args:
        measured: ``rim_command`` [m/s], ``slip``, ``slip_angle`` [rad], ``load`` [N], ``drawbar`` [N], ``lateral``
            [N], ``sinkage`` [m], each (N,).
        curves: by label, what the model gives for the same trials: ``drawbar``, ``lateral``, ``sinkage``, (N,) each,
            drawn as the mean over repeats; the first is solid, the others are dashed. Three at most.
        path: where, with or without a suffix.

    Returns:
        Paths of the PNG and of the SVG.
    """
    data = {name: np.asarray(values, dtype=float) for name, values in measured.items()}
    angles = np.unique(np.round(np.degrees(data["slip_angle"])))
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(9.6, 5.2))
        axes = figure.subplots(3, len(angles), sharex=True, sharey="row", squeeze=False)
        for column, angle in enumerate(angles):
            chosen = np.flatnonzero(np.round(np.degrees(data["slip_angle"])) == angle)
            for axis, (name, label, limits) in zip(axes[:, column], _WHEEL_ROWS, strict=True):
                _draw_wheel_panel(axis, data, curves, name, chosen)
                axis.axvspan(-1.1, 0.0 if angle <= 60 else 1.1, color=palette.SHADE, linewidth=0.0, zorder=0.0)
                axis.set(xlim=(-1.1, 1.0), ylim=limits, xticks=(-1, 0))
                if column == 0:
                    axis.set_ylabel(label)
            axes[0, column].set_title(f"{angle:.0f}°", fontsize=8.5)
            axes[2, column].set_xlabel("slip [-]")
        handles, labels = axes[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="upper right", ncols=len(labels), bbox_to_anchor=(0.99, 1.0))
        figure.text(0.012, 0.965, "Single wheel by slip angle", fontsize=9.5, fontweight="bold")
        figure.text(0.36, 0.965, "shaded: braking or beyond 60°, where mechanisms are missing", fontsize=7.5)
        figure.subplots_adjust(left=0.065, right=0.99, top=0.9, bottom=0.09, wspace=0.12, hspace=0.12)
        figure.align_ylabels(axes[:, 0])
        return save_figure(figure, path)


def _share(values: Array, load: Array, name: str) -> Array:
    return 1e3 * values if name == "sinkage" else values / load


def _draw_wheel_panel(
    axis: Any, data: Mapping[str, Array], curves: Mapping[str, Mapping[str, ArrayLike]], name: str,
    chosen: NDArray[np.intp],
) -> None:  # fmt: skip
    load, slip = data["load"][chosen], data["slip"][chosen]
    _, repeats = np.unique(np.round(data["rim_command"][chosen], 6), return_inverse=True)
    count = np.bincount(repeats)
    measured = _share(data[name][chosen], load, name)
    axis.plot(slip, measured, "o", color=palette.INK, markersize=2.6, markeredgewidth=0.0, label="measured")
    lines = ("-", DASHED, (0, (1, 1.5)))
    colours = (palette.BLUE, palette.ORANGE, palette.GREEN)
    for (label, curve), line, colour in zip(curves.items(), lines, colours, strict=False):
        values = _share(np.asarray(curve[name], dtype=float)[chosen], load, name)
        places, heights = np.bincount(repeats, slip) / count, np.bincount(repeats, values) / count
        axis.plot(places, heights, linestyle=line, color=colour, label=label)


_SOIL_COLOURS = (palette.BLUE, palette.ORANGE, palette.GREEN, palette.VERMILLION)
_VARIANT_MARKERS = ("o", "s", "^", "v")


def turn_comparison_figure(
    soils: ArrayLike,
    reference: Mapping[str, ArrayLike],
    variants: Mapping[str, Mapping[str, ArrayLike]],
    path: str | Path,
    *,
    reference_name: str,
) -> tuple[Path, Path]:
    """Steady turns of the model against another simulator's: yaw rate, forward speed, slip and sinkage.

    Args:
        soils: (N,) names.
        reference: ``yaw_rate`` (N,) [rad/s], ``v_x`` (N,) [m/s], ``slip`` (N, 2) [-], ``sinkage`` (N, 4) [m].
        variants: the same of the model, by name; the first is drawn filled, the others open.
        path: where, with or without a suffix.
        reference_name: for the axes.

    Returns:
        Paths of the PNG and of the SVG.
    """
    names = np.asarray(soils)
    panels = (
        ("yaw_rate", "Yaw rate", "rad/s", 1.0),
        ("v_x", "Forward speed", "m/s", 1.0),
        ("slip", "Slip of the banks", "-", 1.0),
        ("sinkage", "Sinkage of the wheels", "mm", 1e3),
    )
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(9.6, 2.9))
        for axis, (quantity, title, unit, scale) in zip(figure.subplots(1, 4), panels, strict=True):
            _draw_comparison(axis, names, reference, variants, quantity, scale)
            axis.set_title(title)
            axis.set_xlabel(f"{reference_name} [{unit}]")
            axis.set_ylabel(f"model [{unit}]" if axis is figure.axes[0] else "")
        handles, labels = figure.axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="lower center", ncols=len(labels))
        figure.subplots_adjust(left=0.055, right=0.99, top=0.9, bottom=0.26, wspace=0.25)
        return save_figure(figure, path)


def _draw_comparison(
    axis: Any, soils: NDArray[Any], reference: Mapping[str, ArrayLike], variants: Mapping[str, Mapping[str, ArrayLike]],
    quantity: str, scale: float,
) -> None:  # fmt: skip
    theirs = scale * np.asarray(reference[quantity], dtype=float)
    low, high = np.nanmin(theirs), np.nanmax(theirs)
    for number, (variant, columns) in enumerate(variants.items()):
        ours = scale * np.asarray(columns[quantity], dtype=float)
        low, high = min(low, np.nanmin(ours)), max(high, np.nanmax(ours))
        for soil, colour in zip(np.unique(soils), _SOIL_COLOURS, strict=False):
            axis.plot(
                theirs[soils == soil].ravel(), ours[soils == soil].ravel(), _VARIANT_MARKERS[number], color=colour,
                markersize=4.2, markerfacecolor=colour if number == 0 else "none", markeredgewidth=0.9,
                label=f"{variant}, {str(soil).replace('_', ' ')}",
            )  # fmt: skip
    margin = 0.06 * (high - low)
    span = (low - margin, high + margin)
    axis.plot(span, span, color=palette.GREY, linewidth=0.8, linestyle=DASHED, zorder=0.5)
    axis.set(xlim=span, ylim=span)
    axis.set_aspect("equal")
