"""Currents and voltages as they were recorded, over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ddagr_gym.recordings.channels import CURRENTS, VOLTAGES
from ddagr_gym.recordings.checks.signals import filled
from ddagr_gym.recordings.schema import FloatArray, Recording
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import PAGE_WIDTH

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MOST_POINTS = 6000
"""Drawn of a line, about (ours: several for each pixel of its width)."""

ABOVE: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0)}
"""Place of a legend above its axes."""

_ROW = 2.3
"""Height of each recording in the figure [inches]."""


def has_currents(recording: Recording) -> bool:
    """Whether a recording holds a current or a voltage."""
    return any(recording.has(name) for name in (*CURRENTS, *VOLTAGES))


def currents_figure(recordings: Sequence[Recording], facecolor: str = "white") -> Figure:
    """Currents and voltages of recordings, one below the other; call inside
    :func:`ddagr_gym.reporting.figures.house_style`.

    Args:
        recordings: with a current or a voltage each.
        facecolor: behind the axes.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(PAGE_WIDTH, 0.2 + _ROW * len(recordings)), layout="constrained", facecolor=facecolor)
    for axes, recording in zip(figure.subplots(len(recordings), 1, squeeze=False)[:, 0], recordings, strict=True):
        draw_currents(axes, recording)
        axes.set_xlabel(f"time of {recording.meta.source} [s]")
    return figure


def gapped(recording: Recording, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Time and values with a NaN between spans, thinned, so that no line crosses a gap.

    Args:
        recording: whose spans they are.
        values: (n,).
    """
    parts = []
    step = max(1, len(recording) // _MOST_POINTS)
    for span in recording.spans():
        rows = np.arange(span.start, span.stop, step)
        parts.append(np.stack([np.append(recording.t[rows], recording.t[rows[-1]]), np.append(values[rows], np.nan)]))
    joined = np.concatenate(parts, axis=1) if parts else np.empty((2, 0))
    return joined[0], joined[1]


def draw_currents(axes: Any, recording: Recording) -> None:
    """Currents of both banks, and voltages on an axis of their own, over time.

    Args:
        axes: matplotlib's.
        recording: with at least one of these channels.
    """
    for name, colour in zip(CURRENTS, (palette.RIGHT, palette.LEFT), strict=True):
        if recording.has(name):
            values = gapped(recording, filled(recording, name))
            axes.plot(*values, color=colour, lw=0.8, drawstyle="steps-post", label=name.replace("_", " "))
    axes.set_ylabel("current [A]")
    axes.set_xlabel("time [s]")
    axes.margins(x=0)
    if axes.lines:
        axes.legend(ncols=2, **ABOVE)
    voltages = [name for name in VOLTAGES if recording.has(name)]
    if voltages:
        other = axes.twinx()
        for name, colour in zip(VOLTAGES, (palette.RIGHT, palette.LEFT, palette.INK), strict=True):
            if name in voltages:
                values = gapped(recording, filled(recording, name))
                other.plot(*values, color=colour, lw=0.8, ls=":", label=name.replace("_", " "))
        other.set_ylabel("voltage, dotted [V]")
        other.grid(visible=False)
        other.legend(ncols=3, loc="lower left", bbox_to_anchor=(0.0, 1.0))
