"""Figures of a diagnosis: where the mismatch is, what each channel says before and after, scores, motion, forces."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.answer.certificate import Measured, ModelErrors
from ddagr_gym.diagnosis.answer.evidence import Evidence
from ddagr_gym.diagnosis.answer.location import EffectLocation
from ddagr_gym.diagnosis.wording import CHANNEL_NAMES
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.recordings.channels import CHANNELS as SCHEMA
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import DASHED, blank_figure

Array = NDArray[np.float64]

RAW = "#9AA1A8"
BEFORE = palette.VERMILLION
AFTER = palette.BLUE
CONDITION_LABELS = {
    "speed": "speed [m/s]", "slip": "slip [-]", "turning": "size of the yaw rate [rad/s]",
    "yaw_rate": "yaw rate [rad/s]", "heading": "heading [degrees]", "command": "larger command [rad/s]",
    "command_change": "change of command [rad/s]", "time": "time [s]",
}  # fmt: skip
MODELS = (("raw", "nominal", RAW), ("nominal", "refitted", BEFORE), ("corrected", "corrected", AFTER))
_LINES: Mapping[str, Any] = {"raw": (0, (1, 1.4)), "nominal": DASHED, "corrected": "-"}

STRETCH = 20.0
"""Length of the stretch whose channels are drawn [s]."""
MOST_POINTS = 2400
"""Points of the drives in one picture: enough for the paths of three minutes, and longer ones stay small."""
MOST_PATHS = 150
"""Windows whose paths are drawn as lines, which cost 300 bytes each and more; those of longer drives as pixels."""
MOST_BARS = 720
"""Bars in one picture of a score, about one per point of its width."""
BINS = 8
"""Bins of a picture, with about as many values each (ours)."""

_NARROWEST = 0.03
"""Width of a bin over that of all below which it joins its neighbour (ours: narrower ones cannot be distinguished)."""

_LEAST_GAIN = 0.5
"""Gain from which on an effect has a line in the picture of scores (ours: half a unit of log-likelihood is noise)."""

_FEWEST_EFFECTS = 8
"""Effects with a line at least, however small their gains (ours)."""

Figure = Any


def unit_of(channel: str) -> str:
    """Unit of a channel as people write it."""
    return SCHEMA[channel].unit.replace("^2", "²")


def present(evidence: Evidence) -> list[str]:
    """Channels with samples."""
    return [name for k, name in enumerate(CHANNELS) if np.isfinite(evidence.measured[..., k]).any()]


def thinned(evidence: Evidence) -> Array:
    """(W, b, 2) path of each window, of as many points as keep all within :data:`MOST_POINTS`, its ends at least.

    The ends of a window are those of its neighbours, so that the path stays whole.
    """
    windows, blocks = evidence.path.shape[:2]
    points = min(max(MOST_POINTS // windows, 2), blocks)
    kept = np.unique(np.linspace(0, blocks - 1, points).round().astype(int))
    return np.asarray(evidence.path[:, kept, :2])


def best_stretch(evidence: Evidence) -> NDArray[np.int64]:
    """Successive windows of one recording in which the corrected model gains most; from the start where none does."""
    fall = (evidence.roughness("nominal") - evidence.roughness("corrected")).mean(axis=1)
    count = max(round(STRETCH / evidence.duration), 1)
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
    figure = blank_figure(2.7)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.9, 1.0))
    measured = evidence.measured[rows, :, k]
    if channel == "pose_yaw":
        measured = np.degrees(_unwrapped(measured))
    upper.plot(time.ravel(), measured.ravel(), ".", color=palette.INK, markersize=2.4, rasterized=True)
    lower.axhspan(-2.0, 2.0, color=palette.SHADE, linewidth=0.0)
    for model, _, colour in MODELS:
        residual = (evidence.measured - getattr(evidence, model))[rows, :, k]
        values = measured - (np.degrees(residual) if channel == "pose_yaw" else residual)
        upper.plot(*_broken(time, values), color=colour, linestyle=_LINES[model], linewidth=1.2)
        lower.plot(*_broken(pieces, evidence.lasting(model)[rows, :, k]), color=colour, linewidth=1.3)
    reach = max(abs(limit) for limit in (*lower.get_ylim(), 3.0))
    lower.set_ylim(-reach, reach)
    unit = "degrees" if channel == "pose_yaw" else unit_of(channel)
    upper.set(title=f"{CHANNEL_NAMES[channel][:1].upper()}{CHANNEL_NAMES[channel][1:]} [{unit}]")
    lower.set(xlabel="time [s]", ylabel="residual\n/ noise", xlim=(time[0, 0], time[-1, -1]))
    figure.align_ylabels([upper, lower])
    return figure


def _unwrapped(values: Array) -> Array:
    """Headings (W, B) without jumps, NaN where there is none."""
    flat = values.ravel().copy()
    known = np.isfinite(flat)
    flat[known] = np.unwrap(flat[known])
    return flat.reshape(values.shape)


def lasting_figure(evidence: Evidence) -> Figure:
    """Size of what lasts of each channel's residual, over noise, of the three models."""
    names = present(evidence)
    figure = blank_figure(0.9 + 0.34 * max(len(names), 1))
    axes = figure.subplots()
    place = np.arange(len(names))[::-1]
    columns = [CHANNELS.index(name) for name in names]
    for shift, (model, label, colour) in zip((0.27, 0.0, -0.27), MODELS, strict=True):
        values = evidence.lasting(model)[..., columns]
        sizes = [np.sqrt(np.mean(v[np.isfinite(v)] ** 2)) for v in np.moveaxis(values, 2, 0)]
        axes.barh(place + shift, sizes, height=0.25, color=colour, label=label)
    axes.axvline(1.0, color=palette.INK, linewidth=0.8, linestyle=DASHED)
    _channel_axis(axes, names, place, "what lasts half a second, over noise, r.m.s.")
    return figure


