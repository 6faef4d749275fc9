"""``ddagr evaluate``: controllers over frozen scenario sets."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ddagr_gym.commands.output import atomic_path, format_table, make_folder, write_text
from ddagr_gym.commands.progress import Progress
from ddagr_gym.errors import InputError

EXAMPLES = (
    "ddagr evaluate --controllers B0,B1,B3 --scenarios S0 --output evaluation",
    "ddagr evaluate --controllers B1,true_curvature --scenarios S0,V --output evaluation",
)


@dataclass(frozen=True)
class Arguments:
    """Drive controllers over frozen scenarios and say which, how far off, how sure.

    An interrupted run continues where it stopped when it is started again with the same folder.

    Attributes:
        controllers: names, separated by commas.
        scenarios: names of frozen sets, separated by commas.
        output: folder for episodes.parquet, summary.json and the figure.
        processes: workers.
    """

    controllers: str = "B0,B1,B2,B3,B4,true_curvature"
    scenarios: str = "S0"
    output: Path = Path("ddagr_evaluation")
    processes: int = 2


def run(arguments: Arguments) -> None:
    """Drive, summarise, print the table."""
    from ddagr_gym.evaluation.campaign import run_campaign
    from ddagr_gym.evaluation.controllers import controller_title
    from ddagr_gym.evaluation.scenarios import load_scenarios
    from ddagr_gym.evaluation.summary import summaries

    controllers = _names(arguments.controllers, "controllers")
    sets = _names(arguments.scenarios, "scenarios")
    for name in controllers:
        controller_title(name)
    if arguments.processes < 1:
        raise InputError(f"--processes {arguments.processes}: give at least 1.")
    total = len(controllers) * sum(len(load_scenarios(name)) for name in sets)
    folder = make_folder(arguments.output)
    with Progress(total, "driving") as progress:
        rows = run_campaign(
            controllers, sets, folder / "episodes.jsonl", processes=arguments.processes, progress=progress.advance
        )
    summary = summaries(rows)
    _write(folder, rows, summary)
    print(format_table(*_table(summary)))
    print(f"\nEpisodes, summary and figure are in {folder.resolve()}")


def _names(text: str, option: str) -> list[str]:
    names = [name.strip() for name in text.split(",") if name.strip()]
    if not names:
        raise InputError(f"--{option} is empty: give names separated by commas.")
    return list(dict.fromkeys(names))


def _write(folder: Path, rows: list[dict[str, Any]], summary: dict[str, Any]) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    from ddagr_gym.reporting.evaluation_figures import radius_error_figure

    with atomic_path(folder / "episodes.parquet") as temporary:
        parquet.write_table(pa.Table.from_pylist(rows), temporary)
    write_text(folder / "summary.json", json.dumps(summary, indent=1))
    radius_error_figure(rows, folder / "radius_error.png")


def _table(summary: dict[str, Any]) -> tuple[tuple[str, ...], list[tuple[object, ...]]]:
    header = ("controller", "set", "episodes", "|e_R| median", "95 % interval", "|e_R| 95th percentile", "success")
    rows: list[tuple[object, ...]] = []
    for controller, sets in summary.items():
        for name, item in sets.items():
            if "radius_error_median" not in item:
                continue
            median, share = item["radius_error_median"], item["success_rate"]
            rows.append(
                (
                    controller,
                    name,
                    item["episodes"],
                    _percent(median["value"]),
                    f"{_percent(median['low'])} to {_percent(median['high'])}",
                    _percent(item["radius_error_p95"]["value"]),
                    f"{_percent(share['value'])} ({_percent(share['low'])} to {_percent(share['high'])})",
                )
            )
    return header, rows


def _percent(value: float | None) -> str:
    return "failed" if value is None else f"{100 * value:.1f} %"
