"""Figure of motor currents: what was measured of a left-out drive, and what the calibrated simulator forecast."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ddagr_gym.calibration.forecast_errors import Forecasts
from ddagr_gym.identification.motor_currents import BANKS
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import PAGE_WIDTH, blank_figure

Figure = Any


def current_figure(forecasts: Sequence[Forecasts]) -> Figure:
    """Measured and forecast currents of both banks over time, and one against the other.

    Args:
        forecasts: of one drive, or of its parts, with currents.
    """
    figure = blank_figure(4.4, PAGE_WIDTH)
    grid = figure.add_gridspec(2, 2, width_ratios=(3.2, 1.0))
    first = None
    for k, bank in enumerate(BANKS):
        along = figure.add_subplot(grid[k, 0], sharex=first)
        first = along if first is None else first
        _draw_over_time(along, forecasts, k)
        along.set_ylabel(f"{bank} current [A]")
        _draw_against(figure.add_subplot(grid[k, 1]), forecasts, k, bank)
        if k == 0:
            along.legend(ncols=2, loc="lower left", bbox_to_anchor=(0.0, 1.0))
            along.tick_params(labelbottom=False)
        else:
            along.set_xlabel("time [s]")
    return figure


def _draw_over_time(axes: Any, forecasts: Sequence[Forecasts], bank: int) -> None:
    for n, item in enumerate(forecasts):
        if item.currents is None:
            continue
        measured, forecast = (values[..., bank] for values in item.currents)
        windows = item.windows
        t = windows.time[:, None] + windows.period * np.arange(1, windows.samples + 1)
        # a NaN behind each window, so that no line joins two
        ends = np.full((len(t), 1), np.nan)
        line = (np.concatenate([values, ends], axis=1).ravel() for values in (t, forecast))
        label = "calibrated simulator" if n == 0 else None
        axes.plot(*line, color=palette.BLUE, lw=0.9, label=label)
        axes.plot(t, measured, ".", ms=3.5, color=palette.INK)
        axes.plot([], [], ".", ms=3.5, color=palette.INK, label="measured" if n == 0 else None)


def _draw_against(axes: Any, forecasts: Sequence[Forecasts], bank: int, name: str) -> None:
    pairs = [
        (forecast[..., bank][known], measured[..., bank][known])
        for item in forecasts
        if item.currents is not None
        for measured, forecast in [item.currents]
        for known in [np.isfinite(measured[..., bank])]
    ]
    x, y = (np.concatenate(column) for column in zip(*pairs, strict=True))
    axes.plot(x, y, ".", ms=3.5, color=palette.INK)
    if x.size:
        ends = [min(x.min(), y.min()), max(x.max(), y.max())]
        axes.plot(ends, ends, color=palette.GREY, lw=0.8)
    axes.set_xlabel(f"{name}, forecast [A]")
    axes.set_ylabel("measured [A]")
