"""``ddagr isolability``: what manoeuvres and sensors could show and tell apart, before any data."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from ddagr_gym.commands.output import check_output_folder
from ddagr_gym.progress import LinePrinter

EXAMPLES = (
    "ddagr isolability --manoeuvres straight two_headings --output isolability",
    "ddagr isolability --robot warthog --manoeuvres stops arcs spin --sensors imu encoders",
)


@dataclass(frozen=True)
class Arguments:
    """Say which effects planned drives could show, how small, and which they could tell apart.

    The nominal robot is simulated over the manoeuvres with the sensors' default noise; from its sensitivities follow
    the least detectable size of each effect and the share of its trace that every other effect cannot imitate.

    Attributes:
        output: folder for isolability.json, isolability.txt and the figure; the table is only printed without one.
        manoeuvres: names of built-in drives, or CSV files of commands.
        sensors: some of imu, encoders, pose.
        robot: nominal robot: name (ddagr robots) or YAML file.
        soil: nominal soil: name (ddagr soils) or YAML file; as for `ddagr diagnose` when it is left out.
        soil_uncertainty: as for `ddagr diagnose`.
        thresholds: gates of `ddagr null-bank`; by default those that ship for the robot, and where none do those that
            normal noise alone asks for (chi-square): real drives need larger sizes then.
        seed: random seed of the sensor noise.
        overwrite: replace an output folder that an earlier command wrote.
    """

    output: Annotated[Path | None, tyro.conf.arg(aliases=("-o",))] = None
    manoeuvres: tuple[str, ...] = ("stops", "arcs", "spin", "s_weave")
    sensors: tuple[str, ...] = ("imu", "encoders", "pose")
    robot: str = "ddagr"
    soil: str = ""
    soil_uncertainty: float | None = None
    thresholds: Path | None = None
    seed: int = 0
    overwrite: bool = False


def run(arguments: Arguments) -> None:
    """Make the table, print it, write it."""
    import ddagr_gym

    if arguments.output is not None:
        check_output_folder(arguments.output, overwrite=arguments.overwrite)
    result = ddagr_gym.isolability(
        arguments.manoeuvres,
        arguments.sensors,
        arguments.robot,
        arguments.soil or None,
        soil_uncertainty=arguments.soil_uncertainty,
        thresholds=arguments.thresholds,
        seed=arguments.seed,
        progress=LinePrinter(),
    )
    print(result)
    if arguments.output is not None:
        result.report(arguments.output, overwrite=arguments.overwrite)
        print(f"\ntable, JSON and figure: {arguments.output}")
