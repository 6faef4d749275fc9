"""What it is worth to know what was driven right before a window: errors of the wheel speeds by a calibrated robot.

    python -m benchmarks.run_in CALIBRATION [--threads 2] [--output FILE]

CALIBRATION is the folder that ``python -m benchmarks.real_drives --calibration`` writes. The windows of its drives are
simulated by commands from the motion at their start, with the robot and soils as they are, in which the integral parts
of the speed loops at the start are taken to have settled where each step is alone, follow the commands and wheel speeds
before where those are known, and are what a simulation of so many seconds before leaves (run-in). A minute; writes
``run_in.json`` and ``run_in.png``: medians over all samples, with 95 % intervals over windows.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.real_drives.__main__ import DRIVES, SOILS, load_drives
from ddagr_gym.api.nominal import robot_from, soil_from
from ddagr_gym.calibration.calibration_data import CalibrationData
from ddagr_gym.calibration.files import load_robot, load_soil
from ddagr_gym.calibration.left_out import ENCODERS
from ddagr_gym.calibration.run import ready_drives
from ddagr_gym.calibration.settings import HISTORY, CalibrationSettings
from ddagr_gym.files import write_json
from ddagr_gym.identification.fit_numerics import field_numerics
from ddagr_gym.identification.window_model import WindowModel
from ddagr_gym.identification.windows import WindowSet, cut_windows, with_presumed_past
from ddagr_gym.physics.effects.files import load_effects
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.replay_analysis.horizons import sample_errors
from ddagr_gym.replay_analysis.intervals import error_statistics
from ddagr_gym.reporting.figures import house_style

RESULT = Path(__file__).resolve().parent / "results" / "run_in.json"
LENGTHS = (1.0, 2.0, 4.0, 5.5)
"""Of the run-in [s]; a step of these drives takes 6 s."""
ALONE, BEFORE = "each step alone", "commands before"


def ordinary_drives(threads: int) -> CalibrationData:
    """The drives of :mod:`benchmarks.real_drives`, mended as a calibration does."""
    grounds = [ground for ground, _ in DRIVES.values()]
    soils = {ground: soil_from(name) for ground, name in SOILS.items()}
    return ready_drives(load_drives(), grounds, robot_from("warthog"), soils, CalibrationSettings(threads=threads))


def variants(data: CalibrationData) -> dict[str, WindowSet]:
    """Windows of all drives by what is known of before them."""

    def cut(run_in: float) -> WindowSet:
        robot = data.robot
        return cut_windows(
            data.prepared.recordings, data.windows.duration, wheel_radius=robot.outer_radius,
            half_track=robot.half_track, history=HISTORY, run_in=run_in,
        )  # fmt: skip

    plain = cut(0.0)
    first = {(n, s.start) for n, recording in enumerate(data.prepared.recordings) for s in recording.segments()}
    begins = np.array([(n, s) in first for n, s in zip(plain.recording.tolist(), plain.start.tolist(), strict=True)])
    alone = replace(
        plain, unknown=np.where(begins, plain.history, plain.unknown),
        speeds=np.where(begins[:, None, None], np.nan, plain.speeds),
    )  # fmt: skip
    lengths = {f"run-in {length:g} s": cut(length) for length in LENGTHS}
    return {name: with_presumed_past(found) for name, found in {ALONE: alone, BEFORE: plain, **lengths}.items()}


def rows_of(data: CalibrationData, calibration: Path, threads: int, seed: int) -> list[dict[str, Any]]:
    """Errors of the wheel speeds by drive and variant [rad/s]."""
    robot, effects = load_robot(calibration), load_effects(calibration / "effects.yaml")
    found = []
    for name, windows in variants(data).items():
        for drive, ground in enumerate(data.grounds):
            chosen = windows.subset(windows.recording == drive)
            soil = load_soil(calibration, ground)[1]
            model = WindowModel(robot, soil, chosen, numerics=field_numerics(), threads=threads)
            errors, clusters = sample_errors(chosen, model.predict(np.zeros(0), chosen.initial, effects), ENCODERS)
            size = error_statistics(errors, clusters, np.random.default_rng(seed))
            found.append({
                "drive": data.names[drive], "before": name, "windows": chosen.count,
                "with_run_in": 0 if chosen.run_in is None else len(chosen.run_in.leads_to),
                "median": size.median, "median_interval": size.median_interval,
                "rms": size.rms, "rms_interval": size.rms_interval,
            })  # fmt: skip
    return found


def draw(rows: Sequence[dict[str, Any]], path: Path) -> None:
    """Medians by drive and variant."""
    from matplotlib.figure import Figure

    drives, names = (list(dict.fromkeys(row[key] for row in rows)) for key in ("drive", "before"))
    with house_style():
        figure = Figure(figsize=(8.0, 3.8), layout="constrained")
        panel = figure.subplots()
        shades = [palette.PALE, palette.ORANGE, *(palette.BLUE for _ in LENGTHS)]
        for number, name in enumerate(names):
            chosen = [row for row in rows if row["before"] == name]
            at = [drives.index(row["drive"]) + 0.14 * (number - (len(names) - 1) / 2.0) for row in chosen]
            low, high = (np.array([abs(r["median"] - r["median_interval"][k]) for r in chosen]) for k in (0, 1))
            opacity = 1.0 if number < 2 else 0.4 + 0.6 * (number - 2) / (len(LENGTHS) - 1)
            panel.bar(
                at, [row["median"] for row in chosen], 0.13, yerr=[low, high], color=shades[number], alpha=opacity,
                label=name, error_kw={"linewidth": 0.7},
            )  # fmt: skip
        panel.set_xticks(range(len(drives)), [drive.removesuffix(".csv.gz").replace("_", " ") for drive in drives])
        panel.set_ylabel("median error of wheel speeds [rad/s]")
        panel.margins(y=0.25)
        panel.legend(title="known of before the window", ncols=3, loc="upper center")
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=120))


def main(arguments: Sequence[str] | None = None) -> int:
    """Simulate, compare, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("calibration", type=Path)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--output", type=Path, default=RESULT)
    given = parser.parse_args(arguments)
    rows = rows_of(ordinary_drives(given.threads), given.calibration, given.threads, given.seed)
    write_json(given.output, {"command": "python -m benchmarks.run_in CALIBRATION", "rows": rows})
    draw(rows, given.output.with_suffix(".png"))
    for row in rows:
        print(
            f"{row['drive']}, {row['before']}: {row['median']:.3f} {np.round(row['median_interval'], 3).tolist()} rad/s"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
