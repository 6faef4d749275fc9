"""``ddagr replay``: recorded drives driven again in the simulator, and what it gets wrong."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from tyro.conf import Positional

from ddagr_gym.commands.output import check_output_folder
from ddagr_gym.errors import InputError
from ddagr_gym.progress import LinePrinter

EXAMPLES = (
    "ddagr replay run.parquet --robot ddagr --soil thesis_a1 --output replayed",
    "ddagr replay drive.csv.gz --map drive_steps --robot warthog --soil lete_sand_wong --refit --window 5 -o sand",
    "ddagr replay run_1.parquet run_2.parquet --robot ddagr --soil thesis_a1 --refit --together "
    "--effect slope=0.05 --output both",
    "ddagr replay drive.csv.gz --calibration calibration --ground sand --output replayed",
)


@dataclass(frozen=True)
class Arguments:
    """Drive recordings again in the simulator: residuals, error growth, refit, baselines.

    The simulator is driven by the recorded commands and, in a second drive mode, by the recorded wheel speeds: in short
    windows with free initial states, and from the state at a start over 1, 5 and 30 s and over every whole stretch.
    Parameters and baselines are fitted on one part of each recording (alternate steps, or blocks of time) and judged
    on the other.

    Attributes:
        runs: recordings: Parquet of `ddagr import`, or any source that it takes.
        output: folder to write: replay.json, figures as PNG and SVG, and one page, index.html.
        soil: nominal soil (see `ddagr soils`), or the path of a YAML file with one's own; needed without --calibration.
        robot: robot that drove (see `ddagr robots`), or a YAML file with one's own; that of the recordings when it is
            left out.
        calibration: folder that `ddagr calibrate` wrote, whose robot, soil and sensors are taken as they are.
        ground: the calibration's ground that the drive is on; may be left out where it has only one.
        map: shipped map by name or the path of one's own YAML file, for sources that are not imported yet.
        effects: missing physics to add, name=size or an effects file; may be repeated.
        window: length of the windows with free initial states [s]; fit with windows as long as the horizon that counts.
        refit: fit soil and uncertain robot parameters.
        together: let all runs share one set of fitted parameters; otherwise each is fitted on its own.
        overwrite: replace an output folder that an earlier command wrote.
        threads: threads of the simulator.
        seed: random seed of the resampled intervals.
        maximum_rows: refuse a recording with more rows or messages.
        maximum_bytes: refuse a recording that unpacks to more bytes.
    """

    runs: Positional[tuple[Path, ...]]
    output: Annotated[Path, tyro.conf.arg(aliases=("-o",))]
    soil: str = ""
    robot: str = ""
    calibration: Path | None = None
    ground: str = ""
    map: str = ""
    effects: Annotated[tuple[str, ...], tyro.conf.UseAppendAction, tyro.conf.arg(aliases=("--effect",))] = ()
    window: float = 2.0
    refit: bool = False
    together: bool = False
    overwrite: bool = False
    threads: int = 1
    seed: int = 0
    maximum_rows: int = 2_000_000
    maximum_bytes: int = 4 * 2**30


def run(arguments: Arguments) -> None:
    """Replay, print the tables, write report, figures and page."""
    import ddagr_gym
    from ddagr_gym.api.inputs import recordings_from
    from ddagr_gym.calibration.files import robot_file
    from ddagr_gym.recordings.files import Limits

    if not arguments.soil and arguments.calibration is None:
        raise InputError("no ground is given: name a --soil, or the folder of a --calibration.")
    check_output_folder(arguments.output, overwrite=arguments.overwrite)
    robot, limits = arguments.robot or None, Limits(arguments.maximum_rows, arguments.maximum_bytes)
    drove = robot if arguments.calibration is None else robot_file(arguments.calibration)
    result = ddagr_gym.replay(
        recordings_from(arguments.runs, drove, arguments.map or None, limits),
        robot,
        arguments.soil or None,
        effects=arguments.effects,
        calibration=arguments.calibration,
        ground=arguments.ground,
        window=arguments.window,
        refit=arguments.refit,
        together=arguments.together,
        threads=arguments.threads,
        seed=arguments.seed,
        progress=LinePrinter(),
    )
    result.report(arguments.output, overwrite=arguments.overwrite, progress=LinePrinter())
    print(result)
    print(f"\nreport, figures and page: {arguments.output}")
