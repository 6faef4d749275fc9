"""The page of an export: what carries over, with which error, and what does not."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ddagr_gym.exporting.carried_over import GROUPS
from ddagr_gym.exporting.files import PAGE
from ddagr_gym.files import write_text
from ddagr_gym.rendering import palette
from ddagr_gym.reporting import export_text as text
from ddagr_gym.reporting.figures import house_style
from ddagr_gym.reporting.page_template import embedded, page_template

if TYPE_CHECKING:
    from ddagr_gym.exporting.outcome import Outcome


def write_page(folder: Path, result: Outcome) -> None:
    """Write ``index.html``, its picture in it.

    Args:
        folder: that exists.
        result: of :func:`ddagr_gym.export`.

    Raises:
        InputError: matplotlib or jinja2 is not installed.
    """
    page = page_template("export.html")
    with house_style():
        pictures = [embedded(_speeds(result), "Yaw rate and speed of every drive in both simulators")]
        if result.comparison.stepped:
            pictures.append(embedded(_paths(result), "Paths of every drive in both simulators"))
    groups = [
        (group, text.range_rows({name: item for name, item in result.ranges.items() if item.group == group}))
        for group in GROUPS
    ]
    radius = result.carried_over.wheel_radius
    context = {
        "headline": text.headline(result),
        "robot": result.corrected.found.robot.name,
        "to": result.to,
        "source": result.corrected.source,
        "files": list(result.files),
        "speed": f"{result.working_point:.3g}",
        "rim_speed": f"{result.working_point * radius:.3g}",
        "pictures": pictures,
        "compared_header": text.COMPARED_HEADER,
        "compared": text.compared_rows(result.comparison.drives),
        "step": text.step_sentence(result),
        "lost": text.not_carried_over(result),
        "effect_header": text.EFFECT_HEADER,
        "effects": text.effect_rows(result),
        "range_header": text.RANGE_HEADER,
        "groups": groups,
        "ranges": text.range_sentence(result),
    }
    write_text(folder / PAGE, page.render(context))


def _paths(result: Outcome) -> Any:
    """Paths from rest, with the exported model's over ours."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    axes = figure.subplots()
    own, other = result.comparison.own_paths, result.comparison.other_paths
    for paths, colour, style, label in (
        (own, palette.BLUE, "-", "corrected simulator"),
        (other, palette.ORANGE, "--", f"exported ({result.to})"),
    ):
        for k, path in enumerate(paths):
            axes.plot(path[:, 0], path[:, 1], style, color=colour, label=label if k == 0 else None)
            axes.plot(*path[-1], "o", color=colour, markersize=3)
    axes.set(xlabel="x [m]", ylabel="y [m]")
    axes.set_aspect("equal", anchor="W")
    figure.legend(loc="outside upper left", ncols=2, frameon=False)
    return figure


def _speeds(result: Outcome) -> Any:
    """Yaw rates and speeds of every drive, side by side."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.4), layout="constrained")
    yaw, speed = figure.subplots(1, 2, sharey=True)
    drives = result.comparison.drives
    places = range(len(drives))
    for axes, own, other in ((yaw, "yaw_rate", "other_yaw_rate"), (speed, "speed", "other_speed")):
        for name, colour, marker, label in (
            (own, palette.BLUE, "o", "corrected simulator"),
            (other, palette.ORANGE, "x", f"exported ({result.to})"),
        ):
            axes.plot([getattr(row, name) for row in drives], places, marker, color=colour, label=label)
        axes.axvline(0.0, color=palette.INK, linewidth=0.5)
    yaw.set(xlabel="yaw rate [rad/s]", yticks=list(places), yticklabels=[row.drive for row in drives])
    yaw.invert_yaxis()
    speed.set_xlabel("speed [m/s]")
    figure.legend(*speed.get_legend_handles_labels(), loc="outside upper right", ncols=2, frameon=False)
    return figure
