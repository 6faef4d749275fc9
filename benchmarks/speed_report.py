"""Table and figure of a speed measurement."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ddagr_gym.commands.output import format_table
from ddagr_gym.reporting import palette
from ddagr_gym.reporting.figures import COLOURS, house_style, save_figure


def print_tables(result: dict[str, Any]) -> None:
    """The figures as plain tables."""
    rows = [(name, item["simulated_seconds_per_second"]) for name, item in result["environments"].items()]
    print(format_table(("environment, one core", "simulated s per s"), rows))
    if "skipped" in result["peers"]:
        print(f"peers: {result['peers']['skipped']}")
    else:
        rows = [
            (name, item["steps_per_second"], item["simulated_seconds_per_second"])
            for name, item in result["peers"].items()
        ]
        print("\n" + format_table(("peer, one core", "steps per s", "simulated s per s"), rows))
    kernel = result["kernel"]
    rows = [
        (name, item["ours"]["ns_per_node"], item.get("ours_over_C", "no C compiler")) for name, item in kernel.items()
    ]
    print("\n" + format_table(("kernel rule", "ns per node", "ours over C"), rows))
    rows = [
        (f"{a['section_nodes']} x (2 x {a['contact_nodes']})", a["force_error_median"], a["force_error_p99"],
         a["microseconds_per_wheel"])
        for a in result["accuracy"]
    ]  # fmt: skip
    print("\n" + format_table(("rule", "force error, median", "99 %", "us per wheel"), rows))
    share, memory = result["kernel_share"]["share"], result["memory"]
    print(f"\nshare of a steady batch step in the kernel: {100 * share:.0f} %")
    print(f"two threads on a batch of 256: {result['threads']['gain']:.2f} times one (wall clock)")
    print(f"memory over {memory['resets']} resets: {memory['growth_megabytes']:+.1f} MB")


def speed_figure(result: dict[str, Any], path: Path) -> tuple[Path, Path]:
    """Cost against accuracy, and simulated time against the number of environments and peers."""
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(8.4, 3.4), layout="constrained")
        pareto, counts = figure.subplots(1, 2)
        _draw_accuracy(pareto, result["accuracy"])
        _draw_counts(counts, result)
        return save_figure(figure, path)


def _draw_accuracy(axes: Any, table: list[dict[str, Any]]) -> None:
    cost = [item["microseconds_per_wheel"] for item in table]
    for key, label, colour in (
        ("force_error_median", "median", COLOURS[0]),
        ("force_error_p99", "99th percentile", COLOURS[1]),
    ):
        axes.loglog(cost, [item[key] for item in table], "o-", color=colour, markersize=3.5, label=label)
    for item in table:
        if (item["section_nodes"], item["contact_nodes"]) == (8, 7):
            axes.axvline(item["microseconds_per_wheel"], color=palette.GREY, linewidth=0.8, linestyle=(0, (3, 2)))
            axes.annotate(
                "default", (item["microseconds_per_wheel"], 0.97), xycoords=("data", "axes fraction"),
                rotation=90, va="top", ha="right", fontsize=7, color=palette.GREY,
            )  # fmt: skip
    axes.set(xlabel="cost of a wheel [us]", ylabel="force error [-]")
    axes.set_title("Cost against accuracy")
    axes.legend()


def _draw_counts(axes: Any, result: dict[str, Any]) -> None:
    for label, colour in (("steady turn", COLOURS[0]), ("policy-like", COLOURS[1])):
        counts, speeds = [1], [result["environments"][f"gym.make, {label}"]["simulated_seconds_per_second"]]
        for count in (4, 16, 64, 256):
            counts.append(count)
            speeds.append(result["environments"][f"make_vec({count}), {label}"]["simulated_seconds_per_second"])
        axes.semilogx(counts, speeds, "o-", color=colour, markersize=3.5, label=label)
    for name, item in result["peers"].items():
        if name not in ("ours", "skipped"):
            axes.axhline(item["simulated_seconds_per_second"], color=palette.GREY, linewidth=0.8, linestyle=(0, (3, 2)))
            axes.annotate(
                name, (0.98, item["simulated_seconds_per_second"]), xycoords=("axes fraction", "data"),
                ha="right", va="bottom", fontsize=6.5, color=palette.GREY,
            )  # fmt: skip
    axes.set_ylim(bottom=0.0)
    axes.set(xlabel="environments", ylabel="simulated seconds per second")
    axes.set_title("One core, full model")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.32))
