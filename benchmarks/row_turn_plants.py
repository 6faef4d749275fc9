"""Row turns on plants that the controllers were not made for: which estimator and which loop bears what.

    python -m benchmarks.row_turn_plants [--scenarios 40] [--controllers B1,B4,B6_flat,B6,true_path] [--output FILE]
        [--keep]

The same soils in range, robots, sensors and noise on every plant: level ground, slopes in random directions, soil of
less strength from half of the turn on, other lateral forces, late commands, more mass. The scenarios are for
development: they have seeds of their own, and none of the frozen sets is read. About seven minutes of one core
with its defaults; with ``--keep`` only the named controllers are driven, the rows of others stay as they are in the
file. Writes ``benchmarks/results/row_turn_plants.json`` and a picture beside it.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from benchmarks.plants import DEVELOPMENT_PLANTS
from benchmarks.plants_figure import draw
from ddagr_gym.envs.options import make_settings
from ddagr_gym.envs.settings import Episode, TurnSettings
from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.evaluation.controllers import controller_names, find_controller, observation_options
from ddagr_gym.evaluation.metrics import turn_metrics
from ddagr_gym.evaluation.runs import drive_turn
from ddagr_gym.evaluation.statistics import Interval, bootstrap, median_interval, wilson_interval
from ddagr_gym.files import atomic_path
from ddagr_gym.progress import Progress

RESULT = Path(__file__).parent / "results" / "row_turn_plants.json"
CONTROLLERS = ("B1", "B4", "B6_flat", "B6", "true_path")
_ROOT_SEED = 20_261_122
_NOISE, _DRAW, _PLANT = range(3)  # last parts of the seeds

PLANTS = DEVELOPMENT_PLANTS
"""The plants by name."""


@dataclass(frozen=True)
class Outcome:
    """Of one turn: signed radius error [-], None where there is no circle, and success."""

    error: float | None
    success: bool


def scenario(plant: str, number: int, root_seed: int = _ROOT_SEED) -> tuple[TurnSettings, Episode, int]:
    """Settings, episode and noise seed; soils, robots and sensors of a number are the same on every plant."""
    drawn = make_settings().draw(np.random.default_rng([root_seed, number, _DRAW]))
    episode, effects = PLANTS[plant].drawn(drawn, np.random.default_rng([root_seed, number, _PLANT]))
    seed = int(np.random.default_rng([root_seed, number, _NOISE]).integers(2**31))
    return make_settings(effects=effects), episode, seed


def drive(controller: str, plant: str, number: int) -> Outcome:
    """One turn."""
    settings, episode, seed = scenario(plant, number)
    settings = replace(settings, **observation_options(controller))
    run = drive_turn(find_controller(controller, episode.turn), settings, seed, episode)
    return Outcome(turn_metrics(run.columns, episode.turn, episode.robot).turn.error, run.success)


def _rounded(found: Interval) -> dict[str, Any]:
    return {
        "value": float(f"{found.estimate:.5g}"),
        "interval": [float(f"{found.low:.5g}"), float(f"{found.high:.5g}")],
    }


def summary(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Median and 95th percentile of |e_R| (a turn without circle counts as 1) and success, with 95 % intervals."""
    sizes = np.array([1.0 if item.error is None else min(abs(item.error), 1.0) for item in outcomes])

    def p95(scores: np.ndarray) -> float:
        return float(np.quantile(scores, 0.95, method="inverted_cdf"))

    return {
        "scenarios": len(outcomes),
        "radius_error_median": _rounded(median_interval(sizes)),
        "radius_error_p95": _rounded(
            bootstrap(sizes, p95, np.random.default_rng(0), resampling="crossed", resamples=1000)
        ),
        "success_rate": _rounded(wilson_interval(sum(item.success for item in outcomes), len(outcomes))),
    }


def compared(outcomes: Mapping[str, Sequence[Outcome]]) -> dict[str, Any]:
    """:func:`summary` of each controller, and its success where ``true_path`` makes the turn."""
    found = {name: summary(own) for name, own in outcomes.items()}
    if "true_path" in outcomes:
        feasible = [number for number, item in enumerate(outcomes["true_path"]) if item.success]
        for name, own in outcomes.items():
            made = sum(own[number].success for number in feasible)
            if feasible:
                found[name]["success_where_true_path"] = _rounded(wilson_interval(made, len(feasible)))
    return found


def table(result: Mapping[str, Any]) -> str:
    """Markdown: a row a plant, a column a controller; median / 95th percentile of |e_R|, success, all in percent."""
    names = list(next(iter(result["plants"].values())))
    lines = [f"| plant | {' | '.join(names)} |", "|---" * (len(names) + 1) + "|"]
    for plant, found in result["plants"].items():
        lines.append(f"| {PLANTS[plant].title} | {' | '.join(cell(found[name]) for name in names)} |")
    return "\n".join(lines)


