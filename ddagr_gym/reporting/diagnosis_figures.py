"""Figures of a diagnosis: where the mismatch is, what each channel says before and after, scores, regimes, forces."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.recordings.schema import CHANNELS as SCHEMA
from ddagr_gym.replay.windows import CHANNELS
from ddagr_gym.reporting import palette
from ddagr_gym.reporting.evidence import Evidence
from ddagr_gym.reporting.figures import DASHED

Array = NDArray[np.float64]

RAW = "#9AA1A8"
BEFORE = palette.VERMILLION
AFTER = palette.BLUE
LABELS = {
    "specific_force_x": "specific force, forward", "specific_force_y": "specific force, to the left",
    "yaw_rate": "yaw rate", "encoder_right": "right encoder", "encoder_left": "left encoder",
    "pose_x": "position x", "pose_y": "position y", "pose_yaw": "heading",
}  # fmt: skip
REGIME_LABELS = {
    "speed": "speed [m/s]", "slip": "slip [-]", "turning": "size of the yaw rate [rad/s]",
    "yaw_rate": "yaw rate [rad/s]", "heading": "heading [degrees]", "command": "larger command [rad/s]",
    "command_change": "change of command [rad/s]", "time": "time [s]",
}  # fmt: skip
MODELS = (("raw", "nominal", RAW), ("nominal", "refitted", BEFORE), ("corrected", "corrected", AFTER))
_LINES: Mapping[str, Any] = {"raw": (0, (1, 1.4)), "nominal": DASHED, "corrected": "-"}

STRETCH = 20.0
"""Length of the stretch whose channels are drawn [s]."""
BINS = 8
_WIDTH = 5.4
_LEAST_WIDTH = 0.05
_TRANSPARENT = {"facecolor": "none"}

Figure = Any


def _figure(height: float, width: float = _WIDTH) -> Figure:
    from matplotlib.figure import Figure as Canvas

    return Canvas(figsize=(width, height), layout="constrained", **_TRANSPARENT)


def unit_of(channel: str) -> str:
    """Unit of a channel as people write it."""
    return SCHEMA[channel].unit.replace("^2", "²")


def present(evidence: Evidence) -> list[str]:
    """Channels with samples."""
    return [name for k, name in enumerate(CHANNELS) if np.isfinite(evidence.measured[..., k]).any()]


def map_figures(evidence: Evidence, findings: Sequence[Mapping[str, Any]] = ()) -> tuple[Figure, ...]:
    """The drives coloured by their mismatch: as the simulator stands, refitted, corrected; on one scale.

    Args:
        evidence: of the diagnosis.
        findings: whose places and slopes are drawn.
    """
    titles = ("The simulator as it stands", "Refitted, nothing added", "Corrected")
    sizes = [np.sqrt(evidence.roughness(model).mean(axis=1)) for model, _, _ in MODELS]
    top = max(float(np.quantile(np.concatenate(sizes), 0.97)), 1.5)
    return tuple(_map(evidence, size, top, text, findings) for size, text in zip(sizes, titles, strict=True))


def _map(evidence: Evidence, size: Array, top: float, title: str, findings: Sequence[Mapping[str, Any]]) -> Figure:
    """Map with sizes (W,) of the windows."""
    from matplotlib.collections import LineCollection
    from matplotlib.colors import LinearSegmentedColormap, Normalize

    points = evidence.path[..., :2]
    figure = _figure(3.9, 3.6)
    axes = figure.subplots()
    _draw_places(axes, evidence, findings)
    colours = LinearSegmentedColormap.from_list("mismatch", ["#D3D8DC", "#EFC27A", BEFORE, "#6E1F00"])
    order = np.argsort(size, kind="stable")
    lines = LineCollection(
        list(points[order]), cmap=colours, norm=Normalize(min(0.7, 0.5 * top), top), linewidths=2.4, capstyle="round"
    )
    lines.set_array(size[order])
    axes.add_collection(lines)
    axes.autoscale_view()
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="x [m]", ylabel="y [m]", title=title)
    bar = figure.colorbar(lines, ax=axes, location="bottom", shrink=0.8, aspect=34, pad=0.02, extend="both")
    bar.set_label("lasting residual over noise")
    bar.outline.set_visible(False)
    return figure


def _draw_places(axes: Any, evidence: Evidence, findings: Sequence[Mapping[str, Any]]) -> None:
    """Circles of places, and an arrow uphill in the corner where a slope was named."""
    from matplotlib.patches import Circle

    for finding in findings:
        for place in (finding.get("where") or {}).get("places") or []:
            centre = (place["x"], place["y"])
            axes.add_patch(Circle(centre, place["radius"], facecolor=palette.BED, edgecolor=palette.GREY, zorder=0.5))
        parameters = finding.get("parameters") or {}
        if finding.get("name") == "slope" and "direction" in parameters:
            turned = np.pi * (parameters["angle"]["value"] < 0.0)
            direction = parameters["direction"]["value"] + turned
            step = 0.07 * np.array([np.cos(direction), np.sin(direction)])
            middle = np.array([0.9, 0.88])
            axes.annotate(
                "", xy=middle + step, xytext=middle - step, xycoords="axes fraction", textcoords="axes fraction",
                arrowprops={"arrowstyle": "-|>", "color": palette.INK, "linewidth": 1.4},
            )  # fmt: skip
            axes.text(0.9, 0.76, "uphill", transform=axes.transAxes, ha="center", va="top", fontsize=7.5)


def best_stretch(evidence: Evidence, seconds: float = STRETCH) -> NDArray[np.int64]:
    """Successive windows of one recording in which the corrected model gains most; from the start where none does."""
    fall = (evidence.roughness("nominal") - evidence.roughness("corrected")).mean(axis=1)
    count = max(round(seconds / evidence.duration), 1)
    best, chosen = -np.inf, np.arange(0)
    for number in np.unique(evidence.recording):
        rows = np.flatnonzero(evidence.recording == number)
        rows = rows[np.argsort(evidence.time[rows], kind="stable")]
        sums = np.convolve(fall[rows], np.ones(min(count, len(rows))), mode="valid")
        first = int(sums.argmax())
        if sums[first] > best:
            best, chosen = float(sums[first]), rows[first : first + count]
    return chosen


def channel_figure(evidence: Evidence, channel: str, rows: NDArray[np.int64]) -> Figure:
    """Measured and predicted block means of a channel over a stretch; below what lasts of the residuals, over noise.

    Args:
        evidence: of the diagnosis.
        channel: name.
        rows: windows of one recording, in the order of time.
    """
    k = CHANNELS.index(channel)
    time = evidence.time[rows, None] + evidence.block * (np.arange(evidence.path.shape[1]) + 0.5)
    pieces = evidence.time[rows, None] + evidence.piece * (np.arange(evidence.places.shape[1]) + 0.5)
    figure = _figure(2.7)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.9, 1.0))
    angle = 180.0 / np.pi if channel == "pose_yaw" else 1.0
    upper.plot(time.ravel(), angle * evidence.measured[rows, :, k].ravel(), ".", color=palette.INK, markersize=2.2)
    lower.axhspan(-2.0, 2.0, color=palette.SHADE, linewidth=0.0)
    for model, _, colour in MODELS:
        values = angle * getattr(evidence, model)[rows, :, k]
        upper.plot(*_broken(time, values), color=colour, linestyle=_LINES[model], linewidth=1.2)
        lower.plot(*_broken(pieces, evidence.lasting(model)[rows, :, k]), ".-", color=colour, linewidth=1.0,
                   markersize=3.0)  # fmt: skip
    unit = "degrees" if channel == "pose_yaw" else unit_of(channel)
    upper.set(title=f"{LABELS[channel][:1].upper()}{LABELS[channel][1:]} [{unit}]")
    lower.set(xlabel="time [s]", ylabel="residual\n/ noise", xlim=(time[0, 0], time[-1, -1]))
    figure.align_ylabels([upper, lower])
    return figure


def _broken(time: Array, values: Array) -> tuple[Array, Array]:
    """Line over (W, B) points that skips blocks without a sample and breaks between windows."""
    xs, ys = [], []
    for t, v in zip(time, values, strict=True):
        known = np.isfinite(v)
        xs.append(np.append(t[known], np.nan))
        ys.append(np.append(v[known], np.nan))
    return np.concatenate(xs), np.concatenate(ys)


def misfit_figure(misfit: Mapping[str, Mapping[str, float | None]]) -> Figure:
    """Mean square residual of each channel before and after, with the limit of drives that lack nothing.

    Args:
        misfit: "nominal", "corrected" and "limit" by channel.
    """
    names = [name for name in CHANNELS if name in misfit.get("nominal", {})]
    figure = _figure(0.9 + 0.34 * max(len(names), 1))
    axes = figure.subplots()
    place = np.arange(len(names))[::-1]
    for shift, (model, label, colour) in zip((0.19, -0.19), MODELS[1:], strict=True):
        sizes = [_root(misfit.get(model, {}).get(name)) for name in names]
        axes.barh(place + shift, sizes, height=0.34, color=colour, label=label)
    for name, y in zip(names, place, strict=True):
        limit = _root(misfit.get("limit", {}).get(name))
        if limit > 0.0:
            axes.plot([limit, limit], [y - 0.42, y + 0.42], color=palette.INK, linewidth=1.4)
    axes.plot([], [], color=palette.INK, linewidth=1.4, label="limit of the null drives")
    axes.set_yticks(place, [LABELS[name] for name in names])
    axes.tick_params(axis="y", length=0.0)
    axes.grid(False, axis="y")
    axes.set(xlabel="residual over noise, r.m.s.")
    axes.legend(ncols=3, loc="lower left", bbox_to_anchor=(-0.25, 1.0), columnspacing=1.0)
    return figure


def _root(value: float | None) -> float:
    return float(np.sqrt(value)) if value is not None and value > 0.0 else 0.0


def gain_figure(evidence: Evidence, title_of: Callable[[str], str]) -> Figure:
    """Gain of every effect at the nominal and at the corrected model, with the null band up to its gate.

    Args:
        evidence: of the diagnosis.
        title_of: name of an effect for people.
    """
    order = np.argsort(evidence.gains, kind="stable")
    figure = _figure(0.9 + 0.2 * len(order))
    axes = figure.subplots()
    low = 0.3
    places = np.arange(len(order))
    gates = evidence.gates[order]
    known = np.isfinite(gates) & (gates > low)
    if known.any():
        axes.barh(
            places[known], gates[known] - low, left=low, height=1.0, color="#E8E4D9",
            label="reached with nothing missing",
        )  # fmt: skip
    for values, size, colour, label in (
        (evidence.gains[order], 5.0, BEFORE, "nominal model"), (evidence.left[order], 3.6, AFTER, "corrected model")
    ):  # fmt: skip
        axes.plot(np.maximum(values, low), places, "o", color=colour, markersize=size, label=label)
    axes.set_xscale("log")
    axes.set_xlim(left=0.8 * low, right=2.0 * max(float(np.nanmax(evidence.gains, initial=1.0)), 10.0))
    axes.set_ylim(-0.7, len(order) - 0.3)
    axes.set_yticks(places, [title_of(evidence.effects[k]) for k in order])
    axes.tick_params(axis="y", length=0.0)
    axes.set(xlabel="what it would explain: fall of the cost (log scale)")
    axes.legend(ncols=3, loc="lower left", bbox_to_anchor=(-0.42, 1.0), columnspacing=1.0)
    return figure


def regime_figure(evidence: Evidence, name: str) -> Figure | None:
    """Mean residual over noise against a regime, before and after; None where it never changes.

    Args:
        evidence: of the diagnosis.
        name: of the regime.
    """
    values = evidence.regimes[evidence.regime_names.index(name)].ravel()
    factor = 180.0 / np.pi if name == "heading" else 1.0
    edges = np.unique(np.quantile(values[np.isfinite(values)], np.linspace(0.0, 1.0, BINS + 1)))
    if len(edges) < 3 or np.ptp(edges) <= 0.0:
        return None
    place = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    count = np.maximum(np.bincount(place, minlength=len(edges) - 1), 1)
    figure = _figure(1.9, 2.9)
    axes = figure.subplots()
    for model, _, colour in MODELS:
        squares = evidence.roughness(model).ravel()
        size = np.sqrt(np.bincount(place, squares, minlength=len(edges) - 1) / count)
        axes.stairs(size, factor * edges, color=colour, linewidth=1.6, baseline=None, linestyle=_LINES[model])
    axes.set(xlabel=REGIME_LABELS.get(name, name), ylabel="residual / noise")
    axes.set_ylim(bottom=0.0)
    axes.margins(x=0.02)
    return figure


def score_figure(evidence: Evidence, number: int, finding: Mapping[str, Any]) -> Figure:
    """Standardised score of one effect along each recording, with the stretches in which it shows.

    Args:
        evidence: of the diagnosis.
        number: of the effect among the evidence's findings.
        finding: entry of ``diagnosis.json`` with its ``where``.
    """
    recordings = np.unique(evidence.recording)
    figure = _figure(0.55 + 0.85 * len(recordings), 11.0)
    panels = figure.subplots(len(recordings), 1, squeeze=False)[:, 0]
    spread = np.sqrt(np.maximum(evidence.information[number], 1e-12))
    score = np.where(evidence.information[number] > 1e-6, evidence.score[number] / spread, 0.0)
    limits = (min(float(score.min()), -2.5), max(float(score.max()), 2.5))
    spans = (finding.get("where") or {}).get("spans") or []
    for axes, recording in zip(panels, recordings, strict=True):
        rows = np.flatnonzero(evidence.recording == recording)
        start = evidence.time[rows, None] + evidence.piece * np.arange(score.shape[1])
        axes.axhspan(-2.0, 2.0, color=palette.SHADE, linewidth=0.0)
        for span in spans:
            if span["recording"] == recording:
                axes.axvspan(span["start"], span["end"], color=palette.PALE_ORANGE, alpha=0.35, linewidth=0.0)
        axes.bar(start.ravel(), score[rows].ravel(), width=0.9 * evidence.piece, align="edge", color=palette.INK)
        axes.set(ylim=limits, xlim=(float(start.min()), float(evidence.time[rows].max()) + evidence.duration))
        axes.set_ylabel(f"recording {recording + 1}")
    panels[-1].set_xlabel("time [s]")
    return figure


def wrench_figures(evidence: Evidence) -> tuple[Figure, Figure]:
    """Residual force over the ground, averaged over cells, before and after, on one scale."""
    cells = [_force_cells(evidence, values) for values in (evidence.wrench_before, evidence.wrench_after)]
    clear = [c[2:4][:, c[4] > 2.0] for c in cells]
    longest = max([float(np.quantile(np.hypot(*c), 0.9)) for c in clear if c.shape[1]], default=1.0)
    return (
        _forces(evidence, cells[0], longest, "Refitted: force that is missing"),
        _forces(evidence, cells[1], longest, "Corrected: force that is still missing"),
    )


def _force_cells(evidence: Evidence, wrench: Array) -> Array:
    """(5, n) place x, y, force in world axes x, y, and its size over its standard deviation, by cell."""
    path = evidence.path[:, evidence.path.shape[1] // 2]
    extent = float(np.ptp(path[:, :2], axis=0).max())
    cell = max(extent / 8.0, 0.25)
    keys = np.floor((path[:, :2] - path[:, :2].min(axis=0)) / cell).astype(int)
    _, group = np.unique(keys, axis=0, return_inverse=True)
    found = []
    for k in range(int(group.max()) + 1):
        rows = np.flatnonzero(group == k)
        precision, total = np.zeros((2, 2)), np.zeros(2)
        for row in rows:
            cosine, sine = np.cos(path[row, 2]), np.sin(path[row, 2])
            turn = np.array([[cosine, -sine], [sine, cosine]])
            own = turn @ np.diag(evidence.wrench_deviation[row, :2] ** -2) @ turn.T
            precision += own
            total += own @ turn @ wrench[row, :2]
        force = np.linalg.solve(precision, total)
        found.append([*path[rows, :2].mean(axis=0), *force, np.sqrt(force @ precision @ force)])
    return np.array(found).T


def _forces(evidence: Evidence, cells: Array, longest: float, title: str) -> Figure:
    points = evidence.path[..., :2]
    span = np.ptp(points.reshape(-1, 2), axis=0)
    figure = _figure(4.2)
    axes = figure.subplots()
    for window in points:
        axes.plot(*window.T, color=palette.PALE, linewidth=1.0)
    x, y, force_x, force_y, clear = cells
    reach = 0.16 * max(float(span.max()), 0.5)
    steps = [f * 10.0**e for e in range(-3, 6) for f in (1.0, 2.0, 5.0)]
    key = max(step for step in steps if step <= max(longest, 1e-3))
    shorten = np.minimum(1.0, 2.0 * longest / np.maximum(np.hypot(force_x, force_y), 1e-12))
    for chosen, colour, width in ((clear <= 2.0, palette.PALE, 0.0035), (clear > 2.0, BEFORE, 0.006)):
        if chosen.any():
            arrows = axes.quiver(
                x[chosen], y[chosen], (force_x * shorten)[chosen], (force_y * shorten)[chosen], color=colour,
                angles="xy", scale_units="xy", scale=longest / reach, width=width, zorder=3,
            )  # fmt: skip
            axes.quiverkey(arrows, 0.86, 1.05, key, f"{key:g} N", labelpos="E") if colour == BEFORE else None
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="x [m]", ylabel="y [m]", title=title)
    return figure


def horizon_figure(channels: Mapping[str, Mapping[str, Any]], channel: str) -> Figure:
    """Held-out errors of one channel after each horizon: raw, refitted, corrected, and the ceiling.

    Args:
        channels: entry ``fit.channels`` of ``diagnosis.json``.
        channel: which.
    """
    horizons = list(channels[channel])
    arms = (
        ("raw", "nominal", palette.GREY), ("refitted", "nominal, refitted", BEFORE), ("corrected", "corrected", AFTER),
        ("ceiling", "flexible model (ceiling)", palette.GREEN),
    )  # fmt: skip
    figure = _figure(2.2, 2.9)
    axes = figure.subplots()
    for shift, (arm, _, colour) in zip((-0.27, -0.09, 0.09, 0.27), arms, strict=True):
        for place, horizon in enumerate(horizons):
            item = channels[channel][horizon].get(arm) or {}
            if item.get("value") is None:
                continue
            if item.get("interval"):
                axes.plot([place + shift] * 2, item["interval"], color=colour, linewidth=1.4)
            axes.plot(place + shift, item["value"], "o", color=colour, markersize=4.5)
    unit = next((channels[channel][h].get("unit") for h in horizons if channels[channel][h].get("unit")), "")
    axes.set_title(f"{LABELS.get(channel, channel.replace('_', ' '))} [{unit.replace('^2', '²')}]")
    axes.set_xticks(range(len(horizons)), [f"{float(h):g} s" for h in horizons])
    axes.set_xlim(-0.6, len(horizons) - 0.4)
    axes.set_ylim(bottom=0.0)
    axes.grid(False, axis="x")
    return figure
