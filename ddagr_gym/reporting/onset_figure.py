"""Figure of the size of each named effect against time, with the time at which it began or ended."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ddagr_gym.diagnosis.answer.onset import CONSTANT
from ddagr_gym.diagnosis.wording import title
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import PAGE_WIDTH, blank_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ddagr_gym.diagnosis.answer.onset import Onset, TimedSize
    from ddagr_gym.diagnosis.answer.verdict import Finding

_NINETY = 1.645
"""Normal quantile of a 90 % interval."""

_MOST_RECORDINGS = 4
"""Recordings that have room side by side (ours)."""

_FARTHEST = 2.5
"""Size over the stated one up to which intervals are drawn whole (ours): what hardly shows an effect says less."""


def timed(findings: Sequence[Finding]) -> list[tuple[str, Onset]]:
    """Names and onsets of the findings that have sizes by time."""
    return [(item.name, item.onset) for item in findings if item.onset is not None and item.onset.sizes]


def onset_figure(findings: Sequence[Finding], recordings: Sequence[str]) -> Any:
    """Sizes by time, a row for each finding and a column for each recording.

    Args:
        findings: at least one with an onset, see :func:`timed`.
        recordings: names of the sources.
    """
    rows = timed(findings)
    numbers = _shown(rows)
    figure = blank_figure(0.7 + 1.9 * len(rows), PAGE_WIDTH)
    grid = figure.subplots(len(rows), len(numbers), squeeze=False, sharey="row", sharex="col")
    for axes, (name, onset) in zip(grid, rows, strict=True):
        for axis, number in zip(axes, numbers, strict=True):
            _draw(axis, [size for size in onset.sizes if size.recording == number])
            if onset.kind != CONSTANT and onset.recording == number:
                _draw_time(axis, onset)
        axes[0].set_ylabel(f"{title(name)}\nsize over the stated one")
    for axis, number in zip(grid[0], numbers, strict=True):
        name = recordings[number] if number < len(recordings) else f"recording {number + 1}"
        axis.set_title(name.replace("$", r"\$"), fontsize=8)
    for axis in grid[-1]:
        axis.set_xlabel("time [s]")
    return figure


def _shown(rows: Sequence[tuple[str, Onset]]) -> list[int]:
    """Numbers of the recordings that are drawn: those in which something changes, and the first ones."""
    every = sorted({size.recording for _, onset in rows for size in onset.sizes})
    changing = {onset.recording for _, onset in rows if onset.kind != CONSTANT}
    return sorted(sorted(every, key=lambda number: (number not in changing, number))[:_MOST_RECORDINGS])


def _draw(axis: Axes, sizes: Sequence[TimedSize]) -> None:
    """Intervals as bands and sizes as lines, one for each stretch."""
    axis.axhline(0.0, color=palette.GREY, lw=0.8)
    axis.axhline(1.0, color=palette.GREY, lw=0.8, ls=":")
    for item in sizes:
        half = _NINETY * item.deviation
        low, high = max(item.size - half, -_FARTHEST + 1.0), min(item.size + half, _FARTHEST)
        axis.fill_between([item.start, item.end], low, high, color=palette.BLUE, alpha=0.25, lw=0.0)
        if -_FARTHEST + 1.0 < item.size < _FARTHEST:
            axis.plot([item.start, item.end], [item.size, item.size], color=palette.BLUE, lw=1.6)
    axis.set_ylim(-_FARTHEST + 1.0, _FARTHEST)


def _draw_time(axis: Axes, onset: Onset) -> None:
    if onset.value is None or onset.interval is None:
        return
    axis.axvspan(*onset.interval, color=palette.VERMILLION, alpha=0.15, lw=0.0, zorder=0)
    axis.axvline(onset.value, color=palette.VERMILLION, lw=1.2)
