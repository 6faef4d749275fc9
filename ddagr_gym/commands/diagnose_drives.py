"""``ddagr diagnose FOLDER --calibration CAL``: each drive of a folder, and what changed over time."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

from ddagr_gym.commands.diagnose_arguments import Arguments
from ddagr_gym.commands.resumed import resumable
from ddagr_gym.errors import InputError
from ddagr_gym.progress import LinePrinter

if TYPE_CHECKING:
    from ddagr_gym.recordings.files import Limits

REFUSED = 1
"""Exit code where some drives have no answer; 2 where none has."""


def run_drives(arguments: Arguments, limits: Limits, parts: Path) -> int:
    """Answer for each drive, write the folder, print the table.

    Args:
        arguments: of the command, with a calibration and at least one folder.
        limits: on rows and bytes of files.
        parts: where answers are kept meanwhile.

    Returns:
        0 where every drive has an answer, else 1; 2 where none has.
    """
    import ddagr_gym
    from ddagr_gym.api.drive_series import ANSWERS

    calibration = _calibration_of(arguments)
    earlier = arguments.output.expanduser() / ANSWERS
    if earlier.is_dir():
        shutil.copytree(earlier, parts, dirs_exist_ok=True)
    with resumable(parts):
        result = ddagr_gym.diagnose_drives(
            list(arguments.runs),
            calibration,
            arguments.ground,
            seed=arguments.seed,
            threads=arguments.threads,
            processes=arguments.processes,
            cluster=arguments.cluster,
            column_map=arguments.map or None,
            limits=limits,
            progress=LinePrinter("ddagr diagnose: "),
            cache=parts,
        )
        result.report(arguments.output, overwrite=arguments.overwrite)
    print(result)
    print(f"\npage, drives.csv and drives.json: {arguments.output}")
    if len(result.refused) == len(result.drives):
        return 2
    return REFUSED if result.refused else 0


def _calibration_of(arguments: Arguments) -> Path:
    """The calibration; InputError where something is given that it, or the question, has no use for."""
    usual = Arguments(arguments.runs, arguments.output)
    options = (
        "robot", "soil", "before", "same_ground", "other_ground", "thresholds", "soil_uncertainty", "window", "stride",
        "names_only", "mcap", "rrd",
    )  # fmt: skip
    given = [name for name in options if getattr(arguments, name) != getattr(usual, name)]
    if given:
        option = f"--{given[0].replace('_', '-')}"
        raise InputError(f"{option} is given with a folder of drives and a calibration: leave it out.")
    if arguments.calibration is None:
        raise InputError("a folder of drives over time needs a calibration: name its folder with --calibration.")
    return arguments.calibration
