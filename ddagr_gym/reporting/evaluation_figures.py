"""Figures of an evaluation: turn radius errors by controller and scenario set."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ddagr_gym.reporting import palette
from ddagr_gym.reporting.figures import COLOURS, house_style, save_figure


def radius_error_figure(rows: Sequence[dict[str, Any]], path: str | Path) -> tuple[Path, Path]:
    """Every episode's turn radius error by controller, one panel a set, with median and quartiles.

    Args:
        rows: of :func:`ddagr_gym.evaluation.campaign.episode_row`.
        path: where, with or without a suffix.

    Returns:
        Paths of the PNG and of the SVG.
    """
    sets = list(dict.fromkeys(row["set"] for row in rows))
    controllers = list(dict.fromkeys(row["controller"] for row in rows))
    with house_style():
        from matplotlib.figure import Figure

        width = max(4.2, 1.2 + 0.75 * len(sets) * len(controllers))
        figure = Figure(figsize=(min(width, 14.0), 3.4), layout="constrained")
        axes = figure.subplots(1, len(sets), sharey=True, squeeze=False)[0]
        for panel, name in zip(axes, sets, strict=True):
            _draw_set(panel, [row for row in rows if row["set"] == name], controllers)
            panel.set_title(f"Scenarios {name}")
        axes[0].set_ylabel("turn radius error [%]")
        return save_figure(figure, path)


def _draw_set(panel: Any, rows: Sequence[dict[str, Any]], controllers: list[str]) -> None:
    panel.axhline(0.0, color=palette.GREY, linewidth=0.8)
    for place, controller in enumerate(controllers):
        mine = [row for row in rows if row["controller"] == controller and row["feasible"]]
        errors = 100 * np.array([row["radius_error"] for row in mine if row["radius_error"] is not None])
        if not errors.size:
            continue
        # spread sideways by rank, so that the same data give the same picture
        aside = 0.22 * np.sin(2.4 * np.arange(errors.size))
        panel.plot(place + aside, errors, "o", color=COLOURS[place % len(COLOURS)], markersize=2.2, alpha=0.55, mew=0)
        low, middle, high = np.percentile(errors, [25, 50, 75])
        panel.plot([place, place], [low, high], color=palette.INK, linewidth=1.6)
        panel.plot(place, middle, "_", color=palette.INK, markersize=14, mew=1.6)
        failed = len(mine) - sum(bool(row["success"]) for row in mine)
        panel.annotate(
            f"{failed} of {len(mine)}\nfail" if failed else "all fit",
            (place, 1.0), xycoords=("data", "axes fraction"), ha="center", va="top", fontsize=6.5, color=palette.GREY,
        )  # fmt: skip
    panel.set_xticks(range(len(controllers)), [name.replace("_", "\n") for name in controllers])
    panel.set_xlim(-0.6, len(controllers) - 0.4)
    panel.grid(axis="x", visible=False)
    panel.margins(y=0.18)
