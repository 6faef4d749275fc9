"""Controllers on the second drawing of the scenario sets and on frozen plants, and which of them is the default.

    python -m benchmarks.second_sets FOLDER [--workers 2] [--controllers B1,B4,...]

Drives :data:`CONTROLLERS` on S1b to S8b, Tb and the sets named ``on_`` and a plant (about an hour of one core; started
again with the same folder, it goes on), checks ``configs/evaluation/second_claims.yaml``, and writes
``benchmarks/results/second_sets.json`` and a picture beside it. Turns that no upper bound makes are left out.

The rule for the default was written before anything had been driven. Of the deployable controllers

1. those stay whose success, in the mean over all these sets, is within :data:`WITHIN` of the best one's;
2. of these the one is taken whose median radius error, in the mean over all these sets (at most 100 % a set), is least;
3. it replaces today's default unless it is surely less close than that on S1b (high end of the interval of the share of
   scenarios in which it is closer below one half).
"""

from __future__ import annotations

import argparse
import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from benchmarks.commits import commit_of
from benchmarks.row_turn_plants import cell
from benchmarks.row_turns import CHECKOUT, rounded
from benchmarks.scenario_sets import ALL_ON_PLANTS, ON_PLANTS, PLANS, SECOND
from benchmarks.second_sets_figure import draw
from ddagr_gym.config import configs_dir
from ddagr_gym.errors import InputError
from ddagr_gym.evaluation.campaign import run_campaign, wanted_episodes, with_bounds
from ddagr_gym.evaluation.claims import check_claims, load_claims
from ddagr_gym.evaluation.controllers import controller_version, is_deployable
from ddagr_gym.evaluation.dataset import EPISODES
from ddagr_gym.evaluation.scenarios import set_hash
from ddagr_gym.evaluation.summary import BASELINES, summaries
from ddagr_gym.files import make_folder, write_json
from ddagr_gym.progress import Progress

RESULT = Path(__file__).resolve().parent / "results" / "second_sets.json"
CONTROLLERS = ("B1", "B4", "B6_flat", "B6", "B6_learned", "ppo_ekf", "ppo_history", "ppo_raw", "true_path")
SETS = (*SECOND, *ON_PLANTS)
WITHIN = 0.01
"""Success that counts as equal [-]."""

KEPT = (
    "episodes", "infeasible", "radius_error_median", "radius_error_p95", "success_rate",
    "exit_lateral_error_median", "exit_heading_error_median", "improvement_over_B1", "improvement_over_B4",
)  # fmt: skip
"""Of each summary."""

Summary = Mapping[str, Mapping[str, Mapping[str, Any]]]


@dataclass(frozen=True)
class Reading:
    """A drawing of scenario sets, and what is decided on it.

    Attributes:
        command: that makes it.
        sets: names.
        in_range: name of the set in range.
        controllers: that drive it.
        former: default that another controller may replace.
        claims: file, in the folder ``evaluation`` of the configurations.
        result: file.
        against: further controllers with which the others are compared; B1, B4 and the former default always are.
    """

    command: str
    sets: tuple[str, ...]
    in_range: str
    controllers: tuple[str, ...]
    former: str
    claims: str
    result: Path
    against: tuple[str, ...] = ()

    @property
    def compared(self) -> tuple[str, ...]:
        """Controllers with which all others are compared."""
        return tuple(dict.fromkeys([*BASELINES, self.former, *self.against]))


READING = Reading(
    "python -m benchmarks.second_sets FOLDER", SETS, "S1b", CONTROLLERS, "B4", "second_claims.yaml", RESULT
)
"""Of the second drawing."""


def mean_over_sets(summary: Summary, arm: str, metric: str, sets: Sequence[str]) -> float:
    """Mean of a metric's values over sets; a failure counts as 1."""
    values = [summary[arm][name][metric]["value"] for name in sets]
    return sum(1.0 if value is None else min(value, 1.0) for value in values) / len(sets)


def default_by_rule(summary: Summary, reading: Reading = READING) -> dict[str, Any]:
    """The default by the rule above, and what it was chosen by.

    Args:
        summary: of :func:`ddagr_gym.evaluation.summary.summaries`; every arm on all sets.
        reading: names the sets that count, and the default that another one may replace.
    """
    sets, former = reading.sets, reading.former
    arms = [arm for arm in summary if is_deployable(arm)]
    success = {arm: mean_over_sets(summary, arm, "success_rate", sets) for arm in arms}
    error = {arm: mean_over_sets(summary, arm, "radius_error_median", sets) for arm in arms}
    best = [arm for arm in arms if success[arm] >= max(success.values()) - WITHIN]
    chosen = min(best, key=error.__getitem__)
    if chosen != former:
        closer = summary[chosen][reading.in_range][f"improvement_over_{former}"]["interval"]
        chosen = former if closer[1] < 0.5 else chosen
    return {"chosen": chosen, "mean_success": success, "mean_radius_error_median": error}


