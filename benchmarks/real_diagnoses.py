"""What the data sheet's simulator lacks against each ordinary drive of a Warthog, as ``ddagr diagnose`` says it.

    python -m benchmarks.real_diagnoses FOLDER [--drives NAME ...] [--threads 2] [--output benchmarks/results]

Each drive is diagnosed by itself, without a calibration, by the gates of simulated drives, on a soil of which only the
kind is known (uncertainty 4). Its page is written to FOLDER; a drive whose page is there is not diagnosed again. Writes
``real_diagnoses.json`` and ``real_diagnoses.png``: parts of the drivetrain that are named, and errors on stretches of
the same drive that nothing was fitted to.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.answers.run_recordings_check import recordings_folder
from benchmarks.real_drives.__main__ import DRIVES, SOILS
from ddagr_gym import diagnose
from ddagr_gym.diagnosis.answer.verdict import Diagnosis
from ddagr_gym.diagnosis.result.files import load
from ddagr_gym.files import make_folder, write_json
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.drivetrain_section import forecast_label, grouped_forecasts, root_mean_square
from ddagr_gym.reporting.figures import house_style

RESULTS = Path(__file__).resolve().parent / "results"
UNCERTAINTY = 4.0
"""Of the soil: a factor on that of one which is known by name."""

MODELS = (("nominal", palette.PALE), ("kinematic", palette.ORANGE), ("corrected", palette.BLUE))
"""Errors of a :class:`~ddagr_gym.diagnosis.answer.drivetrain.ForecastComparison` and their colours."""

WORDS = {
    "nominal": "data sheet",
    "kinematic": "effective track, delay, lag",
    "corrected": "with the drivetrain that is named",
}
SHOWN = ("heading after 5 s", "wheel speed")


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
            recordings_folder() / f"{name}.csv.gz", robot="warthog", soil=SOILS[ground], soil_uncertainty=UNCERTAINTY,
            threads=threads, column_map=column_map, progress=lambda line: print(line, flush=True),
        )  # fmt: skip
        result.report(page)
    return load(page / "diagnosis.json")


def entry(diagnosis: Diagnosis) -> dict[str, Any]:
    """What is kept of a diagnosis."""
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
        forecast_label(items[0]): {
            "unit": items[0].unit,
            **{model: root_mean_square([getattr(item, model) for item in items]) for model, _ in MODELS},
        }
        for items in grouped_forecasts(answer)
    }
    parts = {part.name: {"kept": part.kept, "growth": part.growth, "error": part.error} for part in answer.parts}
    return {**kept, "explained": answer.explained, "parts": parts, "errors": errors}


def draw(entries: Mapping[str, Mapping[str, Any]], path: Path) -> None:
    """Errors of the three models on what was left out, by drive, as PNG, all or nothing."""
    known = {name: item["errors"] for name, item in entries.items() if "errors" in item}
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(8.0, 3.4), layout="constrained")
        for axes, metric in zip(figure.subplots(1, len(SHOWN)), SHOWN, strict=True):
            for place, (model, colour) in enumerate(MODELS):
                values = [errors[metric][model] for errors in known.values()]
                where = [row + 0.27 * (place - 1) for row in range(len(known))]
                axes.bar(where, values, width=0.25, color=colour, label=WORDS[model])
            axes.set_xticks(range(len(known)), [_label(name) for name in known])
            unit = next((errors[metric]["unit"] for errors in known.values()), "")
            axes.set_title(f"{metric} [{unit}], where nothing was fitted")
        figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
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
        entries[name] = entry(diagnosed(name, folder, given.threads))
        print(f"{name}: {entries[name]['sentence']}", flush=True)
        write_json(output / "real_diagnoses.json", entries)
        draw(entries, output / "real_diagnoses.png")


if __name__ == "__main__":
    main()
