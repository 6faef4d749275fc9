"""Radius error, exit and success of three controllers in every truth."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.adaptation.study import ARMS
from ddagr_gym.control.row_turn import FURROW_SLACK
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import DASHED, house_style

_COLOURS = dict(zip(ARMS, (palette.ORANGE, palette.BLUE, palette.PALE), strict=True))
_SHARE = 0.8  # of the room between truths that bars take
_PANELS = (
    ("radius_error", "|radius error| [%]", (0.3, 110.0)),
    ("exit_deviation", "deviation at the next row [cm]", (0.3, 110.0)),
    ("success", "success [%]", (0.0, 105.0)),
)


def draw(result: Mapping[str, Any], path: Path) -> None:
    """Bars with 95 % intervals, one panel a metric. PNG, whole or not at all.

    Args:
        result: of :func:`benchmarks.adaptation.won_back.result_of`.
        path: where.
    """
    truths = result["truths"]
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(9.5, 7.4), layout="constrained")
        panels = figure.subplots(len(_PANELS), 1, sharex=True)
        places, width = np.arange(len(truths), dtype=float), _SHARE / len(ARMS)
        for panel, (name, label, limits) in zip(panels, _PANELS, strict=True):
            for k, (arm, title) in enumerate(ARMS.items()):
                at = places + (k - 0.5 * (len(ARMS) - 1)) * width
                _bars(panel, at, width, [item["arms"][arm][name] for item in truths.values()], _COLOURS[arm], title)
            panel.set(ylabel=label, ylim=limits, yscale="linear" if name == "success" else "log")
        for panel in panels[:2]:
            panel.yaxis.set_major_formatter("{x:g}")
        panels[1].axhline(100.0 * FURROW_SLACK, color=palette.INK, linestyle=DASHED, linewidth=0.9)
        panels[1].annotate("fits the furrow below", (places[-1] + 0.45, 100.0 * FURROW_SLACK * 1.08), ha="right")
        panels[0].set_title("Turns driven in the truth: medians and shares with 95 % intervals")
        panels[-1].set_xticks(places, [item["title"] for item in truths.values()], rotation=22, ha="right")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=130))


def _bars(panel: Any, at: np.ndarray, width: float, found: list[Mapping[str, float]], colour: str, label: str) -> None:
    values, low, high = (100.0 * np.array([item[key] for item in found]) for key in ("value", "low", "high"))
    panel.bar(at, values, 0.9 * width, color=colour, label=label)
    spread = np.maximum(np.array([values - low, high - values]), 0.0)
    panel.errorbar(at, values, spread, fmt="none", ecolor=palette.INK, elinewidth=0.8)
