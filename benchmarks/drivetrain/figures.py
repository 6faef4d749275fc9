"""The four figures of the page on the drivetrain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

Document = Mapping[str, Any]

RESOLUTION = 92
"""[dots per inch]; with it no figure is above 100 kB."""
COLOURS = {
    "asphalt": palette.BLUE,
    "asphalt 2": palette.SKY_BLUE,
    "gravel": palette.GREEN,
    "sand": palette.VERMILLION,
    "sand 2": palette.ORANGE,
}
TITLES = (
    "Asphalt: a turn creeps to its speed",
    "Asphalt: the left bank at its limit",
    "Asphalt: into a turn",
    "Gravel: from rest to top speed",
    "Sand: one bank is reversed",
    "Sand: a turn is reversed",
)
LABELS = {
    "delay": "delay",
    "turning_limit": "turning limit",
    "mean_ramp": "ramp of mean",
    "turning_ramp": "ramp of turning",
    "top_speed": "top speed",
    "proportional": "proportional",
    "integral": "integral",
    "power": "power limit",
    "asymmetry": "asymmetry",
    "viscous": "viscous friction",
}
"""Parameters in the figure."""


def draw_figures(document: Document, folder: Path) -> None:
    """Write all figures as PNG.

    Args:
        document: of :func:`benchmarks.drivetrain.study.run_study`.
        folder: where to write them.
    """
    drawn = {
        "drivetrain_steps": _steps,
        "drivetrain_since_change": _since_change,
        "drivetrain_load_and_speed": _load_and_speed,
        "drivetrain_by_drive": _by_drive,
    }
    with house_style():
        for name, draw in drawn.items():
            figure = draw(document)
            write_atomically(
                folder / f"{name}.png",
                lambda to, figure=figure: figure.savefig(to, dpi=RESOLUTION, format="png", metadata={"Software": None}),
            )


def _figure(width: float, height: float) -> Any:
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def _steps(document: Document) -> Any:
    figure = _figure(9.0, 4.8)
    axes = figure.subplots(2, 3, sharex=True)
    for axis, example, title in zip(axes.flat, document["examples"], TITLES, strict=True):
        t, bank = np.array(example["t"]), np.array(example["bank"])
        reading, model = np.array(example["reading"]), np.array(example["model"])
        for side, colour in ((0, palette.RIGHT), (1, palette.LEFT)):
            before, command = example["before"][side], example["command"][side]
            axis.plot([-0.5, 0.0, 0.0, 6.0], [before, before, command, command], color=colour, lw=0.9, ls=(0, (2, 2)))
            axis.plot(example["model_t"], model[:, side], color=colour, lw=1.2)
            mine = bank == side
            axis.plot(t[mine], reading[mine], "o", color=colour, ms=2.6, mec=palette.PAPER, mew=0.3)
        axis.set_title(title)
        axis.set_xlim(-0.5, 6.0)
    for axis in axes[1]:
        axis.set_xlabel("time since the change of command [s]")
    for axis in axes[:, 0]:
        axis.set_ylabel("bank speed [rad/s]")
    last = axes[0, 0]
    last.plot([], [], color=palette.INK, lw=0.9, ls=(0, (2, 2)), label="command")
    last.plot([], [], "o", color=palette.INK, ms=2.6, label="encoder")
    last.plot([], [], color=palette.INK, lw=1.2, label="model")
    last.plot([], [], color=palette.RIGHT, lw=3, label="right")
    last.plot([], [], color=palette.LEFT, lw=3, label="left")
    last.legend(loc="best", ncols=2)
    return figure


def _middles(rows: Sequence[Mapping[str, Any]]) -> list[float]:
    return [0.5 * (row["low"] + row["high"]) for row in rows]


def _since_change(document: Document) -> Any:
    figure = _figure(6.4, 3.2)
    axis = figure.subplots()
    for drive, tables in document["residuals"].items():
        rows = tables["since_change"]
        axis.plot(_middles(rows), [row["rms"] for row in rows], "o-", ms=2.5, color=COLOURS[drive], label=drive)
    axis.set(xlabel="time since the change of command [s]", ylabel="held-out residual, r.m.s. [rad/s]", ylim=(0, None))
    axis.legend(loc="upper right")
    return figure


def _load_and_speed(document: Document) -> Any:
    figure = _figure(9.0, 3.2)
    left, right = figure.subplots(1, 2)
    for drive, tables in document["residuals"].items():
        for axis, name in ((left, "excess_over_other"), (right, "speed")):
            rows, colour = tables[name], COLOURS[drive]
            middles = _middles(rows)
            axis.plot(middles, [row["median"] for row in rows], "o-", ms=2.5, color=colour, label=drive)
            low, high = np.transpose([row["quartiles"] for row in rows])
            axis.fill_between(middles, low, high, color=colour, alpha=0.12, lw=0)
    left.set(xlabel="speed less the other bank's [rad/s]: > 0 driven, < 0 dragged", ylabel="encoder less model [rad/s]")
    right.set(xlabel="bank speed [rad/s]")
    left.set_title("By load")
    right.set_title("By speed")
    left.legend(loc="upper left", ncols=2)
    for axis in (left, right):
        axis.set_ylim(-1.5, 1.5)
    return figure


def _by_drive(document: Document) -> Any:
    figure = _figure(9.0, 3.6)
    axis = figure.subplots()
    drives = list(document["drives"])
    for place, name in enumerate(LABELS):
        joint = document["robot"][name]["value"]
        for number, drive in enumerate(drives):
            row = document["by_drive"][name]["drives"][drive]
            at = place + 0.13 * (number - 0.5 * (len(drives) - 1))
            axis.errorbar(
                at, row["value"] / joint, 1.96 * row["deviation"] / abs(joint), fmt="o", ms=3, lw=1.0,
                color=COLOURS[drive], label=drive if place == 0 else None,
            )  # fmt: skip
    axis.axhline(1.0, color=palette.GREY, lw=0.8)
    axis.set_xticks(range(len(LABELS)), [label.replace(" ", "\n") for label in LABELS.values()])
    axis.set(ylabel="value of a drive over the joint one", ylim=(0.0, 2.2))
    axis.grid(axis="x", visible=False)
    axis.legend(loc="upper left", ncols=5)
    return figure
