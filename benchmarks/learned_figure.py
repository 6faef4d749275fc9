"""Errors and coverage of the learned estimators and the filters, by plant."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

_COLOURS = (
    palette.BLUE, palette.ORANGE, palette.VERMILLION, palette.SKY_BLUE, palette.GREEN, palette.PURPLE, palette.GREY,
)  # fmt: skip
_SHARE = 0.75  # of the room between plants
_PANELS = (
    ("v_x_mm_s", "forward speed: error [mm/s], rms; line: bound"),
    ("v_y_mm_s", "side slip: error [mm/s], rms; line: bound"),
    ("exit_along_mm", "place at the next row, along [mm]; line: bound"),
    ("v_x_covered", "forward speed inside its own 90 % interval [%]"),
    ("v_y_covered", "side slip inside its own 90 % interval [%]"),
)


def draw(
    plants: Mapping[str, Mapping[str, Any]], estimators: Mapping[str, str], titles: Mapping[str, str], path: Path
) -> None:
    """A panel a figure, an estimator a colour; PNG.

    Args:
        plants: {plant: {"estimators": {name: figures}, "bound": figures or None}}.
        estimators: titles by name.
        titles: of the plants.
        path: where.
    """
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(8.6, 13.0), layout="constrained")
        for axes, (key, title) in zip(figure.subplots(len(_PANELS), 1, sharex=True), _PANELS, strict=True):
            size = 100.0 if key.endswith("covered") else 1.0
            for k, (name, label) in enumerate(estimators.items()):
                at = _SHARE * (k / (len(estimators) - 1) - 0.5)
                _draw_one(axes, [own["estimators"][name][key] for own in plants.values()], at, size, k, label)
            for place, own in enumerate(plants.values()):
                if own["bound"] and key in own["bound"]:
                    axes.plot([place - 0.45, place + 0.45], [own["bound"][key]["value"]] * 2, color=palette.INK, lw=1.6)
            if key.endswith("covered"):
                axes.axhline(90.0, color=palette.GREY, lw=0.8)
                axes.set_ylim(0.0, 105.0)
            else:
                axes.set_yscale("log")
                axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
                axes.yaxis.set_minor_formatter(lambda value, _: f"{value:g}" if f"{value:g}"[0] in "25" else "")
            axes.set_title(title)
        axes.set_xticks(range(len(plants)), [titles[name].replace(" from", "\nfrom") for name in plants], rotation=18,
                        ha="right")  # fmt: skip
        handles = figure.axes[0].get_legend_handles_labels()
        figure.legend(*handles, loc="outside lower center", ncols=2, frameon=False)
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=120))


def _draw_one(axes: Any, figures: list[Any], at: float, size: float, k: int, label: str) -> None:
    for place, item in enumerate(figures):
        if item is None or item["value"] is None:
            continue
        low, high = (item["value"] if v is None else v for v in item["interval"])
        axes.plot([place + at] * 2, [size * low, size * high], "-", color=_COLOURS[k], lw=1.3)
        axes.plot(place + at, size * item["value"], "o", color=_COLOURS[k], ms=4.5, label=label if place == 0 else None)
