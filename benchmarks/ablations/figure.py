"""The picture of the ablations: right names and false alarms of every arm."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.ablations.examine import ARMS
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

PANELS = {
    "top1": ("Right name first, over its gate", palette.BLUE),
    "top1_at_same_alarms": ("Right name first, over all nulls", palette.GREEN),
    "false_alarm_rate": ("Alarms where nothing is missing", palette.VERMILLION),
}


def draw(arms: Mapping[str, Mapping[str, Any]], path: Path) -> None:
    """Write the picture as PNG, all or nothing.

    Args:
        arms: figures by arm.
        path: where.
    """
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(11.5, 1.2 + 0.5 * len(arms)), layout="constrained")
        panels = figure.subplots(1, len(PANELS), sharey=True)
        for panel, (name, (title, colour)) in zip(panels, PANELS.items(), strict=True):
            _panel(panel, {arm: entry[name] for arm, entry in arms.items()}, title, colour)
        panels[0].set_yticks(range(len(arms)), [f"{arm}\n{ARMS[arm]}" for arm in arms])
        panels[0].invert_yaxis()
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=150))


def _panel(panel: Any, shares: Mapping[str, Mapping[str, Any]], title: str, colour: str) -> None:
    known = {y: entry for y, entry in enumerate(shares.values()) if entry["value"] is not None}
    for y, entry in known.items():
        low, high = entry["interval"]
        panel.barh(y, entry["value"], color=colour, alpha=0.35, height=0.5, lw=0)
        panel.plot([low, high], [y, y], color=colour, lw=1.4)
        panel.plot(entry["value"], y, "o", color=colour, ms=4.5)
        panel.text(1.06, y, f"{100.0 * entry['value']:.0f} %", va="center", ha="left", fontsize=7.5)
    count = max((entry["count"] for entry in known.values()), default=0)
    panel.set_xlim(0.0, 1.2)
    panel.set_xticks([0.0, 0.25, 0.5, 0.75, 1.0])
    panel.tick_params(axis="y", length=0)
    panel.set_title(title)
    panel.set_xlabel(f"share of {count} cases, 95 % interval")
