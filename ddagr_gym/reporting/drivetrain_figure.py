"""Figures of a diagnosis that asked for the drivetrain: what its parts are worth where nothing was fitted."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ddagr_gym.diagnosis.answer.drivetrain import PART_TITLES, DrivetrainAnswer
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.diagnosis_figures import AFTER, RAW
from ddagr_gym.reporting.drivetrain_section import forecast_label, grouped_forecasts, root_mean_square
from ddagr_gym.reporting.figures import blank_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_ROW = 0.22
"""Height of a row [inch]."""


def part_figure(answer: DrivetrainAnswer) -> Figure:
    """By how much forecasts of what was left out become worse without each part, with standard errors."""
    figure: Figure = blank_figure(0.9 + _ROW * len(answer.parts))
    axes = figure.subplots()
    for row, part in enumerate(answer.parts):
        colour = AFTER if part.kept else RAW
        axes.barh(row, 100.0 * part.growth, height=0.6, color=colour)
        if part.error is not None:
            ends = [100.0 * (part.growth - part.error), 100.0 * (part.growth + part.error)]
            axes.plot(ends, [row, row], color=palette.INK, linewidth=1.0)
    axes.set_yticks(range(len(answer.parts)), [PART_TITLES[part.name] for part in answer.parts])
    axes.invert_yaxis()
    axes.grid(False, axis="y")
    axes.axvline(0.0, color=palette.GREY, linewidth=0.8)
    axes.set_title("Forecasts without it are worse by [%]")
    axes.set_xlabel("blue: named; grey: not needed; line: standard error")
    return figure


def forecast_figure(answer: DrivetrainAnswer) -> Figure:
    """Errors over those of the simulator as given, by metric and horizon; small dots: each stretch."""
    groups = grouped_forecasts(answer)
    figure: Figure = blank_figure(0.9 + _ROW * len(groups))
    axes = figure.subplots()
    for row, items in enumerate(groups):
        given = root_mean_square([item.nominal for item in items])
        for name, colour, shift in (("corrected", AFTER, -0.15), ("kinematic", palette.GREEN, 0.15)):
            each = [getattr(item, name) / item.nominal for item in items]
            axes.plot(each, [row + shift] * len(each), ".", color=colour, markersize=3.0)
            whole = root_mean_square([getattr(item, name) for item in items]) / given
            axes.plot(whole, row + shift, "o", color=colour, markersize=5.5)
    axes.set_yticks(range(len(groups)), [forecast_label(items[0]) for items in groups])
    axes.invert_yaxis()
    axes.grid(False, axis="y")
    axes.axvline(1.0, color=RAW, linewidth=1.4)
    axes.set_xlim(left=0.0)
    axes.set_title("Error over that of the simulator as given [-]")
    axes.set_xlabel("blue: corrected; green: effective track; small: each stretch")
    return figure
