"""Maps of a diagnosis: the drives coloured by their mismatch, and the force that is missing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.answer.evidence import Evidence
from ddagr_gym.diagnosis.answer.location import Place
from ddagr_gym.diagnosis.answer.verdict import Finding
from ddagr_gym.frames import body_to_world
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.diagnosis_figures import BEFORE, MODELS, MOST_PATHS, Figure, thinned
from ddagr_gym.reporting.figures import blank_figure

Array = NDArray[np.float64]

_PIXELS = 200
"""Per inch, of what is drawn as pixels."""


def map_figures(evidence: Evidence, findings: Sequence[Finding] = ()) -> tuple[Figure, ...]:
    """The drives coloured by their mismatch: nominal, refitted, corrected; on one scale.

    Args:
        evidence: of the diagnosis.
        findings: whose places and slopes are drawn.
    """
    titles = ("Nominal", "Refitted", "Corrected")
    sizes = [np.sqrt(evidence.roughness(model).mean(axis=1)) for model, _, _ in MODELS]
    top = max(float(np.quantile(np.concatenate(sizes), 0.97)), 2.0)
    return tuple(_map(evidence, size, top, text, findings) for size, text in zip(sizes, titles, strict=True))


def _map(evidence: Evidence, size: Array, top: float, title: str, findings: Sequence[Finding]) -> Figure:
    """Map with sizes (W,) of the windows."""
    from matplotlib.collections import LineCollection
    from matplotlib.colors import LinearSegmentedColormap, Normalize

    points = thinned(evidence)
    figure = blank_figure(3.9, 3.6)
    figure.set_dpi(_PIXELS)
    axes = figure.subplots()
    _draw_places(axes, evidence, findings)
    colours = LinearSegmentedColormap.from_list("mismatch", ["#D3D8DC", "#EFC27A", BEFORE, "#6E1F00"])
    order = np.argsort(size, kind="stable")
    lines = LineCollection(
        list(points[order]), cmap=colours, norm=Normalize(1.0, top), linewidths=2.4, capstyle="round",
        rasterized=len(points) > MOST_PATHS,
    )  # fmt: skip
    lines.set_array(size[order])
    axes.add_collection(lines)
    axes.autoscale_view()
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="x [m]", ylabel="y [m]", title=title)
    bar = figure.colorbar(lines, ax=axes, location="bottom", shrink=0.8, aspect=34, pad=0.02, extend="both")
    bar.set_label("lasting residual over noise")
    bar.outline.set_visible(False)
    return figure


def _draw_places(axes: Any, evidence: Evidence, findings: Sequence[Finding]) -> None:
    """Discs and bands, and an arrow uphill in the corner where a slope was named."""
    for finding in findings:
        for place in () if finding.where is None else finding.where.places:
            _draw_place(axes, place, facecolor=palette.BED, edgecolor=palette.GREY, zorder=0.5)
        parameters = finding.parameters
        if finding.name == "slope" and "direction" in parameters:
            turned = np.pi * (parameters["angle"].value < 0.0)
            direction = parameters["direction"].value + turned
            step = 0.07 * np.array([np.cos(direction), np.sin(direction)])
            middle = np.array([0.9, 0.88])
            axes.annotate(
                "", xy=middle + step, xytext=middle - step, xycoords="axes fraction", textcoords="axes fraction",
                arrowprops={"arrowstyle": "-|>", "color": palette.INK, "linewidth": 1.4},
            )  # fmt: skip
            axes.text(0.9, 0.76, "uphill", transform=axes.transAxes, ha="center", va="top", fontsize=7.5)


def _draw_place(axes: Any, place: Place, **style: Any) -> None:
    """A disc, or a band as far as the axes go: it may be longer than the drives."""
    from matplotlib.patches import Circle, Polygon

    if place.half_length == 0.0:
        axes.add_patch(Circle((place.x, place.y), place.radius, **style))
    else:
        axes.add_artist(Polygon(_outline(place), **style))


def _outline(place: Place) -> Array:
    """(n, 2) corners of a band with its round ends [m]."""
    angle = np.linspace(-0.5, 0.5, 17) * np.pi
    front = np.stack([place.half_length + place.radius * np.cos(angle), place.radius * np.sin(angle)], axis=1)
    return body_to_world(np.concatenate([front, -front]), place.x, place.y, place.bearing)


def wrench_figures(evidence: Evidence) -> tuple[Figure, Figure]:
    """Residual force over the ground, averaged over cells, before and after, on one scale."""
    cells = [_force_cells(evidence, values) for values in (evidence.wrench_before, evidence.wrench_after)]
    clear = [c[2:4][:, c[4] > 2.0] for c in cells]
    longest = max([float(np.quantile(np.hypot(*c), 0.9)) for c in clear if c.shape[1]], default=1.0)
    return (
        _forces(evidence, cells[0], longest, "Nominal: force missing"),
        _forces(evidence, cells[1], longest, "Corrected: force still missing"),
    )


def _force_cells(evidence: Evidence, wrench: Array) -> Array:
    """(5, n) place x, y, force in world axes x, y, and its size over its standard deviation, by cell."""
    path = evidence.path[:, evidence.path.shape[1] // 2]
    extent = float(np.ptp(path[:, :2], axis=0).max())
    cell = max(extent / 8.0, 0.25)
    keys = np.floor((path[:, :2] - path[:, :2].min(axis=0)) / cell).astype(int)
    _, group = np.unique(keys, axis=0, return_inverse=True)
    found = []
    for k in range(int(group.max()) + 1):
        rows = np.flatnonzero(group == k)
        precision, total = np.zeros((2, 2)), np.zeros(2)
        for row in rows:
            cosine, sine = np.cos(path[row, 2]), np.sin(path[row, 2])
            turn = np.array([[cosine, -sine], [sine, cosine]])
            own = turn @ np.diag(evidence.wrench_deviation[row, :2] ** -2) @ turn.T
            precision += own
            total += own @ turn @ wrench[row, :2]
        force = np.linalg.solve(precision, total)
        doubt = np.sqrt(np.trace(np.linalg.inv(precision)))
        found.append([*path[rows, :2].mean(axis=0), *force, np.sqrt(force @ precision @ force), doubt])
    cells = np.array(found).T
    return cells[:5, cells[5] <= 2.0 * np.median(cells[5])]


def _forces(evidence: Evidence, cells: Array, longest: float, title: str) -> Figure:
    points = thinned(evidence)
    span = np.ptp(points.reshape(-1, 2), axis=0)
    figure = blank_figure(4.2)
    figure.set_dpi(_PIXELS)
    axes = figure.subplots()
    for window in points:
        axes.plot(*window.T, color=palette.PALE, linewidth=1.0, rasterized=len(points) > MOST_PATHS)
    x, y, force_x, force_y, clear = cells
    reach = 0.16 * max(float(span.max()), 0.5)
    steps = [f * 10.0**e for e in range(-3, 6) for f in (1.0, 2.0, 5.0)]
    key = max(step for step in steps if step <= max(longest, 1e-3))
    shorten = np.minimum(1.0, 2.0 * longest / np.maximum(np.hypot(force_x, force_y), 1e-12))
    for chosen, colour, width in ((clear <= 2.0, palette.PALE, 0.0035), (clear > 2.0, BEFORE, 0.006)):
        if chosen.any():
            arrows = axes.quiver(
                x[chosen], y[chosen], (force_x * shorten)[chosen], (force_y * shorten)[chosen], color=colour,
                angles="xy", scale_units="xy", scale=longest / reach, width=width, zorder=3,
            )  # fmt: skip
            axes.quiverkey(arrows, 0.8, 0.05, key, f"{key:g} N", labelpos="E") if colour == BEFORE else None
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="x [m]", ylabel="y [m]", title=title)
    return figure
