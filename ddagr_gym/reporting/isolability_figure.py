"""The isolability table as a picture: how small an effect shows, and which effects imitate each other."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style, save_figure

_SMALLEST, _LARGEST = 1e-2, 1e2
"""Range of the bars, in multiples of the least meaningful size."""

_STATED = 0.5
"""Shares below this are written into their cells."""


def isolability_figure(table: Mapping[str, Any], path: str | Path) -> tuple[Path, Path]:
    """Heat map of the shares that cannot be imitated, beside bars of the least detectable sizes.

    Args:
        table: ``isolability.json`` of schema ddagr-isolability/1.
        path: where, with or without a suffix.

    Returns:
        Paths of the PNG and of the SVG.
    """
    names = list(table["effects"])
    with house_style():
        from matplotlib.figure import Figure

        side = 0.215 * len(names)
        figure = Figure(figsize=(side + 5.6, side + 2.3), layout="constrained")
        matrix, bars = figure.subplots(1, 2, sharey=True, width_ratios=(side, 3.1))
        _draw_matrix(matrix, names, table["isolability"])
        _draw_bars(bars, names, table["effects"])
        minutes = table["duration"] / 60.0
        figure.suptitle(
            f"{table['robot']}, {table['soil'] or 'soil'}: {', '.join(table['manoeuvres'])} ({minutes:.1f} min) with "
            f"{', '.join(table['sensors'])}",
            fontsize=9.0, x=0.01, ha="left",
        )  # fmt: skip
        return save_figure(figure, path)


def _draw_bars(panel: Any, names: Sequence[str], effects: Mapping[str, Any]) -> None:
    """The most visible size of each effect."""
    for row, name in enumerate(names):
        best = min(effects[name]["detectable"], key=lambda item: _number(item["multiples"]))
        multiples = _number(best["multiples"])
        seen = multiples <= _LARGEST
        colour = palette.BLUE if multiples <= 1.0 else palette.ORANGE if seen else palette.PALE
        width = min(max(multiples, _SMALLEST * 1.15), _LARGEST)
        panel.barh(row, width - _SMALLEST, left=_SMALLEST, color=colour, height=0.62)
        panel.annotate(
            _size(best) if seen else "not seen", (width if seen else _SMALLEST, row), xytext=(4, 0),
            textcoords="offset points", va="center", fontsize=6.2,
            bbox={"facecolor": palette.PAPER if seen else palette.PALE, "edgecolor": "none", "pad": 0.8},
        )  # fmt: skip
    panel.axvline(1.0, color=palette.INK, linewidth=0.9, zorder=0.5)
    panel.set_xscale("log")
    panel.set_xlim(_SMALLEST, 10.0 * _LARGEST)
    panel.set_xticks([0.01, 0.1, 1.0, 10.0, 100.0], ["0.01", "0.1", "1", "10", "100"])
    panel.minorticks_off()
    panel.tick_params(axis="y", length=0)
    panel.set_xlabel("least detectable / least meaningful size\n(orange: what already matters may stay unseen)")
    panel.set_title("How small it shows")
    panel.grid(axis="y", visible=False)


def _size(item: Mapping[str, Any]) -> str:
    if item["size"] is None:
        return str(item["field"]).replace("_", " ")
    unit = "" if item["unit"] == "-" else f" {item['unit']}"
    return f"{item['field'].replace('_', ' ')} {item['size']:.2g}{unit}"


def _number(value: float | None) -> float:
    return math.inf if value is None else float(value)


def _draw_matrix(panel: Any, names: Sequence[str], shares: Mapping[str, Mapping[str, float | None]]) -> None:
    values = np.array(
        [[np.nan if a == b or shares[a][b] is None else shares[a][b] for b in names] for a in names], dtype=float
    )
    from matplotlib.colors import LinearSegmentedColormap

    plain = LinearSegmentedColormap.from_list("share", [palette.VERMILLION, palette.PALE_ORANGE, palette.PAPER])
    colours = plain.with_extremes(bad=palette.HAIRLINE)
    image = panel.imshow(values, vmin=0.0, vmax=1.0, cmap=colours, aspect="auto", interpolation="nearest")
    for i, j in zip(*np.nonzero(values < _STATED), strict=True):
        panel.text(j, i, f"{values[i, j]:.2f}".lstrip("0") if values[i, j] >= 0.005 else "0",
                   ha="center", va="center", fontsize=5.2)  # fmt: skip
    ticks = [name.replace("_", " ") for name in names]
    panel.set_xticks(range(len(names)), ticks, rotation=90)
    panel.set_yticks(range(len(names)), ticks)
    panel.set_ylim(len(names) - 0.5, -0.5)
    panel.set_xlabel("rival")
    panel.grid(visible=False)
    panel.set_title("Share of an effect's trace that a rival cannot imitate")
    panel.figure.colorbar(image, ax=panel, location="bottom", shrink=0.5, aspect=40, pad=0.01, ticks=(0.0, 0.5, 1.0))