def driven(
    folder: Path, controllers: Sequence[str], workers: int, sets: Sequence[str], compared: Sequence[str]
) -> dict[str, dict[str, Any]]:
    """Summaries of the controllers on all sets, by episodes that the folder holds or that are driven now."""
    total = len(wanted_episodes(with_bounds(controllers), sets))
    with Progress(total, "driving") as progress:
        rows = run_campaign(controllers, sets, folder / EPISODES, processes=workers, progress=progress.advance)
    return summaries(rows, compared)


def kept_of(
    summary: Summary, controllers: Sequence[str], sets: Sequence[str], compared: Sequence[str]
) -> dict[str, dict[str, dict[str, Any]]]:
    """What is kept of summaries, {set: {arm: metrics}}, with the share of turns closer than those compared with."""
    metrics = dict.fromkeys([*KEPT, *(f"improvement_over_{name}" for name in compared)])
    return {
        name: {
            arm: {key: summary[arm][name][key] for key in metrics if key in summary[arm][name]} for arm in controllers
        }
        for name in sets
    }


def result_of(summary: Summary, controllers: Sequence[str], reading: Reading = READING) -> dict[str, Any]:
    """As it is written: claims, the default by the rule, hashes, and the metrics that are kept, {set: {arm: ...}}."""
    claims = check_claims(load_claims(configs_dir() / "evaluation" / reading.claims), summary)
    return {
        "command": reading.command,
        "commit": commit_of(CHECKOUT),
        "scenarios": {name: set_hash(name) for name in reading.sets},
        "controllers": {name: version_of(name) for name in controllers},
        "default": rounded(default_by_rule(summary, reading)),
        "claims": [rounded(asdict(claim)) for claim in claims],
        "sets": rounded(kept_of(summary, controllers, reading.sets, reading.compared)),
    }


def version_of(name: str) -> str:
    """Hash of all that a controller's turns depend on."""
    return hashlib.sha256(controller_version(name).encode()).hexdigest()


def title(name: str) -> str:
    """Of a set, in tables and pictures."""
    plant = ALL_ON_PLANTS.get(name)
    return f"{name}: {PLANS[name].description.partition(', ')[2] if plant is None else plant.title}"


def table(result: Mapping[str, Any]) -> str:
    """Markdown: a row a set, a column a controller: median / 95th percentile of |e_R|, success, all in percent."""
    names = list(result["controllers"])
    lines = [f"| set | turns | {' | '.join(names)} |", "|---" * (len(names) + 2) + "|"]
    for name, found in result["sets"].items():
        cells = [cell(found[arm]) for arm in names]
        lines.append(f"| {title(name)} | {found[names[0]]['episodes']} | {' | '.join(cells)} |")
    return "\n".join(lines)


def for_picture(result: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Metrics of the picture, {set: {arm: metrics}}, with a failure as 1."""
    names = ("radius_error_median", "radius_error_p95", "success_rate")
    return {
        name: {arm: {key: _at_most_one(own[key]) for key in names} for arm, own in found.items()}
        for name, found in result["sets"].items()
    }


def _at_most_one(metric: Mapping[str, Any]) -> dict[str, Any]:
    value, *interval = [1.0 if x is None else min(x, 1.0) for x in (metric["value"], *metric["interval"])]
    return {"value": value, "interval": interval}


def main(arguments: Sequence[str] | None = None, reading: Reading = READING, about: str | None = __doc__) -> int:
    """Drive, check, choose, write."""
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="of the episodes")
    parser.add_argument("--controllers", default=",".join(reading.controllers), help="names, separated by commas")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--output", type=Path, default=reading.result)
    given = parser.parse_args(arguments)
    controllers = given.controllers.split(",")
    missing = set(reading.compared) - set(controllers)
    if missing:
        parser.error(f"--controllers lacks {min(missing)}, against which the others are compared")
    try:
        summary = driven(make_folder(given.folder), controllers, given.workers, reading.sets, reading.compared)
    except InputError as error:
        parser.error(str(error))
    result = result_of(summary, controllers, reading)
    write_json(given.output, result)
    draw(for_picture(result), {name: title(name) for name in reading.sets}, given.output.with_suffix(".png"))
    print(table(result))
    print(json.dumps(result["default"], indent=1))
    for claim in result["claims"]:
        print("{verdict}: {name}, {set_name}: {measured} {relation} {bound}".format(**claim))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
