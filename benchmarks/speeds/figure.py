"""The figure of the results."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import COLOURS, house_style, save_figure

TARGET = 1e-3  # force error of the default numerics
LABELS = {
    "row_turn": "row turn",
    "trained_policy": "trained policy",
    "untrained_policy": "untrained policy",
}


def speed_figure(results: dict[str, Any], path: Path) -> tuple[Path, Path]:
    """Four panels: batch size, peers, quadrature, time step.

    Args:
        results: of ``benchmarks.speed.measure``.
        path: where, with or without a suffix.

    Returns:
        Paths of the PNG and of the SVG.
    """
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(9.2, 6.4), layout="constrained")
        panels = figure.subplots(2, 2)
        _batch(panels[0, 0], results["batch"])
        _peers(panels[0, 1], results["steps_per_second"]["rates"])
        _quadrature(panels[1, 0], results["quadrature"])
        _time_step(panels[1, 1], results["time_step"])
        return save_figure(figure, path)


def _batch(panel: Any, batch: dict[str, list[dict[str, Any]]]) -> None:
    for colour, (workload, rows) in zip(COLOURS, batch.items(), strict=False):
        counts = [row["environments"] for row in rows]
        medians = [row["one_thread"]["median"] for row in rows]
        low, high = zip(*(row["one_thread"]["quartiles"] for row in rows), strict=True)
        panel.plot(counts, medians, marker="o", ms=3.5, color=colour, label=LABELS[workload])
        panel.fill_between(counts, low, high, color=colour, alpha=0.15, lw=0)
    panel.set_xscale("log", base=4)
    panel.set_xticks(counts, [str(count) for count in counts])
    panel.minorticks_off()
    panel.set_ylim(0.0, 1.3 * panel.get_ylim()[1])
    panel.set_title("Native batch, one core")
    panel.set_xlabel("environments")
    panel.set_ylabel("simulated seconds per CPU second")
    panel.legend(loc="upper left", ncols=3)


def _peers(panel: Any, rates: dict[str, dict[str, Any]]) -> None:
    names = list(rates)[::-1]
    for place, name in enumerate(names):
        rate = rates[name]
        low, high = rate["quartiles"]
        ours = name.startswith("DDAGR")
        panel.barh(place, rate["median"], height=0.62, color=palette.BLUE if ours else palette.PALE)
        panel.plot([low, high], [place, place], color=palette.INK, lw=1.4)
        panel.annotate(
            f" {rate['median']:,.0f}", (max(rate["median"], high), place), va="center", fontsize=7, color=palette.INK
        )
    panel.set_yticks(range(len(names)), [name.replace(", ", "\n") for name in names], fontsize=7)
    panel.grid(axis="y", visible=False)
    panel.margins(x=0.18)
    panel.set_title("One environment, one core")
    panel.set_xlabel("environment steps per CPU second")


def _quadrature(panel: Any, rows: list[dict[str, Any]]) -> None:
    for colour, section in zip(COLOURS, sorted({row["section_nodes"] for row in rows}), strict=False):
        chosen = [row for row in rows if row["section_nodes"] == section]
        cost = [row["nanoseconds"] for row in chosen]
        panel.plot(
            cost, [row["median_error"] for row in chosen], "-", marker="o", ms=3, color=colour,
            label=f"{section} across the tyre, median",
        )  # fmt: skip
        panel.plot(
            cost, [row["error_of_9_in_10"] for row in chosen], ":", marker="o", ms=3, color=colour,
            label=f"{section} across the tyre, nine in ten",
        )  # fmt: skip
    default = next(row for row in rows if row["default"])
    panel.plot(default["nanoseconds"], default["median_error"], "o", ms=9, mfc="none", color=palette.INK, mew=1.2)
    panel.annotate(
        "default", (default["nanoseconds"], default["median_error"]), (6, -12), textcoords="offset points", fontsize=7
    )
    panel.axhline(TARGET, color=palette.GREY, lw=0.8)
    panel.set_yscale("log")
    panel.set_title("Quadrature: 2 to 16 nodes along each half of the contact")
    panel.set_xlabel("nanoseconds per wheel")
    panel.set_ylabel("force error / force")
    panel.legend(fontsize=6.5)


def _time_step(panel: Any, workloads: dict[str, list[dict[str, Any]]]) -> None:
    for colour, (workload, rows) in zip(COLOURS, workloads.items(), strict=False):
        ordered = sorted(rows, key=lambda row: row["microseconds"])
        panel.plot(
            [row["microseconds"] for row in ordered], [1e3 * row["v_x"] for row in ordered], "o", ms=3.5, color=colour,
            label=LABELS[workload],
        )  # fmt: skip
        default = next(row for row in rows if row["numerics"] == "default")
        panel.plot(default["microseconds"], 1e3 * default["v_x"], "o", ms=9, mfc="none", color=palette.INK, mew=1.2)
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.set_xticks([3, 5, 10, 20], ["3", "5", "10", "20"])
    panel.minorticks_off()
    panel.set_title("Time step: default (ringed) and other options")
    panel.set_xlabel("microseconds per 8 ms of one robot")
    panel.set_ylabel("v_x error, r.m.s. [mm/s]")
    panel.legend(fontsize=6.5)
