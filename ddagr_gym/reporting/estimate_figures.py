"""Figures of ``ddagr estimate``: estimates over a drive with their deviations, and the truth where it is known."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.evaluation.estimate_panels import DEVIATIONS, EstimateView, Panel
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import DASHED, house_style

Array = NDArray[np.float64]

_MOST_POINTS = 4000
"""Drawn of a line, about (ours: several for each pixel of its width)."""

_HIGHEST_NIS = 4.0
"""Of the overview's panel; higher values leave it."""


def save_estimate_figures(
    view: EstimateView, folder: Path, path_file: str, progress: Callable[[], None] = lambda: None
) -> list[Path]:
    """Write one PNG a panel, the path, the innovations, and an overview of all.

    Args:
        view: what to draw.
        folder: that exists.
        path_file: name of the path's figure, without suffix.
        progress: called after each figure.

    Returns:
        The files.
    """
    files = []

    def save(name: str, size: tuple[float, float], draw: Callable[[Any], None]) -> None:
        from matplotlib.figure import Figure

        figure = Figure(figsize=size, layout="constrained")
        draw(figure)
        target = folder / f"{name}.png"
        write_atomically(target, lambda to: figure.savefig(to, dpi=150, format="png", metadata={"Software": None}))
        files.append(target)
        progress()

    with house_style():
        save(path_file, (6.0, 5.0), lambda figure: _path(figure.subplots(), view))
        for panel in view.panels:
            save(panel.file, (7.2, 3.2), partial(_alone, view=view, panel=panel))
        save("innovations", (9.0, 8.0), lambda figure: _innovations(figure, view))
        save("overview", (13.0, 9.0), lambda figure: _overview(figure, view))
    return files


def figure_count(view: EstimateView) -> int:
    """How many figures :func:`save_estimate_figures` writes."""
    return len(view.panels) + 3