def _channel_axis(axes: Any, names: Sequence[str], place: Any, label: str) -> None:
    axes.set_yticks(place, [CHANNEL_NAMES[name] for name in names])
    axes.tick_params(axis="y", length=0.0)
    axes.grid(False, axis="y")
    axes.set(xlabel=label)
    axes.legend(ncols=3, loc="lower left", bbox_to_anchor=(-0.25, 1.0), columnspacing=1.0)


def _broken(time: Array, values: Array) -> tuple[Array, Array]:
    """Line over (W, B) points that skips blocks without a sample and breaks between windows."""
    xs, ys = [], []
    for t, v in zip(time, values, strict=True):
        known = np.isfinite(v)
        xs.append(np.append(t[known], np.nan))
        ys.append(np.append(v[known], np.nan))
    return np.concatenate(xs), np.concatenate(ys)


def misfit_figure(misfit: Mapping[str, Mapping[str, float]]) -> Figure:
    """Mean square residual of each channel before and after, with the limit of drives that lack nothing.

    Args:
        misfit: "nominal", "corrected" and "limit" by channel.
    """
    names = [name for name in CHANNEL_NAMES if name in misfit.get("nominal", {})]
    figure = blank_figure(0.9 + 0.34 * max(len(names), 1))
    axes = figure.subplots()
    place = np.arange(len(names))[::-1]
    for shift, (model, label, colour) in zip((0.19, -0.19), MODELS[1:], strict=True):
        sizes = [_root(misfit.get(model, {}).get(name, math.nan)) for name in names]
        axes.barh(place + shift, sizes, height=0.34, color=colour, label=label)
    for name, y in zip(names, place, strict=True):
        limit = _root(misfit.get("limit", {}).get(name, math.nan))
        if limit > 0.0:
            axes.plot([limit, limit], [y - 0.42, y + 0.42], color=palette.INK, linewidth=1.4)
    axes.plot([], [], color=palette.INK, linewidth=1.4, label="limit of the null drives")
    _channel_axis(axes, names, place, "residual of 0.1 s means over noise, r.m.s.")
    return figure


