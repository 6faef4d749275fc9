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


_LEAST_SPAN = 0.1
"""Size over the stated one that is drawn to either side of it at the least (ours)."""

_NEAR_NOTHING = 0.5
"""Size over the stated one from which on nothing is drawn too (ours)."""


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
            axis.set_xmargin(0.01)
        axes[0].set_ylim(size_limits([size for size in onset.sizes if size.recording in numbers]))
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
        low, high = _interval(item)
        axis.fill_between([item.start, item.end], low, high, color=palette.BLUE, alpha=0.25, lw=0.0)
        if -_FARTHEST + 1.0 < item.size < _FARTHEST:
            axis.plot([item.start, item.end], [item.size, item.size], color=palette.BLUE, lw=1.6)


def _interval(item: TimedSize) -> tuple[float, float]:
    """Ends of a 90 % interval, as far as they are drawn."""
    half = _NINETY * item.deviation
    return max(item.size - half, -_FARTHEST + 1.0), min(item.size + half, _FARTHEST)


def size_limits(sizes: Sequence[TimedSize]) -> tuple[float, float]:
    """Vertical limits: all intervals and the stated size, nothing where an interval comes near it, and a margin."""
    ends = [end for item in sizes for end in _interval(item)]
    low, high = min(*ends, 1.0 - _LEAST_SPAN), max(*ends, 1.0 + _LEAST_SPAN)
    low = min(low, 0.0) if low < _NEAR_NOTHING else low
    margin = 0.06 * (high - low)
    return max(low - margin, -_FARTHEST + 1.0), min(high + margin, _FARTHEST)


def _draw_time(axis: Axes, onset: Onset) -> None:
    if onset.value is None or onset.interval is None:
        return
    axis.axvspan(*onset.interval, color=palette.VERMILLION, alpha=0.15, lw=0.0, zorder=0)
    axis.axvline(onset.value, color=palette.VERMILLION, lw=1.2)
