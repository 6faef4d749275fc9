"""``ddagr check``: whether clocks, signs, units and sensors of recordings are sound, before anything is concluded."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from tyro.conf import Positional

from ddagr_gym.commands.output import check_output_folder
from ddagr_gym.progress import LinePrinter

EXAMPLES = (
    "ddagr check run.parquet",
    "ddagr check drive.csv.gz --map drive_steps --robot warthog --output checked",
    "ddagr check run_1.csv.gz run_2.csv.gz run_3.csv.gz --map concealed --robot ddagr --output checked",
)


@dataclass(frozen=True)
class Arguments:
    """Check recordings: rates, gaps, clocks, signs, scales, stuck channels, repeated readings, noise.

    Every question is answered with pass, suspicious or not testable, and what to do. Values carry 99 % intervals; one
    is suspicious only when its whole interval lies outside its sound range. The exit code is 1 when anything is
    suspicious or in doubt, such as a channel that is not there.

    Attributes:
        runs: recordings: Parquet of `ddagr import`, or any source that it takes. Several runs of one robot are also
            judged together.
        map: shipped map by name or the path of one's own YAML file, for sources that are not imported yet.
        robot: robot that drove (see `ddagr robots`), for checks that need its wheel radius and track.
        output: folder for one figure and one JSON report for each run.
        overwrite: replace an output folder that an earlier check wrote.
        all: list the questions that passed, too.
        seed: random seed of the resampling behind the intervals.
        maximum_rows: refuse a recording with more rows or messages.
        maximum_bytes: refuse a recording that unpacks to more bytes.
    """

    runs: Positional[tuple[Path, ...]]
    map: str = ""
    robot: str = ""
    output: Annotated[Path | None, tyro.conf.arg(aliases=("-o",))] = None
    overwrite: bool = False
    all: bool = False
    seed: int = 0
    maximum_rows: int = 2_000_000
    maximum_bytes: int = 4 * 2**30


def run(arguments: Arguments) -> int:
    """Check every run, print the tables, write figures and reports; 1 when anything is suspicious."""
    import ddagr_gym
    from ddagr_gym.api.inputs import recordings_from
    from ddagr_gym.recordings.files import Limits

    if arguments.output is not None:
        check_output_folder(arguments.output, overwrite=arguments.overwrite)
    limits = Limits(arguments.maximum_rows, arguments.maximum_bytes)
    recordings = recordings_from(arguments.runs, arguments.robot or None, arguments.map or None, limits)
    result = ddagr_gym.check(recordings, seed=arguments.seed)
    print(result.text(arguments.all))
    if arguments.output is not None:
        result.report(arguments.output, overwrite=arguments.overwrite, progress=LinePrinter())
        print(f"\nfigures and reports: {arguments.output}")
    return 0 if result.sound else 1
