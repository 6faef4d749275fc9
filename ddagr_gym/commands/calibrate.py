"""``ddagr calibrate``: a robot's parameters from its ordinary drives."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from tyro.conf import Positional

from ddagr_gym.commands.output import check_output_folder
from ddagr_gym.commands.resumed import resumable
from ddagr_gym.errors import InputError
from ddagr_gym.extras import need
from ddagr_gym.progress import LinePrinter

EXAMPLES = (
    "ddagr calibrate monday.csv.gz tuesday.csv.gz --robot my_robot.yaml --output calibration",
    "ddagr calibrate yard.csv.gz field_1.csv.gz field_2.csv.gz --robot warthog --ground asphalt=yard.csv.gz "
    "--ground sand=field_1.csv.gz,field_2.csv.gz --soil asphalt=firm_ground --soil sand=lete_sand_wong -o calibration",
)


@dataclass(frozen=True)
class Arguments:
    """Fit a robot to its ordinary drives: parameters with intervals, checked on left-out drives.

    The robot's parameters are shared by all drives, the soil by those on one ground. Which parts of the robot are
    fitted is decided by forecasts of drives that are left out; what the drives do not identify keeps the data sheet's
    value. A calibration that was stopped goes on after its last finished step when the command is given again.

    Attributes:
        drives: ordinary drives of one robot (Parquet of `ddagr import`, or any source that it takes), or folders.
        output: folder to write: robot.yaml and soil_GROUND.yaml for every --robot, --soil and gym.make, effects.yaml,
            draws.yaml, bank.json (two drives or more), calibration.json, and one page, calibration.html.
        robot: its data sheet: a name (see `ddagr robots`), or the path of a YAML file with one's own.
        ground: NAME=DRIVE,DRIVE: drives on one ground, by the name of the file or the end of its path; may be repeated.
            Without it all drives are on one ground.
        soil: nominal soil (see `ddagr soils`) of all grounds, or NAME=SOIL of one; may be repeated.
        map: shipped map by name or the path of one's own YAML file, for sources that are not imported yet.
        seed: random seed of the resampled intervals.
        threads: threads of the simulator, in each process.
        processes: for what does not depend on each other: the fits from several starts, and the drives of the bank;
            each holds the drives that it works on.
        cluster: a Ray cluster to run that on: "local" starts one of so many processors here, an address
            (ray://HOST:PORT) takes one that runs.
        supply_currents: also fit currents that motors draw from their supply; their own current is always fitted.
        bank: also scan each drive for every effect of the library, with the robot calibrated without it, and write
            bank.json: what ordinary drives show of each. Without it other drives can be compared with nothing.
        overwrite: replace an output folder that an earlier command wrote.
        maximum_rows: refuse a recording with more rows or messages.
        maximum_bytes: refuse a recording that unpacks to more bytes.
    """

    drives: Positional[tuple[Path, ...]]
    output: Annotated[Path, tyro.conf.arg(aliases=("-o",))]
    robot: str
    ground: Annotated[tuple[str, ...], tyro.conf.UseAppendAction] = ()
    soil: Annotated[tuple[str, ...], tyro.conf.UseAppendAction] = ()
    map: str = ""
    seed: int = 0
    threads: int = 2
    processes: int = 1
    cluster: str = ""
    bank: bool = True
    supply_currents: bool = False
    overwrite: bool = False
    maximum_rows: int = 2_000_000
    maximum_bytes: int = 4 * 2**30


def run(arguments: Arguments) -> None:
    """Calibrate, write the folder, print the tables."""
    import ddagr_gym
    from ddagr_gym.diagnosis.store import part_folder
    from ddagr_gym.recordings.files import Limits

    check_output_folder(arguments.output, overwrite=arguments.overwrite)
    need("jinja2", "matplotlib")
    limits = Limits(arguments.maximum_rows, arguments.maximum_bytes)
    parts = part_folder(arguments.output.expanduser().resolve())
    grounds = {name: tuple(text.split(",")) for name, text in by_name("ground", arguments.ground).items()}
    with resumable(parts):
        result = ddagr_gym.calibrate(
            arguments.drives,
            arguments.robot,
            soils_from(arguments.soil),
            grounds,
            seed=arguments.seed,
            threads=arguments.threads,
            bank=arguments.bank,
            processes=arguments.processes,
            cluster=arguments.cluster,
            supply_currents=arguments.supply_currents,
            column_map=arguments.map or None,
            limits=limits,
            progress=LinePrinter("ddagr calibrate: "),
            cache=parts,
        )
        result.report(arguments.output, overwrite=arguments.overwrite)
    print(result)
    print(f"\nrobot.yaml, soils, calibration.json and page: {arguments.output}")


def by_name(option: str, given: tuple[str, ...]) -> dict[str, str]:
    """Texts NAME=VALUE as a mapping.

    Raises:
        InputError: a text without a name or a value, or a name given twice.
    """
    found: dict[str, str] = {}
    for text in given:
        name, sign, value = text.partition("=")
        if not (name and sign and value):
            raise InputError(f"--{option} is {text!r}: give NAME=VALUE.")
        if name in found:
            raise InputError(f"--{option} names {name!r} twice: give all of it at once.")
        found[name] = value
    return found


def soils_from(given: tuple[str, ...]) -> str | dict[str, str]:
    """One soil for all grounds, or a soil by ground; firm_ground by default."""
    if not given:
        return "firm_ground"
    if len(given) == 1 and "=" not in given[0]:
        return given[0]
    return by_name("soil", given)
