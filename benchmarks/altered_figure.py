"""What was said of altered real drives, as a grid of changes and drives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.altered_changes import ABSOLUTE, CONTROL
from ddagr_gym.diagnosis.answer.drivetrain import PART_TITLES
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

LEGEND = (
    (palette.GREEN, "named"), (palette.SKY_BLUE, "suspected by its checks"), (palette.ORANGE, "another name"),
    (palette.PALE, "not told"), (palette.VERMILLION, "failed"),
)  # fmt: skip


def outcome(case: Mapping[str, Any]) -> tuple[str, str]:
    """Colour and words of a case in the picture."""
    if "failure" in case:
        return palette.VERMILLION, "failed"
    if case["change"] == CONTROL.name:
        return palette.PALE, _words(case["verdict"])
    if case["named"]:
        return palette.GREEN, _sizes(case)
    if case["others"]:
        return palette.ORANGE, ", ".join(case["others"]).replace("_", " ")
    return (palette.SKY_BLUE, "suspected") if case["suspected_by_checks"] else (palette.PALE, "not told")


def _words(verdict: Sequence[str]) -> str:
    """What is told of an unaltered drive: parts of the drivetrain as one, and what else."""
    others = [name.replace("_", " ") for name in verdict if name not in PART_TITLES]
    parts = len(verdict) - len(others)
    return "\n".join([f"{parts} parts of the drivetrain" if parts else "no part of the drivetrain", ", ".join(others)])


def _sizes(case: Mapping[str, Any]) -> str:
    """Sizes that were found over the true ones, both counting what the unaltered drive has of its own."""
    told = [
        f"{name} {case['found'][name]['value']:.3g} of {truth:.3g}"
        for name, truth in case["truth"].items()
        if name in case["found"]
    ]
    return "named" if not told else ", ".join(told)


def draw(cases: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Grid of changes and drives with what was said, as PNG, all or nothing.

    Args:
        cases: entries of :func:`benchmarks.altered_drives.scored`.
        path: where.
    """
    shown = [change for change in ABSOLUTE.values() if any(case["change"] == change.name for case in cases)]
    rows, drives = [change.name for change in shown], list(dict.fromkeys(case["drive"] for case in cases))
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(2.6 + 2.6 * len(drives), 1.3 + 0.46 * len(rows)), layout="constrained")
        panel = figure.subplots()
        for case in cases:
            _cell(panel, drives.index(case["drive"]), rows.index(case["change"]), outcome(case))
        panel.set_xticks(range(len(drives)), [drive.replace("_", " ") for drive in drives])
        panel.set_yticks(range(len(rows)), [change.words for change in shown])
        panel.set(xlim=(-0.5, len(drives) - 0.5), ylim=(len(rows) - 0.5, -0.5))
        panel.grid(visible=False)
        panel.tick_params(length=0)
        figure.suptitle("Changes written into real drives, asked without a calibration", fontsize=10.0)
        _legend(figure)
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=130))


def _cell(panel: Any, column: int, row: int, said: tuple[str, str]) -> None:
    from matplotlib.patches import Rectangle

    colour, words = said
    panel.add_patch(Rectangle((column - 0.48, row - 0.44), 0.96, 0.88, facecolor=colour, alpha=0.65, linewidth=0.0))
    panel.text(column, row, words, ha="center", va="center", fontsize=7.0)


def _legend(figure: Any) -> None:
    from matplotlib.patches import Patch

    handles = [Patch(facecolor=colour, alpha=0.65, label=words) for colour, words in LEGEND]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False)
