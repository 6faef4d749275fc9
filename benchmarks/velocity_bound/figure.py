"""The picture of the bound: the filters over time, over the bound, and at the exit."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.velocity_bound.filters import FILTERS
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

TITLES = {"level": "constant soil", "weaker": "strength x 0.7 from half of the turn on"}
_COLOURS = {
    "thesis": palette.PURPLE,
    "flat_thesis_law": palette.SKY_BLUE,
    "flat": palette.BLUE,
    "inertial": palette.ORANGE,
}
_BOUNDS = {"bound_task": ("bound, level ground", "-"), "bound_slope": ("bound, slope unknown too", ":")}
_VELOCITIES = {"v_x": "forward speed", "v_y": "side slip"}


def draw(result: Mapping[str, Any], path: Path) -> None:
    """Errors over time, a column a plant, and ratios to the bound below; PNG."""
    plants = result["plants"]
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(5.0 * len(plants), 10.0), layout="constrained")
        axes = figure.subplots(4, len(plants), squeeze=False, height_ratios=(1, 1, 0.8, 0.8))
        for column, (plant, found) in enumerate(plants.items()):
            for row, (name, title) in enumerate(_VELOCITIES.items()):
                _draw_series(axes[row][column], found["series"], name)
                axes[row][column].set(title=f"{name}, {title}: {TITLES[plant]}", ylabel="error [mm/s], rms of turns")
            axes[1][column].set(xlabel="time from the start [s]")
            _draw_ratios(axes[2][column], found["filters"])
            _draw_exit(axes[3][column], found)
        figure.legend(*axes[0][0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=120))


def _draw_series(axes: Any, series: Mapping[str, Any], name: str) -> None:
    t, heading = series["t"], series["heading_deg"]
    turning = [time for time, angle in zip(t, heading, strict=True) if 5.0 < angle < 175.0]
    axes.axvspan(turning[0], turning[-1], color=palette.SHADE, lw=0)
    for key, (title, _) in FILTERS.items():
        axes.plot(t, series[key][name], color=_COLOURS[key], lw=1.4, label=title)
    for key, (title, style) in _BOUNDS.items():
        axes.plot(t, series[key][name], style, color=palette.INK, lw=1.8, label=title)
    axes.set(yscale="log", ylim=(0.05, 100.0))


def _interval(axes: Any, at: float, item: Mapping[str, Any], mark: str, colour: str) -> None:
    if item["value"] is None:
        return
    axes.plot([at] * 2, [item["value"] if v is None else v for v in item["interval"]], "-", color=colour, lw=1.4)
    axes.plot(at, item["value"], mark, color=colour, ms=5)
    text = f"{item['value']:.2g}" if item["value"] < 10.0 else f"{item['value']:.0f}"
    axes.annotate(text, (at, item["value"]), xytext=(5, -3), textcoords="offset points", fontsize=8)


def _draw_ratios(axes: Any, filters: Mapping[str, Any]) -> None:
    """v_x as circles, v_y as diamonds."""
    for place, key in enumerate(FILTERS):
        for shift, (name, mark) in zip((-0.18, 0.18), {"v_x": "o", "v_y": "D"}.items(), strict=True):
            _interval(axes, place + shift, filters[key]["over_bound"][f"{name}_mm_s"], mark, _COLOURS[key])
    axes.axhline(1.0, color=palette.INK, lw=1.8)
    axes.axhline(1.3, color=palette.GREY, lw=0.8, ls="--")
    axes.set(title="error over the bound: v_x (circle), v_y (diamond); dashed: 1.3", yscale="log")
    _name_places(axes, [title for title, _ in FILTERS.values()])


def _draw_exit(axes: Any, found: Mapping[str, Any]) -> None:
    """Pose error at the next row: along as circles, across as diamonds."""
    shown = [(found["filters"][key], "exit", _COLOURS[key]) for key in FILTERS]
    shown += [(found["bounds"]["task"], kind, palette.INK) for kind in ("reckoned", "exit")]
    for place, (own, kind, colour) in enumerate(shown):
        for shift, (name, mark) in zip((-0.18, 0.18), {"along": "o", "across": "D"}.items(), strict=True):
            _interval(axes, place + shift, own[f"{kind}_{name}_mm"], mark, colour)
    axes.set(title="place at the next row [mm]: along (circle), across (diamond)", yscale="log")
    _name_places(axes, [*(title for title, _ in FILTERS.values()), "bound, velocities\nintegrated", "bound, pose"])


def _name_places(axes: Any, names: list[str]) -> None:
    axes.set_xticks(range(len(names)), [name.replace(", ", ",\n") for name in names], rotation=20, fontsize=8)
    axes.set_xlim(-0.5, len(names) - 0.4)
