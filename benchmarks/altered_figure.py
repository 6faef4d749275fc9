"""What was said of altered real drives, as a grid of changes and drives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.altered_changes import CHANGES, DRIVES
from benchmarks.score_concealed import names_of
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style


def outcome(case: Mapping[str, Any]) -> tuple[str, str]:
    """Colour and words of a case in the picture."""
    if "failure" in case:
        return palette.VERMILLION, "failed"
    said = ", ".join(case["verdict"]).replace("_", " ")
    found = case["found"].get(case["effect"], {}) if case["named"] else {}
    size = ", ".join(f"{found[name]['value']:.2g}" for name in case["truth"] if name in found)
    words = f"{said}\n{size}" if size else said
    if case["right"]:
        return palette.GREEN, words
    if case["in_set"]:
        return palette.SKY_BLUE, words
    if names_of(case):
        return palette.ORANGE, words
    return (palette.PALE_ORANGE if case["verdict"] == ["unknown"] else palette.PALE), words


LEGEND = (
    (palette.GREEN, "right"), (palette.SKY_BLUE, "in the set, or among others"), (palette.ORANGE, "other name"),
    (palette.PALE_ORANGE, "unknown"), (palette.PALE, "none"), (palette.VERMILLION, "failed"),
)  # fmt: skip


def draw(cases: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Grid of changes and drives with what was said, as PNG, all or nothing.

    Args:
        cases: entries of :func:`scored`.
        path: where.
    """
    shown = [change for change in CHANGES if any(case["change"] == change.name for case in cases)]
    rows = [change.name for change in shown]
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(8.2, 1.3 + 0.46 * len(rows)), layout="constrained")
        panel = figure.subplots()
        for case in cases:
            _cell(panel, DRIVES.index(case["drive"]), rows.index(case["change"]), case)
        panel.set_xticks(range(len(DRIVES)), [drive.replace("_", " ") for drive in DRIVES])
        panel.set_yticks(range(len(rows)), [change.words for change in shown])
        panel.set(xlim=(-0.5, len(DRIVES) - 0.5), ylim=(len(rows) - 0.5, -0.5))
        panel.grid(visible=False)
        panel.tick_params(length=0)
        panel.set_title("What was said of real drives into which a change was written; size found, where named")
        _legend(figure)
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=130))


def _cell(panel: Any, column: int, row: int, case: Mapping[str, Any]) -> None:
    """One case; a frame where the size reaches what the control says it can show."""
    from matplotlib.patches import Rectangle

    colour, words = outcome(case)
    panel.add_patch(Rectangle((column - 0.48, row - 0.44), 0.96, 0.88, facecolor=colour, alpha=0.65, linewidth=0.0))
    if case["detectable"]:
        panel.add_patch(
            Rectangle((column - 0.48, row - 0.44), 0.96, 0.88, fill=False, edgecolor=palette.INK, linewidth=1.1)
        )
    panel.text(column, row, words, ha="center", va="center", fontsize=7.0)


def _legend(figure: Any) -> None:
    from matplotlib.patches import Patch

    handles = [Patch(facecolor=colour, alpha=0.65, label=words) for colour, words in LEGEND]
    framed = Patch(facecolor="none", edgecolor=palette.INK, label="framed: as large as the diagnosis says it can show")
    figure.legend(handles=[*handles, framed], loc="outside lower center", ncols=4, frameon=False)
