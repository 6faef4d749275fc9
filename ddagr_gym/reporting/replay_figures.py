"""Figures of a replay: paths, growth of the errors, and what the residuals depend on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.frames import rotation_matrix
from ddagr_gym.identification.data_split import evenly
from ddagr_gym.identification.windows import CHANNELS, WindowSet
from ddagr_gym.rendering import palette
from ddagr_gym.replay_analysis.drive_mode import DriveModeResult
from ddagr_gym.replay_analysis.horizons import start_headings
from ddagr_gym.replay_analysis.report import EFFECTIVE_TRACK, MODELS, NO_SLIP, NOMINAL, REFITTED, HorizonError
from ddagr_gym.replay_analysis.residuals import BIN_QUANTITIES
from ddagr_gym.reporting.figures import DASHED, house_style, nothing_to_draw, save_figure

Array = NDArray[np.float64]

MODEL_STYLES: dict[str, tuple[str, str, Any]] = {
    NOMINAL: ("simulator, nominal", palette.SKY_BLUE, "-"),
    REFITTED: ("simulator, refitted", palette.VERMILLION, "-"),
    NO_SLIP: ("kinematic, no slip", palette.GREY, (0, (1, 1.4))),
    EFFECTIVE_TRACK: ("kinematic, effective track", palette.GREEN, DASHED),
}
"""Label, colour and line of each model."""

CELLS = 12
"""Roll-outs that are drawn, evenly chosen."""
ROW = 4
"""Roll-outs drawn side by side, at most (ours)."""

LEAST_WINDOWS = 3
"""Windows from which on a curve of their mean error is worth drawing."""
LEAST_EXTENT = 0.5
"""Smallest cell of a roll-out [m]."""

_POSE = [CHANNELS.index(name) for name in ("pose_x", "pose_y")]
_YAW_RATE = CHANNELS.index("yaw_rate")
_SHOWN = ("yaw_rate", "specific_force_x", "specific_force_y", "encoder_right", "encoder_left")
_LABELS = {
    "specific_force_x": "specific force x", "specific_force_y": "specific force y", "yaw_rate": "yaw rate",
    "encoder_right": "encoder right", "encoder_left": "encoder left", "pose_x": "pose x", "pose_y": "pose y",
    "pose_yaw": "pose heading",
}  # fmt: skip


def replay_overview(mode: DriveModeResult, path: Path, title: str) -> tuple[Path, Path]:
    """Roll-outs on the measured path, residuals along it, and errors against the horizon.

    Args:
        mode: replay in one drive mode.
        path: where, with or without a suffix.
        title: of the figure; it names the recording and the drive mode.

    Returns:
        Paths of the PNG and of the SVG.
    """
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(10.0, 8.0))
        figure.text(0.045, 0.965, title, fontsize=11.0, fontweight="bold")
        _legend(figure, mode)
        _draw_rollouts(figure.add_axes((0.045, 0.465, 0.475, 0.41)), mode)
        _draw_along_path(figure, figure.add_axes((0.045, 0.02, 0.395, 0.385)), mode)
        _draw_growth(figure.add_axes((0.605, 0.655, 0.375, 0.22)), mode)
        _draw_horizons(figure.add_axes((0.605, 0.345, 0.375, 0.2)), mode, "heading", "Heading error", "[rad]")
        _draw_horizons(figure.add_axes((0.605, 0.045, 0.375, 0.2)), mode, "position", "Position error", "[m]")
        return save_figure(figure, path)


def replay_residuals(mode: DriveModeResult, path: Path, title: str) -> tuple[Path, Path]:
    """Residuals over their noise by channel, and against slip, yaw rate, speed, heading and time.

    Arguments and returned paths are those of :func:`replay_overview`.
    """
    with house_style():
        from matplotlib.figure import Figure

        binned = mode.report.residuals[0].regimes
        channels = [name for name in _SHOWN if any(r.channel == name for r in binned)]
        height = 2.6 + 1.45 * len(channels)
        figure = Figure(figsize=(10.0, height))
        figure.text(0.045, 1.0 - 0.28 / height, title, fontsize=11.0, fontweight="bold")
        _legend(figure, mode, (NOMINAL, REFITTED))
        _draw_channels(figure.add_axes((0.115, 1.0 - 2.15 / height, 0.865, 1.2 / height)), mode)
        for row, channel in enumerate(channels):
            bottom = 1.0 - (3.6 + 1.45 * row) / height
            _draw_bins(figure, mode, channel, bottom, 1.05 / height, row == len(channels) - 1)
        return save_figure(figure, path)


def _legend(figure: Any, mode: DriveModeResult, models: Sequence[str] = MODELS) -> None:
    from matplotlib.lines import Line2D

    present = {error.model for error in mode.report.horizons} | set(mode.residuals)
    present |= {rollout.model for rollout in mode.report.rollouts}
    measured = [Line2D([], [], color=palette.INK, linewidth=1.6, label="measured")] if len(models) > 2 else []
    lines = [
        Line2D([], [], color=colour, linestyle=line, linewidth=1.6, label=label)
        for name, (label, colour, line) in MODEL_STYLES.items()
        if name in present and name in models
    ]
    height = figure.get_figheight()
    figure.legend(
        handles=measured + lines, loc="upper left", bbox_to_anchor=(0.04, 1.0 - 0.33 / height), ncols=5,
        columnspacing=1.6,
    )  # fmt: skip


def _chosen(mode: DriveModeResult) -> list[tuple[WindowSet, dict[str, Array], int]]:
    """Roll-outs to draw, longest first."""
    runs = [(w, dict(p), i) for w, p in reversed(mode.rollouts) for i in range(w.count)]
    return [runs[i] for i in evenly(len(runs), CELLS)]


def _start(windows: WindowSet, row: int) -> Array:
    """Position and heading (x, y, yaw) at a roll-out's start; the heading from all of its poses through the gyro."""
    heading = float(start_headings(windows.subset(np.array([row])))[0])
    start = windows.initial[row, :3].copy()
    start[2] = heading if np.isfinite(heading) else start[2]
    return start


