"""The figure of ``ddagr study filter``: errors of all estimators, consistency, force laws, real drives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

Document = Mapping[str, Any]

ESTIMATORS = {
    "encoders": "encoders\nalone",
    "closed_form": "closed\nform",
    "thesis_filter": "thesis\nfilter",
    "filter_thesis_law": "ours,\nthesis law",
    "filter": "ours",
    "filter_known_soil": "ours, soil\nknown",
}
"""Arms of the document and their labels."""
SETS = {
    "thesis_a1_range": ("in range", palette.BLUE),
    "weaker": ("weaker", palette.ORANGE),
    "stiffer": ("stiffer", palette.GREEN),
    "field": ("field", palette.PURPLE),
}
_OTHER = (palette.VERMILLION, palette.SKY_BLUE, palette.INK)
_CHANNELS = {
    "specific_force_x": "accel. x",
    "specific_force_y": "accel. y",
    "yaw_rate": "gyro",
    "encoder_right": "encoder r",
    "encoder_left": "encoder l",
}
_BLOCKS = {"velocity": palette.BLUE, "parameters": palette.VERMILLION}
_LAWS = {"thesis": "thesis", "thesis_with_resistance": "thesis +\nresistance", "coupled": "coupled\n(ours)"}
_STATES = {"grid": "slip and slip angle grid", "turn": "wheel states of turns", "drives": "the drives here"}
_MODELS = {
    "kinematic_no_slip": ("no slip", palette.PALE),
    "kinematic_effective_track": ("effective track", palette.ORANGE),
    "filter": ("filter", palette.BLUE),
}


def filter_study_figure(document: Document, path: Path) -> None:
    """Write the figure as PNG.

    Args:
        document: of :func:`benchmarks.filter_study.summary.summarise_study`.
        path: file to write.
    """
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(13.0, 7.8), layout="constrained")
        axes = figure.subplots(2, 3)
        sets = _sets(document)
        _errors(axes[0, 0], document, sets, ("radius_error_median", "radius_error_p95"), 100.0)
        _aims(axes[0, 0], document, ("radius_error_median", "radius_error_p95"), 100.0)
        axes[0, 0].set(title="Turn radius: median (dot) and 95th percentile (bar)", ylabel="|error| [%]")
        _errors(axes[0, 1], document, sets, ("speed_rmse_median_drive", "speed_rmse"), 1e3)
        _aims(axes[0, 1], document, ("speed_rmse",), 1e3)
        axes[0, 1].set(title="Speed: median drive (dot), RMS of all (bar)", ylabel="error [mm/s]")
        axes[0, 1].legend(loc="upper right")
        _force_laws(axes[0, 2], document)
        _nees(axes[1, 0], document)
        _nis(axes[1, 1], document, sets)
        _real(axes[1, 2], document)
        write_atomically(path, lambda to: figure.savefig(to, dpi=160, format="png", metadata={"Software": None}))


def _sets(document: Document) -> dict[str, tuple[str, str]]:
    """Label and colour of the document's soil sets."""
    others = iter(_OTHER * 10)
    return {name: SETS[name] if name in SETS else (name, next(others)) for name in document["filter"]}


def _logarithmic(axes: Any) -> None:
    from matplotlib.ticker import LogLocator, NullLocator

    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")


def _aside(count: int) -> Any:
    return (np.arange(count) - 0.5 * (count - 1)) * 0.17


def _errors(
    axes: Any, document: Document, sets: Mapping[str, tuple[str, str]], keys: Sequence[str], unit: float
) -> None:
    for shift, (name, (label, colour)) in zip(_aside(len(sets)), sets.items(), strict=True):
        for place, estimator in enumerate(ESTIMATORS):
            item = document[estimator][name]
            middle, high = (item.get(key, {"value": None})["value"] for key in keys)
            if middle is None:
                continue
            axes.plot(place + shift, unit * middle, "o", color=colour, ms=4.5, label=label if place == 0 else None)
            if high is not None:
                axes.plot([place + shift] * 2, [unit * middle, unit * high], "-", color=colour, lw=1.4)
                axes.plot(place + shift, unit * high, "_", color=colour, ms=7, mew=1.6)
    _logarithmic(axes)
    axes.set_xticks(range(len(ESTIMATORS)), list(ESTIMATORS.values()))
    axes.set_xlim(-0.6, len(ESTIMATORS) - 0.4)
    axes.grid(axis="x", visible=False)


def _aims(axes: Any, document: Document, keys: Sequence[str], unit: float) -> None:
    for key in keys:
        if key in document["aims"]:
            level = unit * document["aims"][key]["aim"]
            axes.axhline(level, color=palette.GREY, lw=0.8, ls=(0, (4, 3)), zorder=0.5)
            axes.text(1.0, level, "aim ", transform=axes.get_yaxis_transform(), ha="right", va="bottom", fontsize=6.5,
                      color=palette.GREY)  # fmt: skip


