"""``ddagr evaluate``: controllers and trained policies over frozen scenario sets."""

from __future__ import annotations

import fnmatch
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from ddagr_gym.commands.output import format_table, make_folder, write_json
from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.extras import need
from ddagr_gym.progress import Progress

EXAMPLES = (
    "ddagr evaluate --controllers B1,B4,ppo_ekf --scenarios S0 --output evaluation",
    "ddagr evaluate --controllers 'B4,ppo_ekf_seed_*' --scenarios S1 --output all_training_seeds",
    "ddagr evaluate --controllers B1,B4,B5 --scenarios S0,V --workers 2 --output evaluation",
    "ddagr evaluate --controllers B4 --scenarios T --episodes 5 --output smoke_test",
    "ddagr evaluate --replay B4:V:11 --output worst_turn",
)


@dataclass(frozen=True)
class Arguments:
    """Compare controllers on frozen scenarios: turn radius errors, success rates and their intervals.

    An interrupted run continues where it stopped when it is started again with the same folder. The upper bounds
    true_curvature, true_soil and true_path see the true state: they are never deployable, are driven on every set to
    say which scenarios are feasible, and are in the tables only where they are asked for.

    Attributes:
        controllers: names, separated by commas: B0 to B6, B6_pose_wide (which `ddagr demo` drives) and other kinds of
            B6, upper bounds, trained policies or their files, folders of `ddagr adapt`; a * stands for any letters of
            the trained ones, so that ppo_ekf_seed_* are all training seeds, which are judged together.
        scenarios: names of frozen sets, separated by commas: S0 to S8, V for tuning, T for another soil law, S1b to
            S8b and Tb drawn a second time, S1c to S8c and Tc a third, S1d to S8d and Td a fourth, on_slope_3,
            on_slope_3_c and others for robots and ground that differ.
        output: folder for report.html, summary.json, claims.json, the figure, episodes.parquet, and the dataset
            `episodes` by which it resumes.
        workers: processes, or processors of a local cluster.
        cluster: a Ray cluster to drive on: "local" starts one here, an address (ray://HOST:PORT) takes one that runs.
        episodes: only so many of each set; all by default. Claims are then not checked.
        replay: instead of all that drive one scenario, controller:set:number, and write its figure, video and metrics.
    """

    controllers: str = "B0,B1,B2,B3,B4,ppo_ekf"
    scenarios: str = "S0"
    output: Annotated[Path, tyro.conf.arg(aliases=("-o",))] = Path("ddagr_evaluation")
    workers: int = 2
    cluster: str = ""
    episodes: int | None = None
    replay: str = ""


def run(arguments: Arguments) -> None:
    """Drive, summarise, print the tables, write the page."""
    if arguments.cluster:
        need("ray")
    from ddagr_gym.commands.evaluation_report import replay_scenario, write_files, write_report
    from ddagr_gym.control.row_turn import RowTurn
    from ddagr_gym.evaluation.campaign import run_campaign, wanted_episodes, with_bounds
    from ddagr_gym.evaluation.controllers import find_controller
    from ddagr_gym.evaluation.dataset import EPISODES
    from ddagr_gym.evaluation.scenarios import scenario_names
    from ddagr_gym.evaluation.summary import summaries

    if arguments.replay:
        replay_scenario(arguments.replay, arguments.output)
        return
    controllers = without_stars(_names(arguments.controllers, "controllers"))
    sets = _names(arguments.scenarios, "scenarios")
    for name in sets:
        if name not in scenario_names():
            raise unknown_name("scenario set", name, scenario_names())
    for name in controllers:
        find_controller(name, RowTurn())  # what cannot be made shall fail before anything is driven
    if arguments.workers < 1:
        raise InputError(f"--workers {arguments.workers}: give at least 1.")
    total = len(wanted_episodes(with_bounds(controllers), sets, arguments.episodes))
    _check_folder(arguments.output.expanduser())
    folder = make_folder(arguments.output)
    with Progress(total, "driving") as progress:
        rows = run_campaign(
            controllers,
            sets,
            folder / EPISODES,
            processes=arguments.workers,
            cluster=arguments.cluster,
            count=arguments.episodes,
            progress=progress.advance,
        )
    summary = summaries(rows)
    write_files(folder, rows, summary)
    print(format_table(*results_table(summary)))
    claims = _check_claims(folder, summary) if arguments.episodes is None else []
    page = write_report(folder, rows, summary, claims, arguments.workers)
    print(f"\nThe page is {page.resolve()}; episodes and summary are beside it.")