def _in_body_frame(path: Array, start: Array) -> Array:
    """Positions (n, 2) seen from a start (x, y, yaw)."""
    return np.asarray((path - start[:2]) @ rotation_matrix(start[2]))


def _fitted_to_cells(groups: list[list[Array]]) -> tuple[list[list[Array]], list[tuple[float, float, float]]]:
    """Groups of paths, each scaled to a cell of its own, and the cells as (left, bottom, metres across)."""
    fitted, cells = [], []
    columns = min(ROW, len(groups))
    for k, group in enumerate(groups):
        points = np.concatenate(group)
        points = points[np.isfinite(points).all(axis=1)]
        low, high = points.min(axis=0), points.max(axis=0)
        size = max(float((high - low).max()), LEAST_EXTENT)
        centre = np.array([k % columns, -(k // columns)])
        fitted.append([centre + 0.84 * (path - 0.5 * (low + high)) / size for path in group])
        cells.append((float(centre[0]) - 0.46, float(centre[1]) - 0.46, size / 0.84))
    return fitted, cells


def _as_map(axes: Any, cells: Sequence[tuple[float, float, float]]) -> None:
    """No axes, but a scale in every cell."""
    axes.set_aspect("equal", anchor="NW")
    axes.axis("off")
    left, bottom = min(c[0] for c in cells), min(c[1] for c in cells)
    right, top = max(c[0] for c in cells) + 0.92, max(c[1] for c in cells) + 0.92
    axes.set(xlim=(left, right), ylim=(bottom - 0.02, top))
    for x, y, metres in cells:
        steps = [f * 10.0**e for e in range(-4, 6) for f in (1.0, 2.0, 5.0)]
        length = max(step for step in steps if step <= 0.3 * metres)
        axes.plot([x, x + length / metres], [y, y], color=palette.INK, linewidth=1.4, solid_capstyle="butt")
        axes.text(x, y + 0.015, f"{length:g} m", fontsize=6.5, color=palette.GREY)


def _draw_rollouts(axes: Any, mode: DriveModeResult) -> None:
    count = sum(w.count for w, _ in mode.rollouts)
    chosen = _chosen(mode)
    axes.set_title(f"Long roll-outs ({len(chosen)} of {count}), first heading to the right", pad=4.0)
    if not chosen:
        return nothing_to_draw(axes, "no stretch with a known drive")
    groups = []
    for windows, predictions, w in chosen:
        start, guess = _start(windows, w), windows.initial[w, :3]
        measured = _in_body_frame(windows.measured[w][:, _POSE], start)
        models = [_in_body_frame(predictions[name][w][:, _POSE], guess) for name in predictions]
        groups.append([measured[np.isfinite(measured).all(axis=1)], *models, np.zeros((1, 2))])
    fitted, cells = _fitted_to_cells(groups)
    for (_, predictions, _), group in zip(chosen, fitted, strict=True):
        for name, path in zip(predictions, group[1:-1], strict=True):
            _, colour, line = MODEL_STYLES[name]
            axes.plot(*path.T, color=colour, linestyle=line, linewidth=1.1)
        axes.plot(*group[0].T, color=palette.INK, linewidth=1.2)
        axes.plot(*group[-1].T, "o", color=palette.INK, markersize=2.5)
    return _as_map(axes, cells)


def _draw_along_path(figure: Any, axes: Any, mode: DriveModeResult) -> None:
    from matplotlib.collections import LineCollection
    from matplotlib.colors import LinearSegmentedColormap

    name = REFITTED if REFITTED in mode.residuals else NOMINAL
    axes.set_title(f"Yaw rate residual along the path, {MODEL_STYLES[name][0]}", pad=4.0)
    pieces = [_residual_pieces(mode, name, *run) for run in _chosen(mode)]
    pieces = [piece for piece in pieces if piece]
    if not pieces:
        return nothing_to_draw(axes, "no pose or no gyro")
    fitted, cells = _fitted_to_cells([[path for path, _ in piece] for piece in pieces])
    values = np.array([value for piece in pieces for _, value in piece])
    limit = float(np.quantile(np.abs(values), 0.95)) or 1.0
    colours = LinearSegmentedColormap.from_list("residual", (palette.BLUE, palette.PALE, palette.VERMILLION))
    paths = [path for group in fitted for path in group]
    lines = LineCollection(paths, array=values, cmap=colours, clim=(-limit, limit), linewidths=2.2)
    axes.add_collection(lines)
    _as_map(axes, cells)
    bar = figure.colorbar(lines, cax=figure.add_axes((0.455, 0.06, 0.01, 0.28)))
    bar.set_label("mean of windows [rad/s]")
    bar.outline.set_visible(False)
    return None


def _residual_pieces(
    mode: DriveModeResult, model: str, run: WindowSet, predictions: Mapping[str, Array], row: int
) -> list[tuple[Array, float]]:
    """Paths (n, 2) of the windows inside a roll-out, seen from its start, with their mean yaw rate residual."""
    start, first = _start(run, row), run.time[row]
    windows, pieces = mode.windows, []
    near = (windows.recording == run.recording[row]) & (windows.time >= first - 1e-6)
    for k in np.flatnonzero(near & (windows.time < first + run.duration)):
        pose = windows.measured[k][:, _POSE]
        pose = pose[np.isfinite(pose).all(axis=1)]
        residual = mode.residuals[model][k, :, _YAW_RATE]
        if len(pose) > 1 and np.isfinite(residual).any():
            pieces.append((_in_body_frame(pose, start), float(np.nanmean(residual))))
    return pieces


def _draw_growth(axes: Any, mode: DriveModeResult) -> None:
    axes.set_title("Growth of the heading error", pad=5.0)
    judged = {h: r for h, r in mode.horizons.items() if any("heading" in e for e in r.errors.values())}
    if not judged:
        return nothing_to_draw(axes, "not judged: no unseen stretch, or no gyro")
    # the growth in one or two windows is their manoeuvres, not the models' error
    many = [horizon for horizon, result in judged.items() if len(result.clusters) >= LEAST_WINDOWS]
    longest = max(many or judged)
    result = judged[longest]
    axes.set_title(f"Growth of the heading error ({len(result.clusters)} windows)", pad=5.0)
    for name, curve in result.growth.items():
        _, colour, line = MODEL_STYLES[name]
        times = result.period * np.arange(1, len(curve) + 1)
        axes.plot(times, curve, color=colour, linestyle=line, linewidth=1.6)
    best = [np.max(curve) for name, curve in result.growth.items() if name != NO_SLIP and np.isfinite(curve).all()]
    if best:
        axes.set_ylim(0.0, 1.15 * max(best))
    axes.set(xlim=(0.0, longest), xlabel="time since the start [s]", ylabel="root mean square [rad]")
    return None


def _draw_horizons(axes: Any, mode: DriveModeResult, metric: str, title: str, unit: str) -> None:
    axes.set_title(f"{title}: median (dot), r.m.s. (bar), 95 %", pad=5.0)
    shown = [e for e in mode.report.horizons if e.metric == metric and e.error.count]
    if not shown:
        return nothing_to_draw(axes, "not judged: no unseen stretch, or nothing measures it")
    horizons = sorted({e.horizon for e in shown})
    for error in shown:
        place = horizons.index(error.horizon) + 0.16 * (MODELS.index(error.model) - 1.5)
        _draw_error(axes, place, error)
    _log_scale(axes)
    axes.set(xlim=(-0.5, len(horizons) - 0.5), ylabel=unit)
    axes.set_xticks(range(len(horizons)), [f"after {h:g} s" for h in horizons])
    axes.tick_params(axis="x", length=0.0)
    axes.grid(False, axis="x")
    return None


def _log_scale(axes: Any) -> None:
    """Logarithmic, with plain numbers at 1, 2, 5, or at powers of ten where these are many."""
    from matplotlib.ticker import LogLocator, NullFormatter

    axes.set_yscale("log")
    low, high = axes.get_ylim()
    subs = (1.0, 2.0, 5.0) if high < 50.0 * low else (1.0,)
    axes.yaxis.set_major_locator(LogLocator(subs=subs))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_formatter(NullFormatter())


def _draw_error(axes: Any, place: float, item: HorizonError) -> None:
    colour, error = MODEL_STYLES[item.model][1], item.error
    for value, interval, marker, size, shift in (
        (error.rms, error.rms_interval, "_", 8.0, -0.02),
        (error.median, error.median_interval, "o", 3.0, 0.02),
    ):
        if value is None or value <= 0.0:
            continue
        if interval is not None and interval[0] > 0.0:
            axes.plot([place + shift] * 2, interval, color=colour, linewidth=1.0)
        axes.plot(place + shift, value, marker, color=colour, markersize=size, markeredgewidth=1.6)


def _draw_channels(axes: Any, mode: DriveModeResult) -> None:
    axes.set_title("Residual over noise, windows with free initial states, unseen part (1: nothing left to explain)")
    names = [c.channel for c in mode.report.residuals[0].channels]
    if not names:
        return nothing_to_draw(axes, "no part of the recording is unseen")
    for model, table in enumerate(mode.report.residuals):
        colour = MODEL_STYLES[table.model][1]
        places = np.arange(len(names)) + 0.3 * (model - 0.5 * (len(mode.report.residuals) - 1))
        axes.bar(places, [c.relative - 1.0 for c in table.channels], width=0.28, bottom=1.0, color=colour)
    axes.axhline(1.0, color=palette.INK, linewidth=0.8)
    _log_scale(axes)
    axes.set_ylabel("[-]")
    axes.set_xticks(range(len(names)), [_LABELS[name] for name in names])
    axes.tick_params(axis="x", length=0.0)
    axes.grid(False, axis="x")
    return None


def _draw_bins(figure: Any, mode: DriveModeResult, channel: str, bottom: float, height: float, last: bool) -> None:
    limit = 0.0
    panels = []
    for column, (against, (unit, _)) in enumerate(BIN_QUANTITIES.items()):
        axes = figure.add_axes((0.115 + 0.1765 * column, bottom, 0.15, height))
        panels.append(axes)
        axes.axhline(0.0, color=palette.GREY, linewidth=0.6)
        for table in mode.report.residuals:
            for bins in table.regimes:
                if bins.channel != channel or bins.against != against:
                    continue
                centres, means, spread = (np.array(v) for v in (bins.centres, bins.means, bins.deviations))
                colour = MODEL_STYLES[table.model][1]
                axes.fill_between(centres, means - 2 * spread, means + 2 * spread, color=colour, alpha=0.2, linewidth=0)
                axes.plot(centres, means, "o-", color=colour, markersize=2.5, linewidth=1.0)
                limit = max(limit, float(np.quantile(np.abs(means) + spread, 0.95)))
        axes.tick_params(labelleft=column == 0)
        if last:
            name = {"slip": "mean size of slip ratio"}.get(against, against.replace("_", " "))
            axes.set_xlabel(f"{name} [{unit}]")
    for axes in panels:
        axes.set_ylim(-1.3 * (limit or 1.0), 1.3 * (limit or 1.0))
    panels[0].set_ylabel(f"{_LABELS[channel]}\n[{_unit(channel)}]")
    panels[0].yaxis.set_label_coords(-0.4, 0.5)


def _unit(channel: str) -> str:
    from ddagr_gym.recordings.channels import CHANNELS as SCHEMA

    return SCHEMA[channel].unit.replace("^2", "²")
