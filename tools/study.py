"""``./ddagr study``: experiments on a part of the toolkit, with a table and a figure."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from tyro.conf import Positional

from ddagr_gym.commands.output import format_table, make_folder, write_text
from ddagr_gym.progress import Progress
from tools import CHECKOUT

EXAMPLES = (
    "ddagr study filter",
    "ddagr study filter --recordings shared/recordings --output filter_study",
)


@dataclass(frozen=True)
class Arguments:
    """Study the filter on soils that it does not know, and on real drives.

    An interrupted study goes on where it stopped when it is started again with the same folder.

    Attributes:
        subject: what is studied.
        plan: YAML file of soils, drives and seeds.
        recordings: folder that holds open/ with real drives; DDAGR_RECORDINGS by default, none where that is not set.
        output: folder for filter.json and filter.png.
    """

    subject: Positional[Literal["filter"]]
    plan: Path = CHECKOUT / "benchmarks" / "filter_study" / "plan.yaml"
    recordings: Path | None = None
    output: Path = Path("ddagr_filter_study")


def run(arguments: Arguments) -> None:
    """Do the parts, write table and figure, print the main figures."""
    from benchmarks.filter_study.figure import filter_study_figure
    from benchmarks.filter_study.settings import load_filter_study
    from benchmarks.filter_study.study import run_study, study_parts
    from benchmarks.filter_study.summary import summarise_study

    settings = load_filter_study(arguments.plan)
    recordings = _recordings(arguments.recordings)
    folder = make_folder(arguments.output)
    journal = folder / f".filter-{settings.fingerprint[:12]}.jsonl"
    with Progress(len(study_parts(settings, recordings)), "filter study") as progress:
        results = run_study(settings, journal, recordings=recordings, progress=progress.advance)
    document = summarise_study(settings, results)
    write_text(folder / "filter.json", json.dumps(document, indent=1, allow_nan=False) + "\n")
    filter_study_figure(document, folder / "filter.png")
    journal.unlink(missing_ok=True)
    print(format_table(*_table(document)))
    if not document["real_drives"]:
        print("\nNo real drives: give --recordings the folder that holds open/, or set DDAGR_RECORDINGS.")
    print(f"\nTable and figure are in {folder.resolve()}")


def _recordings(given: Path | None) -> Path | None:
    named = os.environ.get("DDAGR_RECORDINGS")
    return given if given is not None else Path(named) if named else None


def _table(document: dict[str, Any]) -> tuple[tuple[str, ...], list[tuple[object, ...]]]:
    from benchmarks.filter_study.estimators import ESTIMATORS

    header = ("estimator", "soils", "radius error median", "95th percentile", "speed RMSE [mm/s]", "slip RMSE")
    rows: list[tuple[object, ...]] = []
    for estimator, spec in ESTIMATORS.items():
        for name, item in document[estimator].items():
            rows.append(
                (
                    spec.title,
                    name,
                    _percent(item["radius_error_median"]["value"]),
                    _percent(item["radius_error_p95"]["value"]),
                    _number(item.get("speed_rmse"), 1e3),
                    _number(item.get("slip_rmse"), 1.0),
                )
            )
    return header, rows


def _percent(value: float | None) -> str:
    return "broke down" if value is None else f"{100 * value:.1f} %"


def _number(figure: dict[str, Any] | None, factor: float) -> str:
    return "broke down" if figure is None or figure["value"] is None else f"{factor * figure['value']:.3g}"
