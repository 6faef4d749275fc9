"""Figures of a set of pairs against their aims, and what was said of each effect by its size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.changed_pairs.score import TARGETS
from benchmarks.score_concealed import against_targets
from ddagr_gym.diagnosis.wording import title
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

WORDS = {
    "false_alarms": "false alarms",
    "false_alarms_structural": "of them, simulators of other structure",
    "right_name": "right name of a detectable single",
    "in_set": "right name in the set",
    "right_name_hidden": "right name, loads and soils",
    "both_of_double": "both names of a double",
    "interval_holds": "intervals that hold the size",
    "time_inside": "intervals that hold the time",
    "sure_and_wrong": "sure and wrong",
}
LEAST, MOST = 0.2, 50.0
"""Sizes over what can be told that are drawn; others at the edge."""


def draw(figures: Mapping[str, Any], path: Path) -> None:
    """Write the picture as PNG, all or nothing.

    Args:
        figures: of :func:`benchmarks.changed_pairs.score.score`.
        path: where.
    """
    from matplotlib.figure import Figure

    effects = sorted(figures["by_effect"], key=title, reverse=True)
    with house_style():
        figure = Figure(figsize=(13.0, 1.6 + 0.29 * max(len(effects), 2 * len(WORDS))), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.5))
        _draw_rates(left, figures)
        for place, name in enumerate(effects):
            _draw_effect(right, place, figures["by_effect"][name])
        right.axvline(1.0, color=palette.INK, lw=0.9)
        right.set(xscale="log", xlim=(0.8 * LEAST, 1.25 * MOST), ylim=(-0.7, max(len(effects), 1) - 0.3))
        right.set_yticks(range(len(effects)), [title(name) for name in effects], fontsize=8)
        right.set_xlabel("size over what can be told (line: 1; no size, or another one: right edge)")
        right.set_title("green: right; blue: in the set; orange: another; grey: none, unknown", fontsize=9)
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=110))


def _draw_rates(panel: Any, figures: Mapping[str, Any]) -> None:
    names = [name for name in WORDS if figures[name]["count"]]
    aims = against_targets(figures, TARGETS)
    for place, name in enumerate(names):
        entry, (low, high) = figures[name], TARGETS[name]
        panel.barh(place, high - low, left=low, height=0.66, color=palette.SKY_BLUE, alpha=0.3)
        colour = palette.GREEN if aims[name]["met"] else palette.VERMILLION
        panel.plot(entry["interval"], [place, place], color=colour, lw=1.6)
        panel.plot(entry["value"], place, "o", color=colour, ms=6)
    words = [f"{WORDS[name]}\n{100.0 * figures[name]['value']:.0f} % of {figures[name]['count']}" for name in names]
    panel.set_yticks(range(len(names)), words, fontsize=8)
    panel.set(ylim=(len(names) - 0.4, -0.6), xlim=(-0.02, 1.02), xlabel="share, 95 % interval; blue: the aim")


def _draw_effect(panel: Any, place: int, items: Sequence[Mapping[str, Any]]) -> None:
    for item in items:
        at = MOST if item["multiple"] is None else min(max(item["multiple"], LEAST), MOST)
        panel.plot(at, place, "o", ms=5, color=_colour(item), alpha=0.8)


def _colour(item: Mapping[str, Any]) -> str:
    if item["right"]:
        return palette.GREEN
    if item["in_set"]:
        return palette.BLUE
    return palette.GREY if item["said"] in (["none"], ["unknown"]) else palette.VERMILLION
