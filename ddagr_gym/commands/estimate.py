"""``ddagr estimate``: the filter over a recording, with its figures."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro
from tyro.conf import Positional

from ddagr_gym.progress import LinePrinter

EXAMPLES = (
    "ddagr estimate --thesis 6.2 --output estimate",
    "ddagr estimate --thesis 6.3 --filter thesis --output estimate_thesis",
    "ddagr estimate run.parquet --robot ddagr --soil thesis_a1 --output estimate",
    "ddagr estimate drive.csv.gz --map drive_steps --robot warthog --output estimate",
)


@dataclass(frozen=True)
class Arguments:
    """Estimate speeds and soil over a recording, with figures.

    Figures come in the order of the thesis's chapter 6. They show estimates with bands of two standard deviations, and
    the truth where the recording holds it.

    Attributes:
        run: recording, as `ddagr check` takes it; none with --thesis.
        thesis: drive and estimate the run of this table of the thesis's chapter 6 instead.
        robot: robot that drove (ddagr robots); the one that the recording names when it is left out.
        motor_rate: rate of the robot's speed loop [1/s], where it is not the preset's.
        soil: with --thesis the soil to drive on; else the soil whose parameters the figures shall show for comparison.
        map: column map, for sources that are not imported yet.
        filter: ours, or the thesis's eight-state filter.
        law: force law of our filter.
        attitude: our filter uses the recorded roll and pitch; only right where they count from the horizon.
        output: folder to write.
        overwrite: replace an output folder that an earlier command wrote.
        seed: random seed of the simulated run, and of what is resampled.
    """

    run: Positional[Path | None] = None
    thesis: Literal["6.2", "6.3"] | None = None
    robot: str = ""
    motor_rate: float | None = None
    soil: str = ""
    map: str = ""
    filter: Literal["ours", "thesis"] = "ours"
    law: Literal["coupled", "thesis"] = "coupled"
    attitude: bool = False
    output: Annotated[Path, tyro.conf.arg(aliases=("-o",))] = Path("ddagr_estimate")
    overwrite: bool = False
    seed: int = 0


def run(arguments: Arguments) -> None:
    """Estimate, write figures, table and summary, print the main figures."""
    import ddagr_gym

    result = ddagr_gym.estimate(
        arguments.run,
        arguments.robot or None,
        thesis=arguments.thesis,
        soil=arguments.soil or None,
        motor_rate=arguments.motor_rate,
        filter=arguments.filter,
        law=arguments.law,
        attitude=arguments.attitude,
        seed=arguments.seed,
        column_map=arguments.map or None,
    )
    result.report(arguments.output, overwrite=arguments.overwrite, progress=LinePrinter())
    print(result)
    print(f"\nFigures, table and summary are in {arguments.output.resolve()}")
