"""Radius error and success by plant and controller."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

_COLOURS = (
    palette.GREY, palette.ORANGE, palette.SKY_BLUE, palette.BLUE, palette.PALE, palette.GREEN, palette.PURPLE,
    palette.VERMILLION, palette.INK,
)  # fmt: skip
_FEW = 12  # plants whose titles have room side by side
_SHARE = 0.8  # of the room between plants that bars take


def draw(plants: Mapping[str, Mapping[str, Any]], titles: Mapping[str, str], path: Path) -> None:
    """Bars of the median |e_R| with its interval and the 95th percentile as a mark; success below. PNG.

    Args:
        plants: {plant: {controller: summary}}.
        titles: of the plants.
        path: where.
    """
    names = list(next(iter(plants.values())))
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(9.5, 5.6), layout="constrained")
        upper, lower = figure.subplots(2, 1, sharex=True)
        width = _SHARE / len(names)
        places = np.arange(len(plants), dtype=float)
        for k, name in enumerate(names):
            at = places + (k - 0.5 * (len(names) - 1)) * width
            colour = _COLOURS[k % len(_COLOURS)]
            _bars(upper, at, width, [own[name]["radius_error_median"] for own in plants.values()], colour, name)
            tails = [100.0 * own[name]["radius_error_p95"]["value"] for own in plants.values()]
            upper.plot(at, tails, linestyle="none", marker="_", markersize=7, color=palette.INK)
            _bars(lower, at, width, [own[name]["success_rate"] for own in plants.values()], colour, name)
        upper.set(yscale="log", ylim=(0.2, 120.0), ylabel="|radius error| [%]")
        upper.set_title("Median with its 95 % interval; the dash is the 95th percentile")
        lower.set(ylim=(0.0, 105.0), ylabel="success [%]")
        few = len(plants) <= _FEW
        words = [titles[plant].replace(" from", "\nfrom") if few else titles[plant] for plant in plants]
        lower.set_xticks(places, words, rotation=18 if few else 40, ha="right", rotation_mode="anchor")
        figure.legend(
            *upper.get_legend_handles_labels(), loc="outside lower center", ncols=min(len(names), 5), frameon=False
        )
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=130))


def _bars(panel: Any, at: np.ndarray, width: float, found: list[Mapping[str, Any]], colour: str, label: str) -> None:
    values = 100.0 * np.array([item["value"] for item in found])
    intervals = 100.0 * np.array([item["interval"] for item in found]).T
    spread = np.maximum(np.abs(intervals - values), 0.0)
    panel.bar(at, values, 0.9 * width, color=colour, label=label)
    panel.errorbar(at, values, spread, fmt="none", ecolor=palette.INK, elinewidth=0.8)