_WRITTEN = ("report.html", "summary.json", "claims.json", "episodes.parquet")
"""Files of an evaluation, beside the dataset and the figures."""


def _check_folder(folder: Path) -> None:
    """Refuse a folder whose files would be replaced though no evaluation wrote them; InputError."""
    from ddagr_gym.evaluation.campaign import EARLIER
    from ddagr_gym.evaluation.dataset import EPISODES, MANIFEST

    if (folder / EPISODES / MANIFEST).is_file() or (folder / EARLIER).is_file():
        return
    for name in (EPISODES, *_WRITTEN):
        if (folder / name).exists():
            raise InputError(f"{folder} holds {name}, which no evaluation wrote: choose another folder.")


def _names(text: str, option: str) -> list[str]:
    names = [name.strip() for name in text.split(",") if name.strip()]
    if not names:
        raise InputError(f"--{option} is empty: give names separated by commas.")
    return list(dict.fromkeys(names))


def without_stars(names: Sequence[str]) -> list[str]:
    """Names with every pattern, such as ppo_ekf_seed_* or ppo_*@frozen, replaced by the policies that fit it."""
    from ddagr_gym.policies.shipped import policy_names

    found: dict[str, None] = {}
    for name in names:
        stem, sign, estimate = name.partition("@")
        if "*" not in stem:
            found[name] = None
            continue
        fitting = fnmatch.filter(policy_names(), stem)
        if not fitting:
            raise InputError(f"no trained policy fits {stem!r}: there are {', '.join(policy_names()) or 'none'}.")
        found |= dict.fromkeys(policy + sign + estimate for policy in fitting)
    return list(found)


def _check_claims(folder: Path, summary: dict[str, Any]) -> list[dict[str, Any]]:
    """Write what became of every claim, print those on something that was driven, and return all."""
    from ddagr_gym.evaluation.claims import check_claims, claims_table, load_claims

    checked = check_claims(load_claims(), summary)
    written = [asdict(item) for item in checked]
    write_json(folder / "claims.json", written)
    driven = [item for item in checked if item.verdict != "not driven"]
    if driven:
        print("\nClaims (configs/evaluation/claims.yaml)\n")
        print(format_table(*claims_table(driven)))
    return written


def results_table(summary: dict[str, Any]) -> tuple[tuple[str, ...], list[tuple[object, ...]]]:
    """Header and rows of the printed table, of :func:`ddagr_gym.evaluation.summary.summaries`."""
    header = ("controller", "set", "episodes", "|e_R| median", "95 % interval", "|e_R| 95th percentile", "success",
              "infeasible")  # fmt: skip
    rows: list[tuple[object, ...]] = []
    for controller, sets in summary.items():
        for name, item in sets.items():
            shown = (controller + _mark(controller), name, item["episodes"])
            if "radius_error_median" not in item:
                rows.append((*shown, "-", "-", "-", "-", item["infeasible"]))
                continue
            median, share = item["radius_error_median"], item["success_rate"]
            rows.append(
                (
                    *shown,
                    _percent(median["value"]),
                    _span(median["interval"]),
                    _percent(item["radius_error_p95"]["value"]),
                    f"{_percent(share['value'])} ({_span(share['interval'])})",
                    item["infeasible"],
                )
            )
    return header, rows


def _mark(controller: str) -> str:
    """Mark in the table of an arm that sees the true state."""
    from ddagr_gym.evaluation.controllers import BOUNDS

    return " (upper bound)" if controller in BOUNDS or controller.endswith("@true") else ""


def _span(interval: list[float | None] | None) -> str:
    return "-" if interval is None else f"{_percent(interval[0])} to {_percent(interval[1])}"


def _percent(value: float | None) -> str:
    return "failed" if value is None else f"{100 * value:.1f} %"
