"""Whether a Warthog's wheels carry out the turning that they are told, on asphalt, gravel and sand.

    python -m benchmarks.turning_limit [--recordings FOLDER] [--output FILE] [--figure FILE]

Steps of the commands that are held for more than 3 s: from then on the speeds of the banks are compared with what was
commanded, half of their difference (turning) and their mean (driving) by itself. A robot whose motors are too weak
falls behind in both; one whose controller limits the yaw rate keeps the mean. A minute; writes
``benchmarks/results/turning_limit.json`` and the figure of the theory page.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.answers.run_recordings_check import recordings_folder
from benchmarks.drivetrain.figures import COLOURS, RESOLUTION
from benchmarks.drivetrain.stretches import Stretch, find_stretches
from ddagr_gym import load_recording
from ddagr_gym.files import write_json
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.reporting.figures import house_style

Array = NDArray[np.float64]

REPOSITORY = Path(__file__).resolve().parents[1]
DRIVES = {
    "asphalt": "open/warthog_asphalt",
    "asphalt 2": "concealed/warthog_2",
    "gravel": "concealed/warthog_4",
    "sand": "open/warthog_sand",
    "sand 2": "concealed/warthog_5",
}
SETTLED = 3.0
"""Time since a step from which speeds count as settled [s]."""
BEYOND = 11.0
"""Half difference of the commands from which they are beyond the limit for certain [rad/s]."""
FEWEST = 5
"""Readings of each bank below which a step is left out."""


@dataclass(frozen=True)
class Steady:
    """Speeds that a drive settles at.

    Attributes:
        commanded: (S, 2) half difference and mean of the banks' commands [rad/s].
        measured: (S, 2) the same of the banks' speeds.
    """

    commanded: Array
    measured: Array


def steady_of(stretches: list[Stretch]) -> Steady:
    """Settled speeds of the steps of a drive."""
    rows = [row for stretch in stretches for row in _steps(stretch)]
    found = np.array(rows).reshape(-1, 2, 2)
    return Steady(_turning_and_mean(found[:, 0]), _turning_and_mean(found[:, 1]))


def _steps(stretch: Stretch) -> list[tuple[Array, Array]]:
    """Commands and mean speeds (2,) of the steps that are held long enough."""
    made = []
    for number in np.unique(stretch.step):
        late = (stretch.step == number) & (stretch.since > SETTLED)
        banks = [stretch.value[late & (stretch.bank == bank)] for bank in range(2)]
        if min(len(values) for values in banks) >= FEWEST:
            made.append((stretch.events[number - stretch.first], np.array([values.mean() for values in banks])))
    return made


def _turning_and_mean(banks: Array) -> Array:
    return np.stack([(banks[:, 0] - banks[:, 1]) / 2.0, banks.mean(axis=1)], axis=1)


def summary_of(steady: Steady) -> dict[str, Any]:
    """Figures of one drive: where commands are beyond the limit, and for the mean in the same steps."""
    beyond = np.abs(steady.commanded[:, 0]) > BEYOND
    sign = np.sign(steady.commanded[beyond, 0])
    turning, mean = (steady.measured[beyond, k] for k in range(2))
    shortfall = mean - steady.commanded[beyond, 1]
    return {
        "steps": len(beyond),
        "largest_commanded": float(np.abs(steady.commanded[:, 0]).max()),
        "steps_beyond": int(beyond.sum()),
        "turning_beyond": [float(q) for q in np.percentile(sign * turning, (10, 50, 90))] if beyond.any() else None,
        "error_of_mean_beyond": float(np.median(np.abs(shortfall))) if beyond.any() else None,
    }


def draw(drives: dict[str, Steady], path: Path) -> None:
    """Measured against commanded, turning and mean, one colour per drive."""
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(9.6, 4.4), layout="constrained")
        axes = figure.subplots(1, 2)
        for k, (axis, title) in enumerate(
            zip(axes, ("Half difference of the banks", "Mean of the banks"), strict=True)
        ):
            for name, steady in drives.items():
                sign = np.where(steady.commanded[:, k] < 0.0, -1.0, 1.0)
                axis.plot(
                    sign * steady.commanded[:, k], sign * steady.measured[:, k], ".", color=COLOURS[name], label=name
                )
            axis.axline((0.0, 0.0), slope=1.0, color="black", linewidth=0.8)
            axis.set(title=title, xlabel="commanded [rad/s]", ylabel="after 3 s [rad/s]")
        axes[1].legend()
        write_atomically(path, lambda part: figure.savefig(part, format="png", dpi=RESOLUTION))


def main(words: list[str] | None = None) -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--recordings", type=Path, default=recordings_folder(), help="folder with open/ and concealed/")
    parser.add_argument("--output", type=Path, default=REPOSITORY / "benchmarks" / "results" / "turning_limit.json")
    figures = REPOSITORY / "docs" / "theory" / "figures"
    parser.add_argument("--figure", type=Path, default=figures / "turning_limit.png")
    given = parser.parse_args(words)
    drives = {}
    for name, file in DRIVES.items():
        recording = load_recording(given.recordings / f"{file}.csv.gz", column_map="drive_steps", robot="warthog")
        drives[name] = steady_of(find_stretches(recording))
    results = {name: summary_of(steady) for name, steady in drives.items()}
    write_json(given.output, results)
    draw(drives, given.figure)
    for name, found in results.items():
        print(name, found)


if __name__ == "__main__":
    main()