def _root(value: float) -> float:
    return math.sqrt(value) if value > 0.0 and math.isfinite(value) else 0.0


def shown_effects(evidence: Evidence) -> NDArray[np.int64]:
    """Effects worth a line, least first: those that explain something before or after, and some at any rate."""
    largest = np.fmax(evidence.gains, evidence.left)
    order = np.argsort(evidence.gains, kind="stable")
    best = set(order[-_FEWEST_EFFECTS:].tolist())
    return np.array([k for k in order if largest[k] > _LEAST_GAIN or k in best], dtype=np.int64)


def gain_figure(evidence: Evidence, title_of: Callable[[str], str]) -> Figure:
    """Gain of every effect at the nominal and at the corrected model, with the null band up to its gate.

    Args:
        evidence: of the diagnosis.
        title_of: name of an effect for people.
    """
    order = shown_effects(evidence)
    figure = blank_figure(0.9 + 0.2 * len(order))
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
        (evidence.gains[order], 5.0, BEFORE, "refitted"), (evidence.left[order], 3.6, AFTER, "corrected")
    ):  # fmt: skip
        axes.plot(np.maximum(values, low), places, "o", color=colour, markersize=size, label=label)
    axes.set_xscale("log")
    axes.set_xlim(left=0.8 * low, right=2.0 * max(float(np.nanmax(evidence.gains, initial=1.0)), 10.0))
    axes.set_ylim(-0.7, len(order) - 0.3)
    axes.set_yticks(places, [title_of(evidence.effects[k]).replace("$", r"\$") for k in order])
    axes.tick_params(axis="y", length=0.0)
    axes.set(xlabel="what it would explain: fall of the cost (log scale)")
    axes.legend(ncols=3, loc="lower left", bbox_to_anchor=(-0.42, 1.0), columnspacing=1.0)
    return figure


def _edges(values: Array) -> Array:
    """Edges of bins with about as many values each, none too narrow to draw."""
    wanted = np.unique(np.quantile(values, np.linspace(0.0, 1.0, BINS + 1))) if len(values) else np.zeros(0)
    if len(wanted) < 2:
        return wanted
    kept = [float(wanted[0])]
    for edge in wanted[1:-1].tolist():
        if min(edge - kept[-1], wanted[-1] - edge) > _NARROWEST * np.ptp(wanted):
            kept.append(edge)
    return np.array([*kept, wanted[-1]])


def condition_figure(evidence: Evidence, name: str) -> Figure | None:
    """Mean residual over noise against an operating condition, before and after; None where it never changes.

    Args:
        evidence: of the diagnosis.
        name: of the operating condition.
    """
    values = evidence.regimes[evidence.regime_names.index(name)].ravel()
    factor = 180.0 / np.pi if name == "heading" else 1.0
    edges = _edges(values[np.isfinite(values)])
    if len(edges) < 3:
        return None
    place = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    count = np.maximum(np.bincount(place, minlength=len(edges) - 1), 1)
    figure = blank_figure(1.9, 2.9)
    axes = figure.subplots()
    top = 1.0
    for model, _, colour in MODELS:
        squares = evidence.roughness(model).ravel()
        size = np.sqrt(np.bincount(place, squares, minlength=len(edges) - 1) / count)
        top = max(top, float(size.max()))
        axes.stairs(size, factor * edges, color=colour, linewidth=1.6, baseline=None, linestyle=_LINES[model])
    axes.set(xlabel=CONDITION_LABELS.get(name, name), ylabel="residual / noise")
    axes.set_ylim(0.0, 1.08 * top)
    axes.margins(x=0.02)
    return figure


