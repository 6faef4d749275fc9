"""``ddagr adapt``: from recordings to a controller that is tuned on what they show."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro
from tyro.conf import Positional

from ddagr_gym.commands.output import check_output_folder
from ddagr_gym.commands.resumed import resumable
from ddagr_gym.extras import need
from ddagr_gym.progress import LinePrinter

EXAMPLES = (
    "ddagr adapt arcs.parquet weave.parquet --robot ddagr --soil thesis_a1 --output adapted",
    "ddagr adapt --diagnosis diagnosis --output adapted",
    "ddagr adapt today.csv.gz --calibration calibration --ground sand --output adapted",
)


@dataclass(frozen=True)
class Arguments:
    """Tune the turning controller on what recordings show, and report it before and after.

    Recordings are diagnosed; what was named, the refitted robot and the refitted soil make a corrected simulator.
    The controller gets them into its filter and its model, errors of sensors and commands are taken out, and gains
    are searched (and B4 is taught a feed-forward) on turns in that simulator, with sizes drawn from their
    intervals. What does worse there than the nominal controller is not kept. An adaptation that was stopped goes on
    when the command is given again. Recordings that hold something without a name (verdict unknown) are refused,
    unless --anyway is given.

    Attributes:
        runs: recordings (Parquet of `ddagr import`, or any source that it takes); none with a finished diagnosis.
        output: folder to write: controller.yaml, robot.yaml, soil.yaml and effects.yaml, which `ddagr evaluate
            --controllers FOLDER` loads, adaptation.json, and the page, index.html.
        robot: nominal robot (see `ddagr robots`), or the path of a YAML file with one's own; when it is left out that
            of the diagnosis, or as for `ddagr diagnose`.
        soil: nominal soil (see `ddagr soils`), or the path of a YAML file with one's own; likewise.
        diagnosis: folder that `ddagr diagnose` wrote, in place of recordings.
        calibration: folder that `ddagr calibrate` wrote, in place of robot and soil: alone, or with recordings that are
            compared with its ordinary drives (made without --no-bank then).
        ground: the calibration's ground that the turns are made on.
        controller: what is adapted: B4, the force balance, or B6, the path tracker.
        radius: radius of the turns [m].
        speed: speed of the turns [m/s].
        row_heading: direction of the rows in the world of the recordings' poses [rad]; it matters for slopes.
        turns: how many turns each controller drives for the report.
        anyway: adapt to the refitted robot and soil where the recordings hold something without a name.
        map: shipped map by name or the path of one's own YAML file, for sources that are not imported yet.
        seed: random seed of all draws.
        threads: threads of the diagnosis.
        overwrite: replace an output folder that an earlier command wrote.
    """

    output: Annotated[Path, tyro.conf.arg(aliases=("-o",))]
    runs: Positional[tuple[Path, ...]] = ()
    robot: str = ""
    soil: str = ""
    diagnosis: Path | None = None
    calibration: Path | None = None
    ground: str = ""
    controller: str = "B4"
    radius: float = 0.8
    speed: float = 0.2
    row_heading: float = 0.0
    turns: int = 20
    anyway: bool = False
    map: str = ""
    seed: int = 0
    threads: int = 2
    overwrite: bool = False


def run(arguments: Arguments) -> None:
    """Diagnose, adapt, write the folder, print the answer."""
    import ddagr_gym
    from ddagr_gym.diagnosis.store import part_folder

    check_output_folder(arguments.output, overwrite=arguments.overwrite)
    need("jinja2", "matplotlib")
    parts = part_folder(arguments.output.expanduser().resolve())
    with resumable(parts):
        result = ddagr_gym.adapt(
            list(arguments.runs) or None,
            arguments.robot or None,
            arguments.soil or None,
            **_options(arguments),
            progress=LinePrinter("ddagr adapt: "),
            cache=parts,
        )
        result.report(arguments.output, overwrite=arguments.overwrite)
    print(result)
    print(f"\npage, controller.yaml and what it knows: {arguments.output}")


def _options(arguments: Arguments) -> dict[str, Any]:
    names = (
        "diagnosis",
        "calibration",
        "ground",
        "controller",
        "radius",
        "speed",
        "row_heading",
        "turns",
        "anyway",
        "seed",
    )
    options = {name: getattr(arguments, name) for name in (*names, "threads")}
    return options | {"column_map": arguments.map or None}
