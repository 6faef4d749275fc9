"""Files that ``ddagr evaluate`` writes: the page with its videos, and those of one scenario driven again."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

from ddagr_gym.commands.output import atomic_path, format_table, make_folder, write_json
from ddagr_gym.progress import Progress

if TYPE_CHECKING:
    from ddagr_gym.evaluation.report_data import Arm, Evaluation, Film, SetNote
    from ddagr_gym.evaluation.runs import TurnRun

VIDEOS = "videos"

_HASH_DIGITS = 16  # shown of a SHA-256 (ours): enough to tell files apart by eye


def write_report(
    folder: Path,
    rows: Sequence[Mapping[str, Any]],
    summary: Mapping[str, Any],
    claims: Sequence[Mapping[str, Any]] = (),
    workers: int = 1,
    films: bool = True,
) -> Path:
    """Drive what the page shows again, and write the page, its videos and the picture for a README.

    Args:
        folder: of the evaluation.
        rows: of the campaign.
        summary: of the rows.
        claims: checked, as mappings; none where they were not decided.
        workers: processes for the drives.
        films: whether to make videos.

    Returns:
        The page.
    """
    from ddagr_gym.evaluation.shown import drive_shown, film_rows, overlaid_rows, tracked_rows
    from ddagr_gym.presets import ddagr
    from ddagr_gym.reporting.evaluation_page import FIGURES, write_page

    plain = assemble(rows, summary, claims)
    overlaid, tracked = overlaid_rows(plain), tracked_rows(plain)
    filmed = film_rows(plain) if films else []
    total = len(overlaid) + len(tracked) + len(filmed) + FIGURES
    with Progress(total, "report") as progress:
        shown = replace(
            plain,
            drives=drive_shown(overlaid, False, workers, progress.advance),
            tracked=drive_shown(tracked, True, 1, progress.advance),
            films=[_film(folder, number, *item, progress) for number, item in enumerate(filmed, 1)],
        )
        return write_page(folder, shown, ddagr(), progress.advance)


def assemble(
    rows: Sequence[Mapping[str, Any]], summary: Mapping[str, Any], claims: Sequence[Mapping[str, Any]]
) -> Evaluation:
    """Evidence of the page before anything is driven again."""
    from ddagr_gym.evaluation.claims import load_claims
    from ddagr_gym.evaluation.report_data import Evaluation
    from ddagr_gym.evaluation.shown import infeasible_soils

    headline = load_claims().headline
    arms, sets = _arms(rows, summary), _sets(rows)
    evaluation = Evaluation(
        rows=rows,
        summary=summary,
        arms=arms,
        sets=sets,
        headline=headline if headline in summary else "",
        claims=claims,
        infeasible=infeasible_soils(rows),
        sources=_sources(arms, sets),
        note=_left_out(sets),
    )
    return _with_headline(evaluation) if evaluation.headline else evaluation


def _with_headline(evaluation: Evaluation) -> Evaluation:
    """With the learned arms compared with the headline; its ablations with the same training seeds of it."""
    from ddagr_gym.evaluation.summary import improvement, summarise

    headline, judged = evaluation.headline, evaluation.judged
    found, alone = {}, {}
    for arm in (arm for arm in evaluation.arms if arm.learned and arm.name != headline):
        mine, others = ([dict(row) for row in evaluation.rows_of(name, judged)] for name in (arm.name, headline))
        if arm.name.partition("@")[0] == headline:
            seeds = {row["run"] for row in mine}
            same = [row for row in others if row["run"] in seeds]
            if same and len(same) < len(others):
                alone[_seeds_text(headline, seeds)] = summarise(same)
            others = same
        found[arm.name] = improvement([*mine, *others], arm.name, headline, judged)
    return replace(
        evaluation,
        over_headline={name: item for name, item in found.items() if item is not None},
        headline_alone=alone,
    )


def _seeds_text(headline: str, seeds: Collection[int]) -> str:
    return f"{headline}, training seed{'s' if len(seeds) > 1 else ''} {', '.join(map(str, sorted(seeds)))} alone"


def _arms(rows: Sequence[Mapping[str, Any]], summary: Mapping[str, Any]) -> list[Arm]:
    """Arms in the order of the summary, those that are never deployable last."""
    from ddagr_gym.evaluation.controllers import controller_names, controller_title, controller_version, is_deployable
    from ddagr_gym.evaluation.report_data import Arm, arm_name

    members: dict[str, dict[str, None]] = {}
    for row in rows:
        members.setdefault(arm_name(row), {})[row["controller"]] = None
    arms = []
    for name in summary:
        seeds = list(members[name])
        learned = seeds[0] not in controller_names()
        versions = tuple(controller_version(seed)[:_HASH_DIGITS] for seed in seeds) if learned else ()
        arms.append(Arm(name, controller_title(seeds[0]), is_deployable(seeds[0]), learned, versions))
    return sorted(arms, key=lambda arm: not arm.deployable)


def _sets(rows: Sequence[Mapping[str, Any]]) -> list[SetNote]:
    from ddagr_gym.evaluation.report_data import SetNote
    from ddagr_gym.evaluation.scenarios import load_scenarios, set_description, set_hash

    driven: dict[str, set[int]] = {}
    for row in rows:
        driven.setdefault(row["set"], set()).add(row["number"])
    return [
        SetNote(name, set_description(name), len(load_scenarios(name)), len(numbers), set_hash(name))
        for name, numbers in driven.items()
    ]


def _left_out(sets: Sequence[SetNote]) -> str:
    short = [item for item in sets if item.driven < item.scenarios]
    if not short:
        return ""
    parts = ", ".join(f"{item.driven} of {item.scenarios} of {item.name}" for item in short)
    return f"Only the first scenarios were driven ({parts}): this is a look, not a result."


def _sources(arms: Sequence[Arm], sets: Sequence[SetNote]) -> list[tuple[str, str]]:
    from ddagr_gym.evaluation.ladder_gains import gains_file
    from ddagr_gym.recordings.files import sha256_of
    from ddagr_gym.version import __version__

    found = [("ddagr-gym", __version__), ("gains of the ladder", f"sha256 {sha256_of(gains_file())[:_HASH_DIGITS]}")]
    found += [(f"scenarios {item.name}", f"sha256 {item.sha256[:_HASH_DIGITS]}") for item in sets]
    found += [(f"policy {arm.name}", f"sha256 {', '.join(arm.versions)}") for arm in arms if arm.learned]
    return [*found, ("every number", "summary.json, and every episode in episodes.parquet beside this page")]


def _film(folder: Path, number: int, title: str, row: Mapping[str, Any], progress: Progress) -> Film:
    from ddagr_gym.evaluation.controllers import estimates_path
    from ddagr_gym.evaluation.report_data import Film, arm_name, display_name
    from ddagr_gym.evaluation.shown import replayed
    from ddagr_gym.reporting.evaluation_film import film_turn
    from ddagr_gym.reporting.evaluation_tables import replay_command

    _, run = replayed(row["controller"], row["set"], row["number"])
    name = row["controller"]
    run = _with_estimate(run, name) if estimates_path(name) else run
    file = PurePosixPath(VIDEOS) / f"{number}_{_file_name(row)}.mp4"
    make_folder(folder / VIDEOS)
    turn, robot = run.episode.turn, run.episode.robot
    poster = film_turn(run.columns, turn, robot, folder / file, display_name(arm_name(row)))
    progress.advance()
    return Film(file, f"{title}: {row['set']} {row['number']}", replay_command(row), poster)


def _file_name(row: Mapping[str, Any]) -> str:
    """Name of a file: letters, digits and underscores, with the training seed where that is not 0."""
    from ddagr_gym.evaluation.report_data import arm_name, display_name

    name = display_name(arm_name(row)) + (f"_{row['run']}" if row["run"] else "")
    plain = "".join(letter if letter.isalnum() else "_" for letter in name)
    return f"{plain}_{row['set']}_{row['number']}"


def _with_estimate(run: TurnRun, controller: str) -> TurnRun:
    """The run with the path that the filter estimates."""
    from ddagr_gym.evaluation.shown import estimated_track

    x, y, _ = estimated_track(run, controller).T
    return replace(run, columns=run.columns | {"estimated_x": x, "estimated_y": y})


def replay_scenario(text: str, folder: Path) -> None:
    """Drive one scenario of one controller again; figure, video, recording and metrics into the folder.

    Args:
        text: ``controller:set:number``.
        folder: made where absent.

    Raises:
        InputError: the text names nothing.
    """
    from ddagr_gym.evaluation.controllers import estimates_path
    from ddagr_gym.evaluation.shown import parse_replay, replayed
    from ddagr_gym.recordings.storage import save_drive
    from ddagr_gym.reporting.evaluation_film import film_turn
    from ddagr_gym.reporting.figures import turn_figure

    controller, set_name, number = parse_replay(text)
    row, run = replayed(controller, set_name, number)
    make_folder(folder)
    stem = _file_name(row)
    seen = _with_estimate(run, controller) if estimates_path(controller) else run
    name, turn, robot = f"{set_name} {number}", run.episode.turn, run.episode.robot
    turn_figure(seen.columns, turn, folder / f"{stem}.png", robot=robot, soil_name=f"soil {name}")
    save_drive(folder / f"{stem}.parquet", run.columns, robot)
    write_json(folder / f"{stem}.json", row)
    film_turn(seen.columns, turn, robot, folder / f"{stem}.mp4", f"soil {name}")
    print(format_table((f"{controller} on {name}", "value"), _replay_rows(row)))
    print(f"\nFigure, video, recording and metrics are in {folder.resolve()}")


def _replay_rows(row: Mapping[str, Any]) -> list[tuple[str, object]]:
    from ddagr_gym.reporting.evaluation_tables import why_failed

    def shown(key: str, factor: float, unit: str) -> str:
        return "undefined" if row[key] is None else f"{factor * row[key]:+.1f} {unit}"

    return [
        ("turn radius error", shown("radius_error", 100.0, "%")),
        ("lateral error at the next row", shown("exit_lateral_error", 1e3, "mm")),
        ("heading error there", shown("exit_heading_error", 57.29578, "deg")),
        ("every wheel fits its furrow", "yes" if row["success"] else f"no: {why_failed(row)}"),
        ("headland depth", f"{row['headland_depth']:.2f} m"),
        ("duration", f"{row['duration']:.1f} s"),
    ]


def write_files(folder: Path, rows: Sequence[Mapping[str, Any]], summary: Mapping[str, Any]) -> None:
    """Write ``episodes.parquet`` and ``summary.json``."""
    import pyarrow as pa
    from pyarrow import parquet

    with atomic_path(folder / "episodes.parquet") as temporary:
        parquet.write_table(pa.Table.from_pylist([dict(row) for row in rows]), temporary)
    write_json(folder / "summary.json", summary)