def score_figure(evidence: Evidence, number: int, where: EffectLocation | None) -> Figure:
    """Standardised score of one effect along each recording, with the stretches in which it shows.

    Args:
        evidence: of the diagnosis.
        number: of the effect among the evidence's findings.
        where: stretches in which it shows; None where nothing says.
    """
    recordings = np.unique(evidence.recording)
    figure = blank_figure(0.55 + 0.85 * len(recordings), 11.0)
    panels = figure.subplots(len(recordings), 1, squeeze=False)[:, 0]
    bars = [_bars(evidence, number, recording) for recording in recordings]
    every = np.concatenate([values for _, _, values in bars])
    limits = (min(float(every.min()), -2.5), max(float(every.max()), 2.5))
    spans = () if where is None else where.spans
    for axes, recording, (start, end, values) in zip(panels, recordings, bars, strict=True):
        axes.axhspan(-2.0, 2.0, color=palette.SHADE, linewidth=0.0)
        for span in spans:
            if span.recording == recording:
                axes.axvspan(span.start, span.end, color=palette.PALE_ORANGE, alpha=0.35, linewidth=0.0)
        none = np.zeros(len(values))
        outline = np.stack([[start, start, end, end], [none, values, values, none]])
        axes.fill(*outline.transpose(0, 2, 1).reshape(2, -1), color=palette.INK, linewidth=0.0)
        axes.set(ylim=limits, xlim=(float(start.min()), float(end.max())))
        axes.set_ylabel(f"recording {recording + 1}")
    panels[-1].set_xlabel("time [s]")
    return figure


def _bars(evidence: Evidence, number: int, recording: int) -> tuple[Array, Array, Array]:
    """Start, end and standardised score (n,) of successive pieces of a recording; of a long drive of several at once.

    Scores and their variances add up, so that a longer piece shows an effect as its parts do together.
    """
    rows = np.flatnonzero(evidence.recording == recording)
    rows = rows[np.argsort(evidence.time[rows], kind="stable")]
    pieces = evidence.score.shape[2]
    start = evidence.time[rows, None] + evidence.piece * np.arange(pieces)
    end = np.append(start[:, 1:], evidence.time[rows, None] + evidence.duration, axis=1)
    together = -(-evidence.score[number].size // MOST_BARS)
    first = np.arange(0, start.size, together)
    score, information = (
        np.add.reduceat(values[number, rows].ravel(), first) for values in (evidence.score, evidence.information)
    )
    last = np.append(first[1:], start.size) - 1
    shown = information > 1e-6
    standard = np.where(shown, score / np.sqrt(np.where(shown, information, 1.0)), 0.0)
    return start.ravel()[first], end.ravel()[last], standard


def horizon_figure(horizons: Mapping[str, ModelErrors], channel: str) -> Figure:
    """Held-out errors of one channel after each horizon: nominal, refitted, corrected, and the ceiling.

    Args:
        horizons: errors by horizon.
        channel: which.
    """
    models = (
        ("raw", "nominal", RAW), ("refitted", "refitted", BEFORE), ("corrected", "corrected", AFTER),
        ("ceiling", "ceiling", palette.GREEN),
    )  # fmt: skip
    figure = blank_figure(2.2, 2.9)
    axes = figure.subplots()
    for shift, (model, _, colour) in zip((-0.27, -0.09, 0.09, 0.27), models, strict=True):
        for place, errors in enumerate(horizons.values()):
            item: Measured = getattr(errors, model)
            if not math.isfinite(item.value):
                continue
            if item.interval is not None:
                axes.plot([place + shift] * 2, item.interval, color=colour, linewidth=1.4)
            axes.plot(place + shift, item.value, "o", color=colour, markersize=4.5)
    unit = next(iter(horizons.values())).unit
    axes.set_title(f"{CHANNEL_NAMES.get(channel, channel.replace('_', ' '))} [{unit.replace('^2', '²')}]")
    axes.set_xticks(range(len(horizons)), [f"{float(h):g} s" for h in horizons])
    axes.set_xlim(-0.6, len(horizons) - 0.4)
    axes.set_ylim(bottom=0.0)
    axes.grid(False, axis="x")
    return figure