def cell(found: Mapping[str, Any]) -> str:
    """Of a table: median / 95th percentile of |e_R|, success with its interval, in percent; a dash for none."""

    def percent(value: float | None, digits: int) -> str:
        return "-" if value is None else f"{100.0 * value:.{digits}f}"

    errors = [percent(found[key]["value"], 1) for key in ("radius_error_median", "radius_error_p95")]
    success = found["success_rate"]
    low, high = (percent(end, 0) for end in success["interval"])
    return f"{errors[0]} / {errors[1]} / {percent(success['value'], 0)} ({low} to {high})"


Driven = TypeVar("Driven")


def driven_on(
    plants: Sequence[str], names: Sequence[str], scenarios: int, drive_one: Callable[[str, str, int], Driven]
) -> Iterator[tuple[str, dict[str, list[Driven]]]]:
    """Every plant with what each name comes to in its scenarios, the same for all, with a progress bar.

    Args:
        plants: names.
        names: of what drives.
        scenarios: of each plant.
        drive_one: (name, plant, number) -> what one turn comes to.
    """
    with Progress(len(names) * len(plants) * scenarios, "driving") as progress:
        for plant in plants:
            found: dict[str, list[Driven]] = {name: [] for name in names}
            for name in names:
                for number in range(scenarios):
                    found[name].append(drive_one(name, plant, number))
                    progress.advance(1)
            yield plant, found


def study(controllers: Sequence[str], plants: Sequence[str], scenarios: int) -> dict[str, Any]:
    """Every controller on every plant, the same scenarios."""
    found = {plant: compared(outcomes) for plant, outcomes in driven_on(plants, controllers, scenarios, drive)}
    return {"scenarios": scenarios, "root_seed": _ROOT_SEED, "plants": found}


def with_kept(result: dict[str, Any], path: Path) -> dict[str, Any]:
    """A result with the rows of a file that it did not drive, in the order of that file.

    Raises:
        InputError: no such file, or of other scenarios.
    """
    if not path.is_file():
        raise InputError(f"there is no {path} whose rows could be kept: leave --keep out.")
    before = json.loads(path.read_text(encoding="utf-8"))
    for name in ("scenarios", "root_seed"):
        if before[name] != result[name]:
            raise InputError(f"{path} has {name} {before[name]}, not {result[name]}: leave --keep out.")
    plants = {plant: before["plants"].get(plant, {}) | result["plants"].get(plant, {}) for plant in PLANTS}
    return result | {"plants": {plant: rows for plant, rows in plants.items() if rows}}


def names_of(text: str, known: Sequence[str], what: str) -> list[str]:
    """Names in a text, separated by commas; InputError for an unknown one or none."""
    names = [name.strip() for name in text.split(",") if name.strip()]
    for name in names:
        if name not in known:
            raise unknown_name(what, name, known)
    if not names:
        raise InputError(f"no {what} is named: give some of {', '.join(known)}.")
    return names


def plants_of(words: str, scenarios: int) -> list[str]:
    """Plants by their names, of which so many turns are driven.

    Args:
        words: names, separated by commas.
        scenarios: turns on each plant.

    Raises:
        InputError: an unknown name, none, or too few turns.
    """
    names = names_of(words, list(PLANTS), "plant")
    if scenarios < 2:
        raise InputError(f"scenarios is {scenarios}: give at least 2.")
    return names


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--controllers", default=",".join(CONTROLLERS), help="names, separated by commas")
    parser.add_argument("--plants", default=",".join(PLANTS), help="names, separated by commas")
    parser.add_argument("--scenarios", type=int, default=40, help="turns of each controller on each plant")
    parser.add_argument("--output", type=Path, default=RESULT, help="JSON file; the picture lies beside it")
    parser.add_argument("--keep", action="store_true", help="keep the rows of controllers that are not named")
    given = parser.parse_args(arguments)
    try:
        controllers = names_of(given.controllers, controller_names(), "controller")
        plants = plants_of(given.plants, given.scenarios)
        if given.keep:
            with_kept({"scenarios": given.scenarios, "root_seed": _ROOT_SEED, "plants": {}}, given.output)
    except InputError as error:
        parser.error(str(error))
    result = study(controllers, plants, given.scenarios)
    if given.keep:
        result = with_kept(result, given.output)
    with atomic_path(given.output) as temporary:
        temporary.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    draw(result["plants"], {name: PLANTS[name].title for name in result["plants"]}, given.output.with_suffix(".png"))
    print(table(result))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