def _force_laws(axes: Any, document: Document) -> None:
    axes.set(title="Force laws against the terramechanic wheel", ylabel="largest error / largest force [%]")
    found = document["force_laws"]
    name = next((n for n in SETS if n in found), next(iter(found)))
    kinds = [kind for kind in _STATES if kind in found[name]]
    width, hatches = 0.8 / (2 * len(kinds)), ("", "////")
    for number, kind in enumerate(kinds):
        for axis, key in enumerate(("peak_error_x", "peak_error_y")):
            heights = [100 * found[name][kind][law][key] for law in _LAWS]
            places = np.arange(len(_LAWS)) + (2 * number + axis) * width - 0.4 + 0.5 * width
            colour = (palette.BLUE, palette.ORANGE, palette.GREEN)[number]
            axes.bar(
                places, heights, 0.92 * width, color=colour, hatch=hatches[axis], edgecolor=palette.PAPER, linewidth=0,
                label=_STATES[kind] if axis == 0 else None,
            )  # fmt: skip
    axes.set_xticks(range(len(_LAWS)), list(_LAWS.values()))
    axes.set_ylim(0.0, 1.35 * axes.get_ylim()[1])
    axes.grid(axis="x", visible=False)
    axes.legend(title="plain: along, hatched: across the wheel", title_fontsize=7.5, loc="upper right")


def _nees(axes: Any, document: Document) -> None:
    axes.set(title="Matched drives: NEES over degrees of freedom", xlabel="time [s]", ylabel="mean over drives")
    known = document["nees"]["soil_known_to_15_percent"]
    wide = document["nees"]["default_prior"]
    for block, colour in _BLOCKS.items():
        t = 1.0 + np.arange(len(known[block]["by_instant"]))
        axes.axhspan(*known[block]["band"], color=colour, alpha=0.12, lw=0)
        axes.plot(t, known[block]["by_instant"], "-o", color=colour, ms=2.5, label=f"{block}, soil known to 15 %")
        t = 1.0 + np.arange(len(wide[block]["by_instant"]))
        axes.plot(t, wide[block]["by_instant"], ":", color=colour, lw=1.2, label=f"{block}, default prior")
    _logarithmic(axes)
    axes.set_ylim(0.7, 2.5 * axes.get_ylim()[1])
    axes.legend(loc="upper left", ncols=2)


def _nis(axes: Any, document: Document, sets: Mapping[str, tuple[str, str]]) -> None:
    axes.set(title="NIS of our filter (shaded: matched drives)", ylabel="mean over drives")
    for place, channel in enumerate(_CHANNELS):
        low, high = document["nis_of_matched_drives"]["soil_known_to_15_percent"][channel]["band"]
        axes.fill_between([place - 0.42, place + 0.42], low, high, color=palette.BED, lw=0)
        for shift, (name, (_, colour)) in zip(_aside(len(sets)), sets.items(), strict=True):
            item = document["filter"][name]["nis"].get(channel)
            if item is not None:
                axes.plot([place + shift] * 2, item["interval"], "-", color=colour, lw=1.4)
                axes.plot(place + shift, item["value"], "o", color=colour, ms=4)
    axes.axhline(1.0, color=palette.GREY, lw=0.7)
    axes.set_ylim(0.0, None)
    axes.set_xticks(range(len(_CHANNELS)), list(_CHANNELS.values()))
    axes.grid(axis="x", visible=False)


def _real(axes: Any, document: Document) -> None:
    axes.set_title("Real drives: heading error after 5 s")
    tables = {
        name: item["drives"]["wheel_speeds"]["5"]["heading"]
        for name, item in document["real_drives"].items()
        if "5" in item["drives"].get("wheel_speeds", {})
    }
    if not tables:
        axes.text(0.5, 0.5, "no recordings given", ha="center", color=palette.GREY, transform=axes.transAxes)
        axes.set_xticks([])
        axes.set_yticks([])
        return
    for number, (model, (label, colour)) in enumerate(_MODELS.items()):
        for place, table in enumerate(tables.values()):
            item = table.get(model)
            if item is None or item["value"] is None:
                continue
            at = place + 0.22 * (number - 1)
            axes.bar(at, item["value"], 0.2, color=colour, label=label if place == 0 else None)
            if item["interval"] is not None:
                axes.plot([at, at], item["interval"], color=palette.INK, lw=1.0)
    _logarithmic(axes)
    axes.set_ylabel("root mean square error [rad]")
    axes.set_xticks(range(len(tables)), [name.replace("_", "\n") for name in tables])
    axes.grid(axis="x", visible=False)
    axes.legend(loc="upper right")
