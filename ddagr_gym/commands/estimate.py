"""``ddagr estimate``: the filter over a recording, with its figures."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from tyro.conf import Positional

from ddagr_gym.commands.output import atomic_path, format_table, output_folder, write_text
from ddagr_gym.errors import InputError
from ddagr_gym.progress import Progress

if TYPE_CHECKING:
    from ddagr_gym.evaluation.estimate_run import EstimatedRun

EXAMPLES = (
    "ddagr estimate --thesis 6.2 --output estimate",
    "ddagr estimate --thesis 6.3 --filter thesis --output estimate_thesis",
    "ddagr estimate run.parquet --robot ddagr --soil thesis_a1 --output estimate",
    "ddagr estimate drive.csv.gz --map drive_steps --robot warthog --output estimate",
)


@dataclass(frozen=True)
class Arguments:
    """Estimate speeds and soil over a recording, with figures.

    Figures stand in the order of the thesis's chapter 6. They show estimates with bands of two standard deviations, and
    the truth where the recording holds it.

    Attributes:
        run: recording, as `ddagr check` takes it; none with --thesis.
        thesis: drive and estimate the run of this table of the thesis's chapter 6 instead.
        robot: robot that drove (ddagr robots).
        motor_rate: of its speed loop [1/s], where it is not the preset's.
        soil: with --thesis the soil to drive on; else the soil whose parameters the figures shall show for comparison.
        map: column map, for sources that are not imported yet.
        filter: ours, or the thesis's eight-state filter.
        law: force law of our filter.
        attitude: use the recorded roll and pitch; only right where they count from the horizon.
        output: folder to write.
        overwrite: replace an output folder that an earlier command wrote.
        seed: of the simulated run, and of what is resampled.
    """

    run: Positional[Path | None] = None
    thesis: Literal["6.2", "6.3"] | None = None
    robot: str = "ddagr"
    motor_rate: float | None = None
    soil: str = ""
    map: str = ""
    filter: Literal["ours", "thesis"] = "ours"
    law: Literal["coupled", "thesis"] = "coupled"
    attitude: bool = False
    output: Path = Path("ddagr_estimate")
    overwrite: bool = False
    seed: int = 0


def run(arguments: Arguments) -> None:
    """Estimate, write figures, table and summary, print the main figures."""
    from ddagr_gym.evaluation.estimate_run import summary_of
    from ddagr_gym.evaluation.estimate_view import estimate_view, path_file
    from ddagr_gym.reporting.estimate_figures import figure_count, save_estimate_figures

    estimated = _estimated(arguments)
    summary = summary_of(estimated)
    view = estimate_view(estimated, arguments.thesis)
    with output_folder(arguments.output, overwrite=arguments.overwrite) as folder:
        _write_table(folder / "estimates.parquet", estimated)
        write_text(folder / "summary.json", json.dumps(summary, indent=1, allow_nan=False) + "\n")
        with Progress(figure_count(view), "figures") as progress:
            save_estimate_figures(view, folder, path_file(arguments.thesis), progress.advance)
    print(format_table(*_parameters(summary)))
    for name, value in summary["errors"].items():
        print(f"{name}: {'broke down' if value is None else f'{value:.4g}'}")
    if not summary["uses_commands"]:
        print("The motors do not follow the first-order model: wheel speeds were taken from the encoders alone.")
    print(f"\nFigures, table and summary are in {arguments.output.resolve()}")


def _estimated(arguments: Arguments) -> EstimatedRun:
    from ddagr_gym.estimation import ForceLaw
    from ddagr_gym.evaluation.estimate_run import estimate_recording, estimate_thesis_run
    from ddagr_gym.presets import get_robot, get_soil
    from ddagr_gym.recordings.load import load_recording

    if (arguments.run is None) == (arguments.thesis is None):
        raise InputError("give either a recording or --thesis 6.2 or 6.3: one of them is what is estimated.")
    law = ForceLaw[arguments.law]
    if arguments.thesis is not None:
        for option, default in (("robot", "ddagr"), ("motor_rate", None), ("map", "")):
            if getattr(arguments, option) != default:
                raise InputError(
                    f"--{option.replace('_', '-')} {getattr(arguments, option)}: the thesis's runs have their own; "
                    "leave it out."
                )
        return estimate_thesis_run(arguments.thesis, arguments.soil, arguments.filter, law, arguments.seed)
    assert arguments.run is not None
    robot = get_robot(arguments.robot)
    if arguments.motor_rate is not None:
        robot = replace(robot, motor_rate=arguments.motor_rate)
    recording = load_recording(arguments.run, arguments.map or None, arguments.robot)
    soil = get_soil(arguments.soil) if arguments.soil else None
    return estimate_recording(recording, robot, soil, arguments.filter, law, arguments.attitude, arguments.seed)


def _write_table(path: Path, estimated: EstimatedRun) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    from ddagr_gym.evaluation.estimate_run import table_of

    with atomic_path(path) as temporary:
        parquet.write_table(pa.table(table_of(estimated)), temporary)


def _parameters(summary: dict[str, Any]) -> tuple[tuple[str, ...], list[tuple[object, ...]]]:
    header = ("parameter", "estimate", "relative deviation", "best fit to the truth")
    rows = [
        (name.replace("_", " "), *(_cell(item[key]) for key in ("value", "log_deviation", "best_fit")))
        for name, item in summary["parameters"].items()
    ]
    return header, rows


def _cell(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"
