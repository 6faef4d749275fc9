"""Faults written into drives: does ``ddagr check`` name the channel at fault, and is it silent where nothing is wrong?

    python -m benchmarks.check_faults [--output benchmarks/results/check_faults.json] [--seeds N] [--sound N]

Every fault of :mod:`benchmarks.recording_faults` is written into the open real drives, into the three concealed ones
that are known to be ordinary (two, and a third whose gyro is mended first), and into simulated drives on two soils. A
fault counts as named where a finding of the arbitration (turning, driving, wheels, mounting, clocks, wheel limits) says
it in words. Controls are the same drives as they are; any suspicious finding of these checks there is a false alarm.
Beside them every question of ``ddagr check`` is asked of simulated sound drives of many kinds
(:mod:`benchmarks.simulated_checks`).
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.recording_faults import FAULTS, Fault, scaled
from benchmarks.simulated_checks import false_alarms
from ddagr_gym.files import write_json
from ddagr_gym.parameters import Imu, PoseReceiver, Sensors
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.checks.arbitration import arbitration
from ddagr_gym.recordings.checks.bank_limits import bank_limits
from ddagr_gym.recordings.checks.clock_drift import clock_drift
from ddagr_gym.recordings.checks.extremes import extremes
from ddagr_gym.recordings.checks.findings import Status
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.recordings.load import load_recording
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style
from ddagr_gym.simulator import simulate

RESULT = Path(__file__).resolve().parent / "results" / "check_faults.json"
REAL = (
    "open/warthog_asphalt", "open/warthog_grass", "open/warthog_sand", "concealed/warthog_2", "concealed/warthog_4",
    "concealed/warthog_5",
)  # fmt: skip
"""Ordinary drives of one robot; the gyro of warthog_4 is reversed, which is mended before anything is written."""
REVERSED_GYRO = "concealed/warthog_4"
SOILS = ("thesis_a1", "firm_ground")


def drives(folder: Path, seeds: Sequence[int]) -> Iterator[tuple[str, Recording]]:
    """Sound drives by name: the real ones, then simulated ones.

    Args:
        folder: of the recordings.
        seeds: of the simulated commands, for each soil.
    """
    for name in REAL:
        recording = load_recording(folder / f"{name}.csv.gz", robot="warthog")
        yield name.rpartition("/")[2], scaled(recording, ("yaw_rate",), -1.0) if name == REVERSED_GYRO else recording
    for soil in SOILS:
        for seed in seeds:
            yield f"{soil}_{seed}", simulated(soil, seed)


def simulated(soil: str, seed: int) -> Recording:
    """A minute of held commands of DDAGR with sensors of usual rates.

    Args:
        soil: name.
        seed: of commands and noise.
    """
    rng = np.random.default_rng(seed)
    commands = np.repeat(rng.uniform(-1.2, 1.3, (40, 2)) * (rng.random((40, 1)) < 0.9), 150, axis=0)
    commands[:150] = commands[-150:] = 0.0
    robot, sensors = get_robot("ddagr"), Sensors(imu=Imu(sample_rate=50.0), pose=PoseReceiver(rate=5.0))
    return Recording.from_columns(simulate(robot, get_soil(soil), commands, sensors=sensors, seed=seed), robot)


def said(recording: Recording) -> list[str]:
    """Suspicious findings of the checks in question, in words."""
    rng = np.random.default_rng(0)
    findings = arbitration(recording, rng) + clock_drift(recording, rng) + bank_limits(recording, rng)
    findings += extremes(recording)
    return [f"{f.check}, {f.channel}: {f.meaning}" for f in findings if f.status is Status.SUSPICIOUS]


def named(fault: Fault, sentences: Sequence[str]) -> bool:
    """Whether one of the sentences holds the words of a fault, all of one alternative."""
    return any(all(word in sentence for word in fault.words) for sentence in sentences)


def run(folder: Path, seeds: Sequence[int]) -> Iterator[dict[str, Any]]:
    """Table of faults by drives, after every drive."""
    rows: dict[str, dict[str, Any]] = {}
    for drive, sound in drives(folder, seeds):
        for name, fault in FAULTS.items():
            began = time.perf_counter()
            sentences = said(fault.write(sound))
            right = not sentences if fault.words == () else named(fault, sentences)
            entry = {"right": right, "said": sentences, "seconds": round(time.perf_counter() - began, 2)}
            rows.setdefault(name, {})[drive] = entry
        print(drive, sum(not row[drive]["right"] for row in rows.values()), "of", len(rows), "not right", flush=True)
        share = {name: float(np.mean([entry["right"] for entry in row.values()])) for name, row in rows.items()}
        yield {"schema_version": 1, "faults": rows, "share_right": share}


def draw(result: dict[str, Any], path: Path) -> None:
    """Picture of the table.

    Args:
        result: of :func:`run`.
        path: PNG to write.
    """
    from matplotlib.figure import Figure

    rows = result["faults"]
    names, columns = list(rows), list(next(iter(rows.values())))
    with house_style():
        figure = Figure(figsize=(max(7.0, 2.5 + 0.45 * len(columns)), 2.0 + 0.33 * len(names)), layout="constrained")
        axes = figure.subplots()
        for y, name in enumerate(names):
            for x, drive in enumerate(columns):
                right = rows[name][drive]["right"]
                axes.plot(x, y, "o" if right else "X", color=palette.BLUE if right else palette.VERMILLION, ms=9)
        axes.set_xticks(range(len(columns)), columns, rotation=60, ha="right")
        axes.set_yticks(range(len(names)), [f"{name} ({100 * result['share_right'][name]:.0f} %)" for name in names])
        axes.set_title("faults written into drives: named (dot) or not (cross)")
        axes.set_ylim(len(names) - 0.5, -0.5)
        axes.grid(visible=False)
        write_atomically(path, lambda to: figure.savefig(to, dpi=140, format="png", metadata={"Software": None}))


def main(words: Sequence[str] | None = None) -> int:
    """Write the table and its picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--output", type=Path, default=RESULT)
    parser.add_argument("--seeds", type=int, default=4, help="simulated drives with faults, on each soil")
    parser.add_argument("--sound", type=int, default=6, help="simulated sound drives of each robot, soil and way")
    options = parser.parse_args(words)
    shared = Path(os.environ.get("DDAGR_SHARED") or Path(__file__).resolve().parents[2] / "shared")
    folder = Path(os.environ.get("DDAGR_RECORDINGS") or shared / "recordings")
    if not (folder / "open").is_dir():
        print(f"no recordings in {folder}: set DDAGR_RECORDINGS", file=sys.stderr)
        return 2
    result: dict[str, Any] = {}
    for result in run(folder, range(options.seeds)):
        write_json(options.output, result)
        draw(result, options.output.with_suffix(".png"))
    write_json(options.output, {**result, "sound_simulated": false_alarms(range(options.sound))})
    for name, share in result["share_right"].items():
        print(f"{name:32} {100 * share:.0f} %")
    return 0


if __name__ == "__main__":
    sys.exit(main())
