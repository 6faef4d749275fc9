"""``ddagr diagnose``: which physics the nominal simulator leaves out, from recordings."""

from __future__ import annotations

import shutil
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro
from tyro.conf import Positional

from ddagr_gym.commands.output import check_output_folder
from ddagr_gym.errors import InputError
from ddagr_gym.extras import need
from ddagr_gym.progress import LinePrinter

if TYPE_CHECKING:
    from ddagr_gym.api.diagnosis_report import DiagnosisReport
    from ddagr_gym.recordings.files import Limits

EXAMPLES = (
    "ddagr diagnose run_1.csv.gz run_2.csv.gz run_3.csv.gz --output diagnosis",
    "ddagr diagnose today.csv.gz --calibration calibration --ground sand --output changed",
    "ddagr diagnose today.csv.gz --before monday.csv.gz tuesday.csv.gz --same-ground --output changed",
    "ddagr diagnose today.csv.gz --output diagnosis --mcap today.mcap",
    "ddagr diagnose all_drives --calibration calibration --processes 2 --output over_time",
    "ddagr diagnose drives --robot ddagr --soil thesis_a1 --thresholds thresholds.json --output diagnosis",
)


@dataclass(frozen=True)
class Arguments:
    """Find the physics that a nominal simulator leaves out: where, what, how big, how sure.

    Several recordings of one robot on one ground are diagnosed together; each is then predicted by a model whose sizes
    were fitted to the others. With a single one its halves judge each other, which is weaker: place, day and biases are
    the same. A diagnosis that was stopped goes on after its last finished step when the command is given again.

    With --calibration the question is what changed against the ordinary drives of that robot: the page shows every
    effect against them, and from which size on a change would have been found. With --before the same is asked against
    drives from before, without a calibration.

    A folder with --calibration is many drives over time: each has an answer of its own, and the page shows all sizes as
    control charts and the first drive at which something changed. A drive that cannot be read or compared is a row with
    the reason, and the rest goes on. Answers are kept by content: after a stop, and with --overwrite and further drives
    in the folder, only missing ones are computed. Exit code 0 when every drive has an answer, 1 when some were refused,
    2 when all were, 130 after an interruption.

    Attributes:
        runs: recordings (Parquet of `ddagr import`, or any source that it takes), or folders of them.
        output: folder to write: index.html with its figures, diagnosis.json, evidence.npz, and what `gym.make`,
            `ddagr simulate` and `ddagr replay` load: effects.json or effects.yaml with the effects that were named, and
            robot.yaml and soil.yaml with the refitted nominal parameters. Of many drives: index.html, drives.csv,
            drives.json, and a diagnosis.json of each.
        robot: nominal robot (see `ddagr robots`), or the path of a YAML file with one's own.
        soil: nominal soil (see `ddagr soils`), or the path of a YAML file with one's own.
        calibration: folder that `ddagr calibrate --bank` wrote, whose robot, grounds and ordinary drives the recordings
            are compared with; robot, soil, thresholds, window and stride are left out then.
        ground: of the calibration that the recordings are on; left out for one that it does not know.
        before: drives of the same robot from before, when it was ordinary, all on one ground; with them robot and soil
            are where a fit to them begins.
        same_ground: the recordings are on the ground of the drives before.
        other_ground: they are on another one: its soil is free, and no change of soil has a name; so it is when neither
            is said.
        map: shipped map by name or the path of one's own YAML file, for sources that are not imported yet.
        thresholds: of `ddagr null-bank`, made with these or similar drives; those that ship with the package when it is
            left out.
        soil_uncertainty: factor on how far the soil may be from the nominal one; larger where it is only guessed. The
            thresholds must be of the same.
        window: length of the windows [s]; that of the thresholds when it is left out, with --before 4 s.
        stride: seconds between the starts of windows; their length, which uses all samples, when it is left out.
        seed: of the resampling.
        threads: of the simulator.
        mcap: file to write for Foxglove and PlotJuggler: drives, predictions of the nominal, the refitted and the
            corrected simulator, residuals over the noise, and findings with their stretches; a layout is put beside it.
            Needs foxglove-sdk.
        rrd: file to write for Rerun, with the same. Needs rerun-sdk.
        processes: of a folder with --calibration, how many drives at a time; each takes 0.3 to 1 GB.
        names_only: only name what is missing: no errors on unseen drives, no unnamed terms, no next drive, no page.
        overwrite: replace an output folder that an earlier command wrote.
        maximum_rows: refuse a recording with more rows or messages.
        maximum_bytes: refuse a recording that unpacks to more bytes.
    """

    runs: Positional[tuple[Path, ...]]
    output: Annotated[Path, tyro.conf.arg(aliases=("-o",))]
    robot: str = "ddagr"
    soil: str = "thesis_a1"
    calibration: Path | None = None
    ground: str = ""
    before: tuple[Path, ...] = ()
    same_ground: bool = False
    other_ground: bool = False
    map: str = ""
    thresholds: Path | None = None
    soil_uncertainty: float = 1.0
    window: float | None = None
    stride: float | None = None
    seed: int = 0
    threads: int = 2
    mcap: Path | None = None
    rrd: Path | None = None
    processes: int = 1
    names_only: bool = False
    overwrite: bool = False
    maximum_rows: int = 2_000_000
    maximum_bytes: int = 4 * 2**30


