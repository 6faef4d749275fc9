"""Figures of a calibration: each drive before and after, parameters beside the data sheet, errors, what is left."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.calibration.forecast_errors import Forecasts
from ddagr_gym.calibration.result import (
    CALIBRATED,
    DATA_SHEET,
    KINEMATIC,
    CalibratedParameter,
    Calibration,
    ForecastError,
)
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.calibration_text import MODEL_LABELS, error_label, is_difference, parameter_label
from ddagr_gym.reporting.figures import DASHED, PAGE_WIDTH, blank_figure
from ddagr_gym.reporting.plain_axes import plain_log

Array = NDArray[np.float64]
Figure = Any

MODEL_STYLES: dict[str, tuple[str, Any]] = {
    DATA_SHEET: (palette.VERMILLION, DASHED),
    CALIBRATED: (palette.BLUE, "-"),
    KINEMATIC: (palette.GREEN, (0, (1, 1.4))),
}
"""Colour and line of each model."""

DRAWN = (("wheel_speed", None), ("heading", 5.0), ("position", 5.0))
"""Errors of the picture of errors: metric and horizon."""

_FARTHEST = 8.0
"""Data-sheet deviations beyond which a parameter is drawn at the edge (ours)."""

_NEAREST = 2.0
"""That the picture reaches to at the least, so that the band of one is seen (ours)."""

_CHANNELS = (("encoder_right", "right wheels"), ("encoder_left", "left wheels"), ("yaw_rate", "yaw rate"))


def typical_window(forecasts: Forecasts) -> int:
    """Window in which the calibrated simulator's wheel speeds err as much as in the median one."""
    columns = [CHANNELS.index("encoder_right"), CHANNELS.index("encoder_left")]
    error = (forecasts.predictions[CALIBRATED] - forecasts.windows.measured)[..., columns]
    known = np.isfinite(error)
    size = np.where(known, error, 0.0) ** 2
    mean = size.sum(axis=(1, 2)) / np.maximum(known.sum(axis=(1, 2)), 1)
    moving = np.abs(np.diff(forecasts.windows.commands, axis=1)).max(axis=(1, 2)) > 0.0
    rows = np.flatnonzero(moving & known.any(axis=(1, 2)))
    rows = rows if rows.size else np.arange(len(mean))
    return int(rows[np.argsort(mean[rows], kind="stable")[rows.size // 2]])


def drive_figure(forecasts: Forecasts) -> Figure:
    """Wheel speeds and yaw rate of a typical window: command, measured, data sheet, calibrated."""
    w, windows = typical_window(forecasts), forecasts.windows
    figure = blank_figure(4.6)
    axes = figure.subplots(3, 1, sharex=True)
    t = windows.period * np.arange(1, windows.samples + 1)
    commands = windows.commands[w, windows.history : windows.history + windows.samples]
    for row, (name, title) in enumerate(_CHANNELS):
        axis, channel = axes[row], CHANNELS.index(name)
        if row < 2:
            axis.step(t, commands[:, row], where="pre", color=palette.GREY, lw=0.9, label="command")
        for model in (DATA_SHEET, CALIBRATED):
            colour, line = MODEL_STYLES[model]
            axis.plot(t, forecasts.predictions[model][w, :, channel], color=colour, ls=line, label=MODEL_LABELS[model])
        measured = windows.measured[w, :, channel]
        known = np.isfinite(measured)
        axis.plot(t[known], measured[known], ".", ms=3.5, color=palette.INK, label="measured")
        axis.set_ylabel(f"{title}\n[rad/s]")
    axes[0].legend(ncols=4, loc="lower left", bbox_to_anchor=(0.0, 1.0), handletextpad=0.5, columnspacing=1.2)
    axes[-1].set_xlabel(f"time from {windows.time[w]:.0f} s of the drive [s]")
    return figure


def parameter_figure(items: Sequence[CalibratedParameter]) -> Figure:
    """Calibrated parameters with their intervals and the drives' own estimates, in deviations of the data sheet."""
    figure = blank_figure(0.9 + 0.27 * len(items), PAGE_WIDTH)
    axis = figure.subplots()
    axis.axvspan(-1.0, 1.0, color=palette.SHADE, zorder=0)
    axis.axvline(0.0, color=palette.GREY, lw=0.8, zorder=1)
    for row, item in enumerate(items):
        _draw_parameter(axis, len(items) - 1 - row, item)
    axis.set_yticks(range(len(items)), [parameter_label(item) for item in reversed(items)])
    axis.set_ylim(-0.6, len(items) - 0.4)
    farthest = max((abs(x) for item in items for x in (*_drive_places(item), *_places(item))), default=0.0)
    reach = 1.05 * min(max(farthest, _NEAREST), _FARTHEST)
    axis.set_xlim(-reach, reach)
    edge = f" (beyond {_FARTHEST:g}: at the edge)" if farthest > _FARTHEST else ""
    axis.set_xlabel(f"from the value expected, in its standard deviations{edge}")
    return figure


def _draw_parameter(axis: Any, row: float, item: CalibratedParameter) -> None:
    for place in _drive_places(item):
        axis.plot(_inside(place), row + 0.22, ".", ms=3.5, color=palette.PALE, zorder=2)
    here, *ends = map(_inside, _places(item))
    if ends:
        axis.plot(ends, [row, row], color=palette.BLUE, lw=2.2, solid_capstyle="butt", zorder=3)
    axis.plot(here, row, "o", ms=4.5, color=palette.BLUE, zorder=4)


def _drive_places(item: CalibratedParameter) -> list[float]:
    """What single drives say, from the value expected, in its standard deviations."""
    return [_place(item, _as_value(item, estimate.value)) for estimate in item.estimates]


def _places(item: CalibratedParameter) -> list[float]:
    """The value and, where it is known, the ends of its interval, likewise."""
    return [_place(item, value) for value in (_as_value(item, item.change), *(item.interval or ()))]


def _place(item: CalibratedParameter, value: float) -> float:
    return (value - item.expected) / item.expected_deviation


def _as_value(item: CalibratedParameter, change: float) -> float:
    """Value of a change that the fit would make: a sum, or a factor through the parameter's own."""
    if is_difference(item) or item.value is None or item.change == 0.0:
        return item.expected + change
    return float(item.expected + (item.value - item.expected) * np.expm1(change) / np.expm1(item.change))


def _inside(x: float) -> float:
    return float(np.clip(x, -_FARTHEST, _FARTHEST))


def error_figure(calibration: Calibration) -> Figure:
    """Errors on left-out drives of all models, with their intervals, one panel for each kind."""
    drives = list(dict.fromkeys(item.drive for item in calibration.forecasts))
    figure = blank_figure(1.2 + 0.42 * len(drives), PAGE_WIDTH)
    panels = [figure.subplots(1, len(DRAWN), sharey=True)][0]
    for axis, (metric, horizon) in zip(panels, DRAWN, strict=True):
        chosen = [e for e in calibration.forecasts if (e.metric, e.horizon) == (metric, horizon)]
        for item in chosen:
            _draw_error(axis, len(drives) - 1 - drives.index(item.drive), item)
        unit = chosen[0].unit if chosen else ""
        plain_log(axis)
        axis.set_xlabel(f"{error_label(metric, horizon)} [{unit}]")
        axis.set_ylim(-0.6, len(drives) - 0.4)
    panels[0].set_yticks(range(len(drives)), [_short(name) for name in reversed(drives)])
    handles, labels = panels[0].get_legend_handles_labels()
    found = dict(zip(labels, handles, strict=True))
    figure.legend(found.values(), found.keys(), ncols=3, loc="outside upper left")
    return figure


def _short(name: str) -> str:
    return name.split(".", 1)[0] + ("" if ", " not in name else ", " + name.split(", ", 1)[1])


def _draw_error(axis: Any, place: float, item: ForecastError) -> None:
    size, interval = (item.median, item.median_interval) if item.horizon is None else (item.rms, item.rms_interval)
    if size is None:
        return
    colour, _ = MODEL_STYLES[item.model]
    shifted = place + {DATA_SHEET: 0.18, CALIBRATED: 0.0, KINEMATIC: -0.18}[item.model]
    axis.plot(size, shifted, "o", ms=4, color=colour, label=MODEL_LABELS[item.model])
    if interval is not None:
        axis.plot(interval, [shifted, shifted], color=colour, lw=1.4)


def spectrum_figure(calibration: Calibration) -> Figure:
    """Spectra of the residuals on left-out drives, before and after."""
    from matplotlib.ticker import LogLocator, NullFormatter

    figure = blank_figure(2.6, PAGE_WIDTH)
    panels = figure.subplots(1, max(len(calibration.spectra), 1), squeeze=False)[0]
    for axis, item in zip(panels, calibration.spectra, strict=False):
        for model, density in ((DATA_SHEET, item.before), (CALIBRATED, item.after)):
            colour, line = MODEL_STYLES[model]
            axis.loglog(item.frequency, density, color=colour, ls=line, label=MODEL_LABELS[model])
        axis.set_title(item.channel.replace("_", " "))
        axis.set_xlabel("frequency [Hz]")
        axis.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.xaxis.set_major_formatter("{x:g}")
        for scale in (axis.xaxis, axis.yaxis):
            scale.set_minor_formatter(NullFormatter())
    panels[0].set_ylabel("residual [(rad/s)²/Hz]")
    panels[0].legend()
    return figure


def unexplained_figure(calibration: Calibration) -> Figure:
    """What is left of wheel speeds and yaw rate under each condition, over the sensor's noise."""
    channels = list(dict.fromkeys(item.channel for item in calibration.unexplained))
    conditions = list(dict.fromkeys(item.condition for item in calibration.unexplained))
    figure = blank_figure(0.9 + 0.27 * len(conditions), PAGE_WIDTH)
    panels = figure.subplots(1, max(len(channels), 1), sharey=True, squeeze=False)[0]
    for axis, channel in zip(panels, channels, strict=True):
        for item in calibration.unexplained:
            if item.channel == channel:
                place = len(conditions) - 1 - conditions.index(item.condition)
                axis.barh(place, item.rms, 0.6, color=palette.BLUE, zorder=2)
                axis.text(item.rms, place, f" {100.0 * item.share:.0f} %", va="center", fontsize=7, color=palette.GREY)
                axis.axvline(item.noise, color=palette.GREY, lw=0.8, ls=DASHED, zorder=3)
        axis.set_xlabel(f"r.m.s. residual of {channel.replace('_', ' ')} [rad/s]; noise dashed")
        axis.margins(x=0.12)
    panels[0].set_yticks(range(len(conditions)), list(reversed(conditions)))
    return figure
