"""Radius error and success by set and controller, as two tables with shades."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

_BEST, _WORST = 0.005, 0.2
"""Median radius errors of the palest and of the darkest shade [-]."""


def draw(sets: Mapping[str, Mapping[str, Any]], titles: Mapping[str, str], path: Path) -> None:
    """Median |e_R| beside success, a row a set and a column a controller; the darker, the worse. PNG.

    Args:
        sets: {set: {controller: summary}}.
        titles: of the sets.
        path: where.
    """
    names = list(next(iter(sets.values())))
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(13.0, 0.27 * len(sets) + 1.6), layout="constrained")
        left, right = figure.subplots(1, 2, sharey=True)
        errors = _values(sets, names, "radius_error_median")
        shades = np.log(np.clip(errors, _BEST, _WORST) / _BEST) / np.log(_WORST / _BEST)
        _table(left, shades, [[f"{100.0 * value:.1f}" for value in row] for row in errors], names)
        success = _values(sets, names, "success_rate")
        _table(right, 1.0 - success, [[f"{100.0 * value:.0f}" for value in row] for row in success], names)
        left.set_title("Radius error, median [%]")
        right.set_title("Success [%]")
        left.set_yticks(range(len(sets)), [titles[name] for name in sets], fontsize=7.5)
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=130))


def _values(sets: Mapping[str, Mapping[str, Any]], names: Sequence[str], metric: str) -> np.ndarray:
    """(sets, controllers) of a metric [-]."""
    return np.array([[own[name][metric]["value"] for name in names] for own in sets.values()])


def _table(panel: Any, shades: np.ndarray, words: Sequence[Sequence[str]], names: Sequence[str]) -> None:
    """Cells whose shade says how bad, from 0 to 1, and whose words say what."""
    from matplotlib.colors import LinearSegmentedColormap

    colours = LinearSegmentedColormap.from_list("bad", [palette.PAPER, palette.PALE_ORANGE, palette.VERMILLION])
    panel.imshow(shades, cmap=colours, vmin=0.0, vmax=1.0, aspect="auto")
    for row, line in enumerate(words):
        for column, word in enumerate(line):
            panel.text(column, row, word, ha="center", va="center", fontsize=7.5, color=palette.INK)
    panel.set_xticks(range(len(names)), names, fontsize=7.5, rotation=35, ha="left", rotation_mode="anchor")
    panel.xaxis.set_ticks_position("top")
    panel.tick_params(length=0)
    panel.grid(visible=False)
    panel.spines[:].set_visible(False)