def run(arguments: Arguments) -> int | None:
    """Diagnose, write the folder, print the answer; 130 when interrupted."""
    import ddagr_gym
    from ddagr_gym.api.diagnosis_result import DiagnosisResult
    from ddagr_gym.api.inputs import is_folder_of_drives, recordings_from
    from ddagr_gym.calibration.files import ROBOT
    from ddagr_gym.commands.diagnose_drives import run_drives
    from ddagr_gym.diagnosis.store import part_folder
    from ddagr_gym.recordings.files import Limits

    check_output_folder(arguments.output, overwrite=arguments.overwrite)
    need(*(() if arguments.names_only else ("jinja2", "matplotlib")))
    _check_viewer_files(arguments)
    read_as = arguments.robot if arguments.calibration is None else str(arguments.calibration / ROBOT)
    limits = Limits(arguments.maximum_rows, arguments.maximum_bytes)
    parts = part_folder(arguments.output.expanduser().resolve())
    if arguments.calibration is not None and any(map(is_folder_of_drives, arguments.runs)):
        return run_drives(arguments, limits, parts)
    try:
        result = ddagr_gym.diagnose(
            recordings_from(arguments.runs, read_as, arguments.map or None, limits),
            arguments.robot,
            arguments.soil,
            **_compared_with(arguments, read_as, limits),
            thresholds=arguments.thresholds,
            soil_uncertainty=arguments.soil_uncertainty,
            window=arguments.window,
            stride=arguments.stride,
            seed=arguments.seed,
            threads=arguments.threads,
            names_only=arguments.names_only,
            progress=LinePrinter("ddagr diagnose: "),
            cache=parts,
        )
        # before the folder, whose presence would end a repetition of the command
        written = _write_viewer_files(arguments, result)
        result.report(arguments.output, overwrite=arguments.overwrite)
    except KeyboardInterrupt:
        print(f"ddagr: interrupted; the same command goes on from {parts}.", file=sys.stderr)
        return 130
    shutil.rmtree(parts, ignore_errors=True)
    if isinstance(result, DiagnosisResult) and result.robot is None:
        print(f"ddagr: robot.yaml and soil.yaml are left out, {result.refit_note}", file=sys.stderr)
    print(result)
    print(f"\n{'' if arguments.names_only else 'page, figures, '}diagnosis.json and effects.json: {arguments.output}")
    for line in written:
        print(line)
    return None


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


def _compared_with(arguments: Arguments, read_as: str, limits: Limits) -> dict[str, Any]:
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
