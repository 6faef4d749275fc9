"""The full evaluation of row turns: which controllers and policies drive which scenario sets, and what is kept of it.

    python -m benchmarks.row_turns --output FOLDER [--workers 2]

Drives :data:`PLAN` as ``ddagr evaluate`` does, with the same dataset, page and files (about twenty minutes of one core;
stopped and started again with the same folder, it goes on), then writes ``benchmarks/results/row_turns.json`` and the
figure of the page of results, ``docs/radius_error.png``. The JSON file has the form of ``summary.json``, {controller:
{set: {metric: {value, interval}}}}, and one entry more, ``_run``: command line, commits, who drove what, hashes of
scenarios and policies, and what became of the claims.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from benchmarks.commits import commit_of
from ddagr_gym.commands.evaluate import without_stars
from ddagr_gym.commands.evaluation_report import assemble, write_files, write_report
from ddagr_gym.commands.output import make_folder, write_bytes, write_text
from ddagr_gym.evaluation.campaign import run_campaign, wanted_episodes, with_bounds
from ddagr_gym.evaluation.claims import check_claims, load_claims
from ddagr_gym.evaluation.controllers import BOUNDS
from ddagr_gym.evaluation.dataset import EPISODES
from ddagr_gym.evaluation.report_data import Evaluation
from ddagr_gym.evaluation.summary import summaries
from ddagr_gym.progress import Progress
from ddagr_gym.reporting.evaluation_figures import radius_error_figure

CHECKOUT = Path(__file__).resolve().parents[1]
RESULT = CHECKOUT / "benchmarks" / "results" / "row_turns.json"
FIGURE = CHECKOUT / "docs" / "radius_error.png"

SETS = ("S0", "S1", "S2", "S3", "S4", "S5", "S6", "S7", "S8", "T")
OTHERS = tuple(name for name in SETS if name not in ("S1", "T"))
PLAN: tuple[tuple[tuple[str, ...], tuple[str, ...]], ...] = (
    (("B0", "B1", "B2", "B3", "B4", "ppo_ekf_seed_*", "true_curvature", "true_soil", "true_path"), SETS),
    (("ppo_raw_seed_*", "ppo_history_seed_*"), ("S1", "T")),
    (("ppo_raw", "ppo_history"), OTHERS),
    (("ppo_ekf@feed_forward", "ppo_ekf@frozen", "ppo_ekf@wrong", "ppo_ekf@true"), ("S1",)),
    (("ppo_ekf_fixed_seed_*", "ppo_ekf_absolute_seed_*", "sac_ekf_seed_*"), ("S1",)),
    (("B5",), ("S0", "S1")),
)
"""Controllers and the sets that they drive. What the claims are about drives all of them with all of its seeds; to save
time the other learned arms drive S1 and T with all of theirs and the rest with the selected one, ablations drive S1,
and B5, which takes half a second of CPU a turn, S0 and S1."""

ORDER = ("B0", "B1", "B2", "B3", "B4", "B5", "ppo_ekf", "ppo_history", "ppo_raw", "sac_ekf")
"""Arms in the tables; others follow."""
SHOWN = ("B0", "B1", "B2", "B3", "B4", "B5", "ppo_ekf", "ppo_history", "ppo_raw", "true_curvature", "true_path")
"""Arms of the figure on the page of results."""

_DIGITS = 5


def rounded(value: Any) -> Any:
    """A summary with numbers of five significant digits."""
    if isinstance(value, Mapping):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(item) for item in value]
    return float(f"{value:.{_DIGITS}g}") if isinstance(value, float) and math.isfinite(value) else value


def remembered_commits(folder: Path) -> list[str]:
    """Commits at which the folder's episodes were driven, now that of this checkout as well."""
    file = folder / "commits.json"
    known: list[str] = json.loads(file.read_text()) if file.is_file() else []
    known = list(dict.fromkeys([*known, commit_of(CHECKOUT)]))
    write_text(file, json.dumps(known))
    return known


def record(
    summary: Mapping[str, Any],
    claims: Sequence[Mapping[str, Any]],
    evaluation: Evaluation,
    command: str,
    made_at: Sequence[str],
) -> dict[str, Any]:
    """What is kept: the summary, and what it was made of."""
    run = {
        "command": command,
        "commits": list(made_at),
        "plan": [{"controllers": list(controllers), "sets": list(sets)} for controllers, sets in PLAN],
        "headline": evaluation.headline,
        "sources": {name: value for name, value in evaluation.sources if "sha256" in value or name == "ddagr-gym"},
        "claims": list(claims),
        "infeasible": [item["scenario"] for item in evaluation.infeasible],
        "over_headline": dict(evaluation.over_headline),
    }
    return {"_run": rounded(run), **rounded(summary)}


