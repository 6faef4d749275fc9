"""Turns before and after an adaptation: paths on the headland, radius errors and where they end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.adaptation.run import Adapted
from ddagr_gym.adaptation.turns import DrivenTurn
from ddagr_gym.control.row_turn import FURROW_SLACK, RowTurn
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import DASHED

Paths = Sequence[Mapping[str, NDArray[np.float64]]]

BEFORE, AFTER = palette.ORANGE, palette.BLUE


def path_figure(before: Paths, after: Paths, turns: Sequence[RowTurn]) -> Any:
    """Paths of the same turns before and after, and the commanded ones.

    Args:
        before: columns of turns with true_x and true_y.
        after: the same turns.
        turns: commanded.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    for panel, driven, title, colour in zip(panels, (before, after), ("Before", "After"), (BEFORE, AFTER), strict=True):
        for turn in {item.side: item for item in turns}.values():
            x, y = turn.position(np.linspace(0.0, turn.length, 200)).T
            panel.plot(x, y, color=palette.INK, linestyle=DASHED, linewidth=0.9)
        for columns in driven:
            panel.plot(columns["true_x"], columns["true_y"], color=colour, linewidth=1.0, alpha=0.8)
        panel.axvline(0.0, color=palette.PALE, linewidth=0.8)
        panel.set(title=title, xlabel="along the rows [m]", aspect="equal")
    panels[0].set_ylabel("across the rows [m]")
    return figure


def error_figure(adapted: Adapted) -> Any:
    """Radius error of every turn before and after, and its deviation at the next row."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 3.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    for place, driven, colour in ((0, adapted.before, BEFORE), (1, adapted.after, AFTER)):
        _cloud(left, place, [None if item.error is None else 100.0 * item.error for item in driven], colour)
        _cloud(right, place, _centimetres(driven), colour)
    left.axhline(0.0, color=palette.INK, linewidth=0.8)
    left.set(title="Radius error", ylabel="[%]")
    right.axhspan(-100.0 * FURROW_SLACK, 100.0 * FURROW_SLACK, color=palette.SHADE)
    right.set(title="Lateral error at the next row", ylabel="[cm]; shaded: half a furrow's slack")
    for panel in (left, right):
        panel.set_xticks([0, 1], ["before", "after"])
        panel.set_xlim(-0.5, 1.5)
    return figure


def _centimetres(driven: Sequence[DrivenTurn]) -> list[float | None]:
    return [None if item.lateral is None else 100.0 * item.lateral for item in driven]


def _cloud(panel: Any, place: float, values: Sequence[float | None], colour: str) -> None:
    """Values side by side around a place, and their median."""
    known = [value for value in values if value is not None]
    offsets = np.linspace(-0.2, 0.2, len(known)) if len(known) > 1 else np.zeros(len(known))
    panel.plot(place + offsets, known, linestyle="none", marker="o", markersize=3.0, color=colour, alpha=0.8)
    if known:
        panel.plot([place - 0.25, place + 0.25], [np.median(known)] * 2, color=palette.INK, linewidth=1.4)
