"""``ddagr diagnose``: which physics the nominal simulator leaves out, from recordings."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

from ddagr_gym.commands.diagnose_arguments import EXAMPLES, Arguments
from ddagr_gym.commands.output import check_output_folder
from ddagr_gym.commands.resumed import resumable
from ddagr_gym.errors import InputError
from ddagr_gym.extras import need
from ddagr_gym.progress import LinePrinter

if TYPE_CHECKING:
    from ddagr_gym.api.diagnosis_report import DiagnosisReport
    from ddagr_gym.recordings.files import Limits

__all__ = ["EXAMPLES", "Arguments", "run"]


def run(arguments: Arguments) -> int | None:
    """Diagnose, write the folder, print the answer."""
    import ddagr_gym
    from ddagr_gym.api.diagnosis_result import DiagnosisResult
    from ddagr_gym.api.inputs import is_folder_of_drives, recordings_from
    from ddagr_gym.calibration.files import ground_to_add, robot_file
    from ddagr_gym.commands.diagnose_drives import run_drives
    from ddagr_gym.diagnosis.store import part_folder
    from ddagr_gym.recordings.files import Limits

    check_output_folder(arguments.output, overwrite=arguments.overwrite)
    if arguments.before and not arguments.runs:
        taken = " ".join(map(str, arguments.before))
        raise InputError(f"--before takes all that follows it ({taken}): put the drive in question in front of it.")
    need(*(() if arguments.names_only else ("jinja2", "matplotlib")))
    _check_viewer_files(arguments)
    read_as = (arguments.robot or None) if arguments.calibration is None else robot_file(arguments.calibration)
    if arguments.calibration is not None and (hint := ground_to_add(arguments.calibration, arguments.ground)):
        print(f"ddagr: {hint}", file=sys.stderr)
    limits = Limits(arguments.maximum_rows, arguments.maximum_bytes)
    parts = part_folder(arguments.output.expanduser().resolve())
    if arguments.calibration is not None and any(map(is_folder_of_drives, arguments.runs)):
        return run_drives(arguments, limits, parts)
    _check_one_group(arguments)
    # a comparison with ordinary drives takes minutes and keeps no steps
    kept = None if arguments.before or arguments.calibration is not None else parts
    with resumable(kept):
        result = ddagr_gym.diagnose(
            recordings_from(arguments.runs, read_as, arguments.map or None, limits),
            arguments.robot or None,
            arguments.soil or None,
            **_compared_with(arguments, read_as, limits),
            thresholds=arguments.thresholds,
            soil_uncertainty=arguments.soil_uncertainty,
            window=arguments.window,
            stride=arguments.stride,
            seed=arguments.seed,
            threads=arguments.threads,
            names_only=arguments.names_only,
            progress=LinePrinter("ddagr diagnose: "),
            cache=kept,
        )
        # before the folder, whose presence would end a repetition of the command
        written = _write_viewer_files(arguments, result)
        result.report(arguments.output, overwrite=arguments.overwrite)
    if isinstance(result, DiagnosisResult) and result.robot is None:
        print(f"ddagr: robot.yaml and soil.yaml are left out, {result.refit_note}", file=sys.stderr)
    print(result)
    files = (
        "diagnosis.json and effects.yaml" if arguments.names_only else "page, figures, diagnosis.json and effects.yaml"
    )
    print(f"\n{files} are in {arguments.output}")
    for line in written:
        print(line)
    return None


def _check_one_group(arguments: Arguments) -> None:
    """Refuse what only drives that are answered one by one have a use for; InputError."""
    for name in ("processes", "cluster"):
        if getattr(arguments, name) != getattr(Arguments, name):
            raise InputError(f"--{name} is for a folder of drives with --calibration: leave it out.")


def _check_viewer_files(arguments: Arguments) -> None:
    """Refuse before long work what cannot be written after it; InputError."""
    from ddagr_gym.viewers.mcap_file import check_mcap_path
    from ddagr_gym.viewers.rerun_file import check_rrd_path

    if arguments.mcap is not None:
        need("foxglove")
        check_mcap_path(arguments.mcap)
    if arguments.rrd is not None:
        need("rerun")
        check_rrd_path(arguments.rrd)
    folder = arguments.output.expanduser().resolve()
    for path in (arguments.mcap, arguments.rrd):
        if path is not None and folder in path.expanduser().resolve().parents:
            raise InputError(
                f"{path} lies in {arguments.output}, which is written as a whole: choose a place beside it."
            )


def _write_viewer_files(arguments: Arguments, result: DiagnosisReport) -> list[str]:
    """Write what was asked for; a line for each."""
    from ddagr_gym.viewers.mcap_file import layout_path

    lines = []
    if arguments.mcap is not None:
        result.to_mcap(arguments.mcap, progress=LinePrinter("ddagr diagnose: "))
        lines.append(
            f"for Foxglove and PlotJuggler: {arguments.mcap}; Foxglove's layout: {layout_path(arguments.mcap)}"
        )
    if arguments.rrd is not None:
        lines.append(f"for Rerun: {result.to_rrd(arguments.rrd)}")
    return lines


def _compared_with(arguments: Arguments, read_as: str | None, limits: Limits) -> dict[str, Any]:
    """What the recordings are compared with, as `diagnose` takes it; InputError where the ground is said twice."""
    from ddagr_gym.api.inputs import recordings_from

    if arguments.same_ground and arguments.other_ground:
        raise InputError("the ground is said to be the same and another one: give --same-ground or --other-ground.")
    before = recordings_from(arguments.before, read_as, arguments.map or None, limits) if arguments.before else None
    said = arguments.same_ground or arguments.other_ground
    return {
        "calibration": arguments.calibration,
        "ground": arguments.ground,
        "before": before,
        "same_ground": arguments.same_ground if said else None,
    }
