"""The figure of ``ddagr check``: what the channels look like, and where every checked value lies in its sound range."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ddagr_gym.recordings.checks.clock_offsets import LAGS, Offset, offsets
from ddagr_gym.recordings.checks.findings import CheckFinding, CheckReport, Status
from ddagr_gym.recordings.checks.gravity import rests
from ddagr_gym.recordings.checks.signals import filled
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style, nothing_to_draw
from ddagr_gym.reporting.recorded_currents import ABOVE, draw_currents, gapped, has_currents

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOURS = {Status.PASS: palette.BLUE, Status.SUSPICIOUS: palette.VERMILLION, Status.NOT_TESTABLE: palette.GREY}
RIGHT, LEFT, GYRO, POSE = palette.RIGHT, palette.LEFT, palette.INK, palette.GREEN


def check_figure(recording: Recording, report: CheckReport, rng: np.random.Generator) -> Figure:
    """Figure of one recording's check; call inside :func:`ddagr_gym.reporting.figures.house_style`.

    Args:
        recording: the drive.
        report: what was found about it.
        rng: for the intervals of the clock offsets.
    """
    from matplotlib.figure import Figure

    drawn = has_currents(recording)
    rows = 5 if drawn else 4
    figure = Figure(figsize=(12.5, 2.1 * rows), layout="constrained")
    grid = figure.add_gridspec(rows, 3, width_ratios=(1.0, 1.1, 1.2))
    _speeds(figure.add_subplot(grid[0, :2]), recording)
    _turn_rate(figure.add_subplot(grid[1, :2]), recording)
    if drawn:
        draw_currents(figure.add_subplot(grid[2, :2]), recording)
    _path(figure.add_subplot(grid[rows - 2 :, 0]), recording)
    _clocks(figure.add_subplot(grid[rows - 2, 1]), offsets(recording, rng) if len(recording) >= 3 else {})
    _gravity(figure.add_subplot(grid[rows - 1, 1]), recording)
    _ranges(figure.add_subplot(grid[:, 2]), report)
    count = len(report.suspicious)
    verdict = f"{count} suspicious" if count else "nothing suspicious"
    figure.suptitle(f"{report.source}: {report.rows} rows, {report.seconds:.0f} s, {verdict}")
    return figure


def save_check_figure(recording: Recording, report: CheckReport, rng: np.random.Generator, path: Path) -> None:
    """Write the figure as PNG.

    Args:
        recording: the drive.
        report: what was found about it.
        rng: for the intervals of the clock offsets.
        path: file to write.
    """
    with house_style():
        figure = check_figure(recording, report, rng)
        write_atomically(path, lambda to: figure.savefig(to, dpi=160, format="png", metadata={"Software": None}))


def _speeds(axes: Any, recording: Recording) -> None:
    for bank, colour in (("right", RIGHT), ("left", LEFT)):
        command = recording.held_commands()[0 if bank == "right" else 1]
        axes.plot(*gapped(recording, command), color=colour, lw=0.8, ls=":", label=f"command {bank}")
        axes.plot(
            *gapped(recording, filled(recording, f"encoder_{bank}")), color=colour, lw=0.9, label=f"encoder {bank}"
        )
    axes.set_ylabel("bank speed [rad/s]")
    axes.legend(ncols=4, **ABOVE)
    axes.margins(x=0)


def _turn_rate(axes: Any, recording: Recording) -> None:
    axes.plot(*gapped(recording, recording["yaw_rate"]), color=GYRO, lw=0.7, label="gyro")
    geometry = recording.meta.geometry
    if geometry is not None:
        difference = filled(recording, "encoder_right") - filled(recording, "encoder_left")
        turn = 0.5 * geometry.wheel_radius / geometry.half_track * difference
        axes.plot(*gapped(recording, turn), color=LEFT, lw=0.7, alpha=0.8, label="encoders without slip")
    axes.set_ylabel("yaw rate [rad/s]")
    axes.set_xlabel("time [s]")
    axes.legend(ncols=3, **ABOVE)
    axes.margins(x=0)


def _path(axes: Any, recording: Recording) -> None:
    axes.set_title("path")
    if not recording.has("pose_x", "pose_y"):
        nothing_to_draw(axes, "no pose")
        return
    for span in recording.spans():
        known = np.isfinite(recording["pose_x"][span]) & np.isfinite(recording["pose_y"][span])
        axes.plot(
            recording["pose_x"][span][known], recording["pose_y"][span][known], "-", color=POSE, lw=0.8, alpha=0.8
        )
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")


def _clocks(axes: Any, found: dict[str, Offset | None]) -> None:
    axes.set_title("clock offsets, 99 % intervals")
    known = {pair: offset for pair, offset in found.items() if offset is not None}
    if not known:
        nothing_to_draw(axes, "no motion to compare")
        return
    for (pair, offset), colour in zip(known.items(), (RIGHT, LEFT, POSE), strict=False):
        axes.plot(LAGS, offset.profile, color=colour, lw=1.2, label=f"{pair}: {offset.lag:+.2f} s")
        axes.axvspan(
            max(offset.interval[0], LAGS[0]), min(offset.interval[1], LAGS[-1]), color=colour, alpha=0.15, lw=0
        )
    axes.set_xlabel("offset [s], positive: the second is late")
    axes.set_ylabel("correlation")
    axes.legend(loc="lower right", frameon=True, framealpha=0.9, edgecolor="none", facecolor=palette.PAPER)
    axes.margins(x=0)


def _gravity(axes: Any, recording: Recording) -> None:
    axes.set_title("specific force at rest")
    found = rests(recording)
    if not found:
        nothing_to_draw(axes, "the robot never stands")
        return
    headings = np.array([rest.heading for rest in found])
    # Headings of different spans have no common zero.
    known = np.isfinite(headings).all() and len({rest.span for rest in found}) == 1
    across = np.degrees(headings) if known else np.arange(len(found))
    for index, (axis, colour) in enumerate((("x", RIGHT), ("y", LEFT))):
        axes.plot(across, [rest.force[index] for rest in found], "o", color=colour, label=f"f_{axis}")
    axes.axhline(0.0, color=palette.PALE, lw=0.8)
    axes.margins(x=0.1)
    axes.set_xlabel("heading [deg]" if known else "rest number")
    axes.set_ylabel("[m/s$^2$]")
    axes.legend()


def _shown(finding: CheckFinding) -> str:
    unit = "" if finding.unit in ("-", "SI") else f" {finding.unit}"
    return f"{finding.value:.3g}{unit}"


def position(value: float, expected: tuple[float, float]) -> float:
    """Where a value lies in its sound range: -1 and 1 are its ends; one-sided ranges are measured from the finite end.

    Args:
        value: any.
        expected: range; an infinite side maps everything on it inside.
    """
    low, high = expected
    if np.isfinite(low) and np.isfinite(high) and high > low:
        return float(2 * (value - low) / (high - low) - 1)
    end = low if np.isfinite(low) else high
    return float(np.sign(value - end) if np.isfinite(low) else np.sign(end - value)) * 0.5


def shown_findings(report: CheckReport) -> list[CheckFinding]:
    """Findings for the figure: those with an interval of some width, and every suspicious one."""
    return [
        f
        for f in report.findings
        if f.value is not None
        and f.expected is not None
        and (f.status is Status.SUSPICIOUS or (f.interval is not None and f.interval[1] > f.interval[0]))
    ]


def _ranges(axes: Any, report: CheckReport) -> None:
    axes.set_title("values in their sound ranges")
    findings = shown_findings(report)[::-1]
    axes.axvspan(-1, 1, color=palette.SHADE, lw=0)
    for row, finding in enumerate(findings):
        if finding.value is None or finding.expected is None or finding.interval is None:
            continue
        colour = COLOURS[finding.status]
        ends = np.clip([position(v, finding.expected) for v in finding.interval], -2.4, 2.4)
        axes.plot(ends, [row, row], color=colour, lw=2)
        axes.plot(np.clip(position(finding.value, finding.expected), -2.4, 2.4), row, "o", color=colour, ms=4)
        axes.text(2.5, row, _shown(finding), fontsize=6.5, va="center", color=colour)
    axes.set_yticks(range(len(findings)), [f"{f.check}: {f.channel}" for f in findings], fontsize=6.5)
    axes.set_xlim(-2.5, 4.3)
    axes.set_xticks([-1, 0, 1], ["low", "", "high"])
    axes.set_ylim(-1, max(len(findings), 1))
    axes.grid(visible=False)
