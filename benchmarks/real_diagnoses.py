"""What the data sheet's simulator lacks against real drives, as ``ddagr diagnose`` says it.

    python -m benchmarks.real_diagnoses FOLDER [--drives NAME ...] [--threads 2] [--output benchmarks/results]

Six ordinary drives of a Warthog and one of a Husky, of which we are not told what is wrong with it. Each is diagnosed
by itself, without a calibration, by the gates of simulated drives, on a soil of which only the kind is known
(uncertainty 4). Its page is written to FOLDER; a drive whose page is there is not diagnosed again. Writes
``real_diagnoses.json`` and ``real_diagnoses.png``: parts of the drivetrain that are named, and errors on stretches of
the same drive that nothing was fitted to, beside those of a learned model that was trained on the rest of the drive.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.answers.run_recordings_check import recordings_folder
from benchmarks.real_drives import __main__ as ordinary
from benchmarks.real_drives.ceiling import learned_errors
from ddagr_gym import diagnose, load_recording
from ddagr_gym.calibration.result import ForecastError
from ddagr_gym.diagnosis.answer.verdict import Diagnosis
from ddagr_gym.diagnosis.result.files import load
from ddagr_gym.files import make_folder, write_json
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.drivetrain_section import forecast_label, grouped_forecasts, root_mean_square
from ddagr_gym.reporting.figures import house_style

RESULTS = Path(__file__).resolve().parent / "results"
DRIVES = {**ordinary.DRIVES, "concealed/husky_1": ("tiles", "drive_steps")}
"""Ground and column map by file below ``shared/recordings``; the robot is the first word of a file's name."""

SOILS = {**ordinary.SOILS, "tiles": "firm_ground"}
"""Nominal soil of each ground."""

UNCERTAINTY = 4.0
"""Of the soil: a factor on that of one which is known by name."""

COMPARED = ("nominal", "kinematic", "corrected")
"""Errors of a :class:`~ddagr_gym.diagnosis.answer.drivetrain.ForecastComparison`."""

COLOURS = {"nominal": palette.PALE, "kinematic": palette.ORANGE, "corrected": palette.BLUE, "learned": palette.GREEN}

LEAST_TO_GAIN = 0.2
"""Share of the data sheet's error that the learned model must take off before a share of that means anything (ours)."""

WORDS = {
    "nominal": "data sheet",
    "kinematic": "effective track, delay, lag",
    "corrected": "with the drivetrain that is named",
    "learned": "learned (ceiling)",
}
SHOWN = ("heading after 5 s", "wheel speed")


def robot_of(name: str) -> str:
    """Name of the robot of one of :data:`DRIVES`."""
    return name.rpartition("/")[2].partition("_")[0]


def diagnosed(name: str, folder: Path, threads: int) -> Diagnosis:
    """Diagnosis of a drive, of which the page is written; the one that was written before where there is one.

    Args:
        name: of :data:`DRIVES`.
        folder: for the pages.
        threads: of the simulator.
    """
    page = folder / name.replace("/", "_")
    if not (page / "diagnosis.json").is_file():
        ground, column_map = DRIVES[name]
        result = diagnose(
            recordings_folder() / f"{name}.csv.gz", robot=robot_of(name), soil=SOILS[ground],
            soil_uncertainty=UNCERTAINTY, threads=threads, column_map=column_map,
            progress=lambda line: print(line, flush=True),
        )  # fmt: skip
        result.report(page)
    return load(page / "diagnosis.json")


def learned(name: str, folder: Path) -> dict[str, float]:
    """Errors of a learned model on every quarter of a drive, trained on the others: root mean squares by metric.

    Args:
        name: of :data:`DRIVES`.
        folder: of the pages, where they are kept.
    """
    kept = folder / f"{name.replace('/', '_')}.learned.json"
    if not kept.is_file():
        write_json(kept, _learned(name))
    return {label: float(error) for label, error in json.loads(kept.read_text()).items()}