def _gapped(view: EstimateView, values: Array) -> tuple[Array, Array]:
    """Time and values, thinned, with NaN between spans, so that no line crosses one."""
    step = max(1, len(view.t) // _MOST_POINTS)
    parts = []
    for first, stop in view.spans:
        rows = np.arange(first, stop, step)
        parts.append(np.array([np.append(view.t[rows], view.t[rows[-1]]), np.append(values[rows], np.nan)]))
    joined = np.concatenate(parts, axis=1)
    return joined[0], joined[1]


def _alone(figure: Any, view: EstimateView, panel: Panel) -> None:
    _panel(figure.subplots(), view, panel, True)
    _legend(figure, [panel])


def _panel(axes: Any, view: EstimateView, panel: Panel, alone: bool) -> None:
    for line in panel.lines:
        known = None if line.reading is None else np.isfinite(line.reading)
        if line.reading is not None and known is not None and known.any():
            every = np.flatnonzero(known)[:: max(1, int(known.sum()) // _MOST_POINTS)]
            axes.plot(view.t[every], line.reading[every], ".", color=palette.PALE, ms=1.6, zorder=1.0)
        if line.low is not None and line.high is not None:
            t, low = _gapped(view, line.low)
            axes.fill_between(t, low, _gapped(view, line.high)[1], color=line.colour, alpha=0.16, lw=0)
        axes.plot(*_gapped(view, line.value), color=line.colour, lw=1.2, label=line.name or None)
        if line.truth is not None:
            truth = np.broadcast_to(np.asarray(line.truth, dtype=np.float64), view.t.shape)
            axes.plot(*_gapped(view, truth), color=palette.TRUE, lw=1.1, ls=DASHED)
    axes.set(title=panel.title, ylabel=f"[{panel.unit}]", xlim=(view.t[0], view.t[-1]))
    if panel.logarithmic:
        axes.set_yscale("log")
    _limit(axes, panel)
    if alone:
        axes.set_xlabel("time [s]")
    if any(line.name for line in panel.lines):
        axes.legend(ncols=len(panel.lines), columnspacing=1.0, fontsize=7.0)


def _legend(figure: Any, panels: Sequence[Panel]) -> None:
    """What the lines of all panels mean, once, below them."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    lines = [line for panel in panels for line in panel.lines]
    handles: list[Any] = [Line2D([], [], color=palette.ESTIMATE, lw=1.2, label="estimate")]
    if any(line.low is not None for line in lines):
        handles.append(Patch(color=palette.ESTIMATE, alpha=0.16, lw=0, label=f"±{DEVIATIONS:g} standard deviations"))
    if any(line.truth is not None for line in lines):
        label = "truth (soil: best fit to the true wheel forces)"
        handles.append(Line2D([], [], color=palette.TRUE, lw=1.1, ls=DASHED, label=label))
    if any(line.reading is not None and np.isfinite(line.reading).any() for line in lines):
        handles.append(Line2D([], [], color=palette.PALE, marker=".", ls="", ms=5, label="reading"))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))


def _limit(axes: Any, panel: Panel) -> None:
    """Estimates and truth fill the panel; wide bands and noisy readings may leave it."""
    values = [line.value for line in panel.lines]
    values += [np.atleast_1d(line.truth) for line in panel.lines if line.truth is not None]
    joined = np.concatenate(values)
    joined = joined[np.isfinite(joined)]
    if not joined.size or panel.logarithmic:
        return
    low, high = float(joined.min()), float(joined.max())
    ends = [float(np.nanmedian(item)) for line in panel.lines for item in (line.low, line.high) if item is not None]
    low, high = min([low, *ends]), max([high, *ends])
    room = 0.15 * (high - low) or 0.1 * abs(high) or 1.0
    axes.set_ylim(low - room, high + room)


def _path(axes: Any, view: EstimateView) -> None:
    styles = {
        "true": (palette.TRUE, DASHED, 1.6),
        "measured": (palette.TRUE, DASHED, 1.2),
        "estimated": (palette.ESTIMATE, "-", 1.2),
    }
    for name, points in view.paths.items():
        colour, style, width = styles[name]
        for number, (first, stop) in enumerate(view.spans):
            known = np.isfinite(points[first:stop]).all(axis=1)
            part = points[first:stop][known]
            axes.plot(*part.T, color=colour, ls=style, lw=width, label=name if number == 0 else None)
    axes.set(title="Path", xlabel="x [m]", ylabel="y [m]")
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend(loc="best", fontsize=7.0)


def _innovations(figure: Any, view: EstimateView) -> None:
    rows = figure.subplots(len(view.channels), 1, sharex=True)
    for axes, name, values in zip(rows, view.channels, view.innovations.T, strict=True):
        _innovation(axes, view, name, values)
    rows[-1].set_xlabel("time [s]")
    figure.suptitle(f"Standardised innovations: {view.title}")


def _innovation(axes: Any, view: EstimateView, name: str, values: Array) -> None:
    known = np.flatnonzero(np.isfinite(values))
    every = known[:: max(1, known.size // _MOST_POINTS)]
    axes.axhspan(-DEVIATIONS, DEVIATIONS, color=palette.SHADE, lw=0)
    axes.plot(view.t[every], values[every], ".", color=palette.BLUE, ms=1.6)
    axes.set(ylim=(-5.5, 5.5), xlim=(view.t[0], view.t[-1]), ylabel="[-]")
    title = name.replace("_", " ")
    if name in view.bands:
        nis, low, high = view.bands[name]
        title += f": NIS {nis:.2f} (white and consistent: {low:.2f} to {high:.2f})"
    axes.set_title(title)


def _overview(figure: Any, view: EstimateView) -> None:
    columns = 3
    count = len(view.panels) + 2
    grid = figure.add_gridspec(-(-count // columns), columns)
    places = [grid[k // columns, k % columns] for k in range(count)]
    _path(figure.add_subplot(places[0]), view)
    for place, panel in zip(places[1:], view.panels, strict=False):
        _panel(figure.add_subplot(place), view, panel, False)
    _nis(figure.add_subplot(places[-1]), view)
    _legend(figure, view.panels)
    figure.suptitle(view.title, fontweight="bold")


def _nis(axes: Any, view: EstimateView) -> None:
    """NIS of each channel over tenths of the run."""
    pieces = np.array_split(np.arange(len(view.t)), 10)
    t = np.array([view.t[piece].mean() for piece in pieces])
    colours = (palette.BLUE, palette.SKY_BLUE, palette.INK, palette.ORANGE, palette.GREEN)
    for name, values, colour in zip(view.channels, view.innovations.T, colours, strict=False):
        parts = [values[piece][np.isfinite(values[piece])] for piece in pieces]
        nis = [float(np.mean(part**2)) if part.size else np.nan for part in parts]
        axes.plot(
            t, np.minimum(nis, 2.0 * _HIGHEST_NIS), "-o", color=colour, ms=2.5, lw=1.0, label=name.replace("_", " ")
        )
    axes.axhline(1.0, color=palette.GREY, lw=0.8)
    axes.set(title="NIS by tenth of the run", ylabel="[-]", xlabel="time [s]")
    axes.set_ylim(0.0, _HIGHEST_NIS)
    axes.legend(fontsize=6.5, ncols=3, loc="upper left")