def results_table(content: Mapping[str, Any], set_name: str = "S1") -> str:
    """First table of the page of results: on one set, each shown arm with 95 % intervals, in Markdown."""
    lines = [
        "| controller | radius error, median | 95th percentile | success | closer than B1 | closer than B4 |",
        "|---|---|---|---|---|---|",
    ]
    for name in (name for name in SHOWN if set_name in content.get(name, {})):
        found = content[name][set_name]
        label = f"{name} ({found['runs']} seeds)" if found["runs"] > 1 else name
        label += " *(sees the truth)*" if name in BOUNDS else ""
        cells = [_cell(found["radius_error_median"], 1), _cell(found["radius_error_p95"], 1)]
        cells += [_cell(found.get(key), 0) for key in ("success_rate", "improvement_over_B1", "improvement_over_B4")]
        lines.append(f"| {' | '.join([label, *cells])} |")
    return "\n".join(lines)


def _cell(metric: Mapping[str, Any] | None, digits: int) -> str:
    if metric is None:
        return ""
    texts = ["-" if x is None else f"{100 * x:.{digits}f}" for x in (metric["value"], *metric["interval"])]
    return f"{texts[0]} % ({texts[1]} to {texts[2]})"


def as_lines(content: Mapping[str, Any]) -> str:
    """JSON with one line for every metric."""
    parts = []
    for name, sets in content.items():
        if name == "_run":
            parts.append(f" {json.dumps(name)}: {json.dumps(sets, indent=1)}".replace("\n", "\n "))
            continue
        inner = []
        for set_name, metrics in sets.items():
            lines = ",\n".join(f"   {json.dumps(key)}: {json.dumps(value)}" for key, value in metrics.items())
            inner.append(f"  {json.dumps(set_name)}: {{\n{lines}\n  }}")
        parts.append(f" {json.dumps(name)}: {{\n" + ",\n".join(inner) + "\n }")
    return "{\n" + ",\n".join(parts) + "\n}\n"


def drive(folder: Path, workers: int, cluster: str = "") -> list[dict[str, Any]]:
    """Episodes of the plan, driven where the dataset in the folder does not hold them."""
    plan = [(without_stars(controllers), sets) for controllers, sets in PLAN]
    total = sum(len(wanted_episodes(with_bounds(controllers), sets)) for controllers, sets in plan)
    rows = []
    with Progress(total, "driving") as progress:
        for controllers, sets in plan:
            rows += run_campaign(
                controllers, sets, folder / EPISODES, processes=workers, cluster=cluster, progress=progress.advance
            )
    places = {name: place for place, name in enumerate(ORDER)}
    return sorted(rows, key=lambda row: (places.get(row["arm"], len(ORDER)), SETS.index(row["set"])))


def keep(
    folder: Path, rows: Sequence[Mapping[str, Any]], command: str, made_at: Sequence[str], workers: int = 1,
    result: Path = RESULT, figure: Path = FIGURE, films: bool = True,
) -> None:  # fmt: skip
    """Write an evaluation's files and page into its folder, and its record and figure into the checkout."""
    summary = summaries([dict(row) for row in rows])
    claims = [asdict(item) for item in check_claims(load_claims(), summary)]
    write_files(folder, rows, summary)
    write_text(folder / "claims.json", json.dumps(claims, indent=1) + "\n")
    evaluation = assemble(rows, summary, claims)
    write_text(result, as_lines(record(summary, claims, evaluation, command, made_at)))
    shown = replace(evaluation, arms=[arm for arm in evaluation.arms if arm.name in SHOWN])
    picture, _ = radius_error_figure(shown, folder / f"readme_{figure.name}")
    write_bytes(figure, picture.read_bytes())
    write_report(folder, rows, summary, claims, workers, films)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, required=True, help="folder of the evaluation")
    parser.add_argument("--workers", type=int, default=2, help="processes, or processors of a local cluster")
    parser.add_argument("--cluster", default="", help="local, or the address of a Ray cluster")
    arguments = parser.parse_args()
    folder = make_folder(arguments.output)
    made_at = remembered_commits(folder)
    rows = drive(folder, arguments.workers, arguments.cluster)
    keep(folder, rows, "python -m benchmarks.row_turns --output FOLDER", made_at, arguments.workers)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