def _learned(name: str) -> dict[str, float]:
    ground, column_map = DRIVES[name]
    recording = load_recording(recordings_folder() / f"{name}.csv.gz", column_map, robot_of(name))
    grouped: dict[str, list[ForecastError]] = {}
    for item in learned_errors(recording, get_robot(robot_of(name)), get_soil(SOILS[ground])):
        grouped.setdefault(forecast_label(item), []).append(item)
    return {
        label: root_mean_square([item.rms for item in items if item.rms is not None])
        for label, items in grouped.items()
    }


def entry(diagnosis: Diagnosis, ceiling: Mapping[str, float]) -> dict[str, Any]:
    """What is kept of a diagnosis, with errors of a learned model by metric beside those of the simulators."""
    answer = diagnosis.drivetrain
    sizes = {
        f"{finding.name} {name}": {"value": item.value, "unit": item.unit, "interval": item.interval}
        for finding in diagnosis.findings
        for name, item in finding.parameters.items()
    }
    kept = {
        "verdict": diagnosis.verdict, "complete": diagnosis.complete, "sentence": diagnosis.sentence, "sizes": sizes,
        "seconds": round(diagnosis.seconds, 1), "version": diagnosis.version,
    }  # fmt: skip
    if answer is None:
        return kept
    errors = {
        label: {
            "unit": items[0].unit,
            **{model: root_mean_square([getattr(item, model) for item in items]) for model in COMPARED},
            "learned": ceiling[label],
        }
        for items in grouped_forecasts(answer)
        for label in (forecast_label(items[0]),)
    }
    shares = {label: _share_of_learned(errors[label]) for label in SHOWN}
    parts = {part.name: {"kept": part.kept, "growth": part.growth, "error": part.error} for part in answer.parts}
    return {**kept, "explained": answer.explained, "share_of_learned": shares, "parts": parts, "errors": errors}


def _share_of_learned(errors: Mapping[str, Any]) -> float | None:
    """Share of what the learned model takes off the data sheet's error that the named drivetrain takes off.

    None where the learned model hardly takes anything off.
    """
    possible = errors["nominal"] - errors["learned"]
    known = possible > LEAST_TO_GAIN * errors["nominal"]
    return float((errors["nominal"] - errors["corrected"]) / possible) if known else None


def draw(entries: Mapping[str, Mapping[str, Any]], path: Path) -> None:
    """Errors of the three models on what was left out, by drive, as PNG, all or nothing."""
    known = {name: item["errors"] for name, item in entries.items() if "errors" in item}
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(10.0, 3.6), layout="constrained")
        for axes, metric in zip(figure.subplots(1, len(SHOWN)), SHOWN, strict=True):
            for place, (model, colour) in enumerate(COLOURS.items()):
                values = [errors[metric][model] for errors in known.values()]
                where = [row + 0.21 * (place - 1.5) for row in range(len(known))]
                axes.bar(where, values, width=0.2, color=colour, label=WORDS[model])
            axes.set_xticks(range(len(known)), [_label(name) for name in known])
            unit = next((errors[metric]["unit"] for errors in known.values()), "")
            axes.set_title(f"{metric} [{unit}], where nothing was fitted")
        figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
        write_atomically(path, lambda temporary: figure.savefig(temporary, format="png", dpi=130))


def _label(name: str) -> str:
    folder, _, drive = name.rpartition("/")
    return f"{DRIVES[name][0]}\n{folder if folder == 'open' else drive}"


def main(arguments: Sequence[str] | None = None) -> None:
    """Diagnose, collect, draw."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, help="for the pages")
    parser.add_argument("--drives", nargs="+", choices=tuple(DRIVES), default=tuple(DRIVES))
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--output", type=Path, default=RESULTS)
    given = parser.parse_args(arguments)
    folder, output = make_folder(given.folder), make_folder(given.output)
    entries: dict[str, Any] = {}
    for name in given.drives:
        print(f"{name}:", flush=True)
        entries[name] = entry(diagnosed(name, folder, given.threads), learned(name, folder))
        print(f"{name}: {entries[name]['sentence']}", flush=True)
        write_json(output / "real_diagnoses.json", entries)
        draw(entries, output / "real_diagnoses.png")


if __name__ == "__main__":
    main()
