"""``ddagr simulate``: one drive of a robot by open-loop commands."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from ddagr_gym.errors import InputError
from ddagr_gym.files import check_output_file

EXAMPLES = (
    "ddagr simulate --manoeuvre table_6_2 --soil thesis_a1 --output run.parquet",
    "ddagr simulate --manoeuvre arcs --soil lete_sand_wong --effect towed_drag=80 --effect slope=0.05 --video a.mp4",
    "ddagr simulate --manoeuvre commands.csv --robot husky --soil firm_ground --output run.csv --video run.mp4",
)


@dataclass(frozen=True)
class Arguments:
    """Simulate a drive and write its recording, figure or video.

    Attributes:
        manoeuvre: name of a built-in drive, or a CSV with columns t, command_right, command_left [s, rad/s].
        soil: name of a soil (ddagr soils), or the path of a YAML file with one's own.
        robot: name of a robot (ddagr robots), or the path of a YAML file with one's own.
        effect: missing physics, name=size or name=size,parameter=value, or an effects file; may be repeated.
        output: recording to write, .parquet or .csv.
        figure: figure to write, .png (an .svg is written beside it).
        video: video to write, .mp4.
        rate: sensor samples per second [Hz].
        pose_rate: fixes of a pose receiver per second [Hz]; 0 for none.
        noise: sensor noise; --no-noise for ideal sensors.
        seed: random seed of the sensor noise.
        fine: converged numerics, about forty times slower, instead of the default (nine in ten force errors below
            1.3e-3).
    """

    manoeuvre: str = "table_6_2"
    soil: str = "thesis_a1"
    robot: str = "ddagr"
    effect: Annotated[tuple[str, ...], tyro.conf.UseAppendAction, tyro.conf.arg(aliases=("--effects",))] = ()
    output: Annotated[Path | None, tyro.conf.arg(aliases=("-o",))] = None
    figure: Path | None = None
    video: Path | None = None
    rate: float = 125.0
    pose_rate: float = 0.0
    noise: bool = True
    seed: int = 0
    fine: bool = False


def run(arguments: Arguments) -> None:
    """Simulate, write what was asked for, and print where the drive ended."""
    import ddagr_gym

    _check_output("output", arguments.output, ".parquet", ".csv")
    _check_output("figure", arguments.figure, ".png")
    _check_output("video", arguments.video, ".mp4")
    result = ddagr_gym.simulate(
        arguments.manoeuvre,
        arguments.robot,
        arguments.soil,
        arguments.effect,
        rate=arguments.rate,
        pose_rate=arguments.pose_rate,
        noise=arguments.noise,
        seed=arguments.seed,
        fine=arguments.fine,
    )
    if arguments.output is not None:
        result.save(arguments.output)
    if arguments.figure is not None:
        result.figure(arguments.figure)
    if arguments.video is not None:
        result.video(arguments.video)
    print(result)


def _check_output(option: str, path: Path | None, *allowed: str) -> None:
    """Refuse before the drive what cannot be written after it."""
    if path is None:
        return
    if path.suffix.lower() not in allowed:
        raise InputError(f"--{option} {path}: give a path that ends in {' or '.join(allowed)}.")
    check_output_file(path)
