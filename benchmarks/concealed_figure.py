"""The picture of the scores on concealed cases: what was named for what, and the figures against their targets."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.concealed.sizes import LEAST_MEANINGFUL
from benchmarks.concealed_names import accepted, as_effects
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

WORDS = {
    "false_alarm_rate": "nulls not called none",
    "false_alarm_rate_structural": "the same, structural nulls",
    "power": "any alarm, detectable singles",
    "top1": "right name, detectable singles",
    "in_set": "right name in the set, singles",
    "in_set_per_size": "the same over the set's size",
    "top1_doubles": "both names, doubles",
    "in_set_doubles": "both names in sets, doubles",
    "confident_wrong": "sure of a wrong name, nulls and outside",
    "coverage": "truth inside the 90 % interval",
    "size_error": "median error of the size",
    "gain_share": "share of the explainable error explained",
}
_OTHER, _NOTHING, _OUTSIDE, _FAILED = "another name", "none", "unknown", "failed"
_ROWS = {"null": "nothing (nulls)", "structural null": "nothing (structural nulls)", "outside": "in no library"}
_COLUMNS = (*LEAST_MEANINGFUL, _OTHER, _NOTHING, _OUTSIDE, _FAILED)


def draw(labels: Mapping[str, Any], answers: Mapping[str, Any], result: Mapping[str, Any], path: Path) -> None:
    """Write the picture as PNG, all or nothing.

    Args:
        labels: by case.
        answers: by case.
        result: of :func:`benchmarks.score_concealed.score`, with targets.
        path: where.
    """
    rows = tabled(labels, answers)
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(14.5, max(1.6 + 0.235 * len(rows), 6.0)), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=(3.1, 1.0))
        _confusion(left, rows)
        _targets(right, result)
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=110))


def row_of(label: Mapping[str, Any]) -> str:
    """Row of a case: its effects with all their right names, or the kind of what has no name."""
    return _ROWS.get(label["kind"]) or " + ".join(" or ".join(sorted(names)) for names in accepted(label))


def _said(label: Mapping[str, Any], answer: Mapping[str, Any]) -> list[str]:
    """Columns of an answer; parts of the drivetrain stand in those of their effects."""
    names = as_effects(answer["verdict"], accepted(label)) or [_FAILED]
    return [name if name in _COLUMNS else _OTHER for name in names]


def tabled(labels: Mapping[str, Any], answers: Mapping[str, Any]) -> dict[str, tuple[int, Counter[str], list[str]]]:
    """Cases, how often each column was said, and the columns that are right, by row; singles first."""
    order = {"single": 0, "null": 1, "structural null": 1, "outside": 1, "double": 2}
    names = list(LEAST_MEANINGFUL)

    def place(case: str) -> tuple[int, int, str]:
        label = labels[case]
        first = names.index(label["verdict"][0]) if label["kind"] == "single" else 0
        return order[label["kind"]], first, row_of(label)

    rows: dict[str, tuple[int, Counter[str], list[str]]] = {}
    for case in sorted(answers, key=place):
        right = sorted(name for names in accepted(labels[case]) for name in names)
        count, said, truth = rows.get(row_of(labels[case]), (0, Counter(), right))
        said.update(_said(labels[case], answers[case]))
        rows[row_of(labels[case])] = (count + 1, said, truth)
    return rows


def _confusion(panel: Any, rows: Mapping[str, tuple[int, Counter[str], Sequence[str]]]) -> None:
    for y, (count, said, truth) in enumerate(rows.values()):
        for name in truth:
            panel.add_patch(_square(_COLUMNS.index(name), y, facecolor="none", edgecolor=palette.INK, linewidth=0.9))
        for name, times in said.items():
            colour = palette.GREEN if name in truth else palette.VERMILLION
            x = _COLUMNS.index(name)
            shade = 0.25 + 0.65 * min(times / count, 1.0)
            panel.add_patch(_square(x, y, facecolor=colour, alpha=shade))
            ink = palette.PAPER if shade > 0.5 else palette.INK
            panel.text(x, y, str(times), ha="center", va="center", color=ink, fontweight="bold", fontsize=7.5)
    panel.set_xlim(-0.5, len(_COLUMNS) - 0.5)
    panel.set_ylim(len(rows) - 0.5, -0.5)
    panel.set_xticks(range(len(_COLUMNS)), _COLUMNS, rotation=90)
    panel.set_yticks(range(len(rows)), [f"{name}  ({count})" for name, (count, _, _) in rows.items()])
    panel.xaxis.tick_top()
    panel.tick_params(length=0)
    panel.grid(visible=True, color=palette.HAIRLINE)
    panel.set_ylabel("what is missing (cases)")
    panel.set_title("What the diagnosis said; green is right, outlined what should be there", pad=8.0)


def _square(x: int, y: int, **style: Any) -> Any:
    from matplotlib.patches import Rectangle

    return Rectangle((x - 0.46, y - 0.46), 0.92, 0.92, **style)


def _targets(panel: Any, result: Mapping[str, Any]) -> None:
    shown = [name for name in WORDS if result[name]["value"] is not None]
    for y, name in enumerate(shown):
        entry, aim = result[name], result["targets"].get(name)
        low, high = entry["interval"]
        colour = palette.INK
        if aim is not None:
            colour = palette.GREEN if aim["met"] else palette.VERMILLION
            width = aim["most"] - aim["least"]
            panel.barh(y, width, left=aim["least"], height=0.3, color=palette.SKY_BLUE, alpha=0.3, lw=0)
        panel.plot([low, high], [y, y], color=colour, lw=1.6)
        panel.plot(entry["value"], y, "o", color=colour, ms=5.0)
        text = f"{WORDS[name]} ({entry['count']}): {100.0 * entry['value']:.0f} %"
        panel.text(0.0, y - 0.24, text, va="bottom", fontsize=7.5)
    panel.set_xlim(-0.02, 1.02)
    panel.set_ylim(len(shown) - 0.4, -0.7)
    panel.set_yticks([])
    panel.set_xlabel("share, 95 % interval; blue: the aim")
    panel.set_title("Against the targets")
