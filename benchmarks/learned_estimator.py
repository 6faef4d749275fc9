"""How well a trained network knows the body's velocity, beside the filters and the least error that can be.

    python -m benchmarks.learned_estimator [--scenarios 20] [--plants level,slope_3,...,T] [--output FILE]

Turns of B6 on the development scenarios of ``benchmarks.row_turn_plants`` and on the frozen set T, the first ones of
each; every estimator sees the same samples. From the end of standing to the next row: root mean square errors of v_x
and v_y, coverage of 90 % intervals, NEES over 2, the pose to which the velocities lead, and the place that the inertial
filter carries along, or that a network makes of it, which later readings correct. On level ground and where
the soil weakens, the first eight turns are those of ``benchmarks.velocity_bound``, whose bound is read from its file.
The networks learnt from turns of other seeds on the same kinds of plant; set T is another law of the soil, which was
not in their training. About two minutes of one core. Writes ``results/learned_estimator.json`` and a picture beside it.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.filter_study.summary import interval
from benchmarks.filter_velocities import flat_velocities, inertial_velocities, judge_velocities
from benchmarks.learned_figure import draw
from benchmarks.row_turn_plants import PLANTS, driven_on, names_of, scenario
from benchmarks.velocity_bound.filters import FILTERS, placed_motion
from benchmarks.velocity_bound.study import MOTION, exit_instant
from benchmarks.velocity_bound.summary import EXIT, root_ratio
from ddagr_gym.control.timing import CONTROL_INTERVAL
from ddagr_gym.errors import InputError
from ddagr_gym.estimation import LearnedModel, run_learned_filter
from ddagr_gym.evaluation.campaign import scenario_settings
from ddagr_gym.evaluation.controllers import find_controller
from ddagr_gym.evaluation.runs import TurnRun, drive_turn
from ddagr_gym.evaluation.scenarios import load_scenarios
from ddagr_gym.evaluation.shown import estimated_track
from ddagr_gym.files import write_json
from ddagr_gym.parameters import Sensors
from ddagr_gym.presets import ddagr

Array = NDArray[np.float64]
Columns = Mapping[str, Array]
Estimated = tuple[Array, Array, Array]
"""v_x, v_y, yaw rate after each sample (T, 3); v_x, v_y (B, 2) and covariances (B, 2, 2) at control instants."""

RESULT = Path(__file__).parent / "results" / "learned_estimator.json"
BOUND = Path(__file__).parent / "results" / "velocity_bound.json"
CONTROLLER = "B6"
TRANSFER = "T"
TITLES = {name: plant.title for name, plant in PLANTS.items()} | {TRANSFER: "set T: another law of the soil"}
"""Of the plants, by name."""


def _filtered(name: str, of: Callable[[Columns], tuple[Array, Array]], run: TurnRun) -> Estimated:
    return (FILTERS[name][1](run.columns, run.episode), *of(run.columns))


def _learned(name: str, run: TurnRun) -> Estimated:
    states, velocities, covariances = run_learned_filter(LearnedModel.of(ddagr(), Sensors(), name), run.columns)
    return states[:, :3], velocities, covariances


ESTIMATORS: dict[str, tuple[str, Callable[[TurnRun], Estimated]]] = {
    "flat": ("filter, ground level", partial(_filtered, "flat", flat_velocities)),
    "inertial": ("inertial filter", partial(_filtered, "inertial", inertial_velocities)),
    "pose": ("inertial filter, velocities and place corrected by a network", partial(_learned, "pose")),
    "pose_wide": (
        "the same by a network that learnt on with worse sensors, motors and loads",
        partial(_learned, "pose_wide"),
    ),
    "correction": ("inertial filter, corrected by a network", partial(_learned, "correction")),
    "features": ("network that sees the inertial filter", partial(_learned, "features")),
    "alone": ("network that sees sensors and commands", partial(_learned, "alone")),
}
"""By name: title and estimate."""


CARRIED = {"inertial": "B6", "pose": "B6_pose", "pose_wide": "B6_pose_wide"}
"""Controllers that follow the path by it, of the estimators that carry a place, by name."""


def drive(plant: str, number: int) -> TurnRun:
    """One turn of B6, which stands first."""
    if plant == TRANSFER:
        found = load_scenarios(TRANSFER)[number]
        settings, episode, seed = scenario_settings(found, False), found.episode, found.seed
    else:
        settings, episode, seed = scenario(plant, number)
    return drive_turn(find_controller(CONTROLLER, episode.turn), settings, seed, episode)


def judge(run: TurnRun) -> dict[str, Any]:
    """Of every estimator what :func:`judge_velocities` tells up to the next row, or to the end of a turn that never
    reaches it; ``exit``: squared errors of the pose there [m^2, rad^2], None where it was not reached; ``carried``:
    those of the pose that an estimator carries, of those that do."""
    reached = exit_instant(run)
    blocks = len(run.columns["t"]) // CONTROL_INTERVAL if reached is None else reached + 1
    columns = {name: values[: blocks * CONTROL_INTERVAL] for name, values in run.columns.items()}
    truth = np.column_stack([columns[f"true_{name}"] for name in MOTION])
    found = {}
    for name, (_, estimate) in ESTIMATORS.items():
        motion, velocities, covariances = estimate(run)
        own = judge_velocities(velocities[:blocks], covariances[:blocks], columns)
        errors = placed_motion(motion[: len(truth)], run.episode)[-1, 3:] - truth[-1, 3:]
        found[name] = own | {"exit": None if reached is None else (errors**2).tolist()}
        if name in CARRIED and reached is not None:
            errors = estimated_track(replace(run, columns=columns), CARRIED[name])[-1] - truth[-1, 3:]
            found[name]["carried"] = (errors**2).tolist()
    return found


def plant_table(drives: Sequence[Mapping[str, Any]], bound: Mapping[str, Any] | None, turns: int) -> dict[str, Any]:
    """Of one plant, by estimator, with 95 % intervals over drives.

    Args:
        drives: of :func:`judge`.
        bound: figures of the velocity bound on the first ``turns`` of these drives; None where there are none.
        turns: how many.
    """
    rng, table = np.random.default_rng(0), {}
    for name in ESTIMATORS:
        own = [item[name] for item in drives]
        squares = 1e6 * np.array([item["square"] for item in own])
        covered = np.array([item["covered"] for item in own])
        ends = np.array([item["exit"] for item in own if item["exit"] is not None])
        figures: dict[str, Any] = {"drives": len(own), "reached": len(ends)}
        for i, velocity in enumerate(("v_x", "v_y")):
            figures[f"{velocity}_mm_s"] = root_ratio(squares[:, i], None, rng)
            figures[f"{velocity}_covered"] = interval(covered[:, i], np.mean, rng)
            if bound is not None:
                least = np.full(turns, bound[f"{velocity}_mm_s"]["value"] ** 2)
                figures[f"{velocity}_over_bound"] = root_ratio(squares[:turns, i], least, rng)
        figures["nees"] = interval(np.array([np.mean(item["nees"]) for item in own]), np.mean, rng)
        for i, (key, (unit, size)) in enumerate(EXIT.items()):
            figures[f"exit_{key}_{unit}"] = root_ratio(size**2 * ends[:, i], None, rng) if len(ends) else None
        carried = np.array([item["carried"] for item in own if "carried" in item])
        for i, (key, (unit, size)) in enumerate(EXIT.items()):
            if len(carried):
                figures[f"carried_{key}_{unit}"] = root_ratio(size**2 * carried[:, i], None, rng)
        table[name] = figures
    return table


def study(plants: Sequence[str], scenarios: int) -> dict[str, Any]:
    """Every estimator on every plant, and what the bound says there."""
    bounds = json.loads(BOUND.read_text(encoding="utf-8"))
    turns = int(bounds["scenarios"])
    found = {}
    for plant, own in driven_on(plants, (CONTROLLER,), scenarios, lambda _, plant, number: judge(drive(plant, number))):
        bound = bounds["plants"][plant]["bounds"]["task"] if plant in bounds["plants"] and scenarios >= turns else None
        found[plant] = {"estimators": plant_table(own[CONTROLLER], bound, turns), "bound": bound}
    return {"scenarios": scenarios, "bound_turns": turns, "plants": found}


def table(result: Mapping[str, Any]) -> str:
    """Markdown: a row a plant and estimator."""
    names = (
        "plant", "estimator", "v_x, v_y [mm/s]", "covered of 90 %: v_x, v_y", "NEES",
        "next row along, across [mm]: by its velocities", "by the pose that it carries",
    )  # fmt: skip
    lines = [f"| {' | '.join(names)} |", "|---" * len(names) + "|"]
    for plant, found in result["plants"].items():
        for name, own in found["estimators"].items():
            velocity = ", ".join(f"{own[f'{v}_mm_s']['value']:.1f}" for v in ("v_x", "v_y"))
            covered = ", ".join(f"{100 * own[f'{v}_covered']['value']:.0f}" for v in ("v_x", "v_y"))
            pose, kept = (_places(own, kind) for kind in ("exit", "carried"))
            nees = f"{own['nees']['value']:.1f}"
            cells = (TITLES[plant], ESTIMATORS[name][0], velocity, covered, nees, pose, kept)
            lines.append(f"| {' | '.join(cells)} |")
        if found["bound"]:
            low = ", ".join(f"{found['bound'][f'{v}_mm_s']['value']:.2g}" for v in ("v_x", "v_y"))
            lines.append(f"| {TITLES[plant]} | **bound** (first {result['bound_turns']} turns) | {low} | | | | |")
    return "\n".join(lines)


def _places(figures: Mapping[str, Any], kind: str) -> str:
    """Errors along and across at the next row in a table."""
    ends = [figures.get(f"{kind}_{side}_mm") for side in ("along", "across")]
    if kind == "carried" and None in ends:
        return ""
    return ", ".join("not reached" if item is None else f"{item['value']:.0f}" for item in ends)


def main(words: Sequence[str] | None = None) -> int:
    """Command line; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plants", default=",".join(TITLES), help="names, separated by commas")
    parser.add_argument("--scenarios", type=int, default=20, help="turns on each plant")
    parser.add_argument("--output", type=Path, default=RESULT, help="JSON file; the picture lies beside it")
    given = parser.parse_args(words)
    try:
        plants = names_of(given.plants, list(TITLES), "plant")
        if not 2 <= given.scenarios <= 100:
            raise InputError(f"scenarios is {given.scenarios}: give 2 to 100, which are as many as set T has.")
        if not BOUND.is_file():
            raise InputError(f"there is no {BOUND}: run `python -m benchmarks.velocity_bound` first.")
        result = study(plants, given.scenarios)
    except InputError as error:
        parser.error(str(error))
    write_json(given.output, result)
    titles = {name: title for name, (title, _) in ESTIMATORS.items()}
    draw(result["plants"], titles, {name: TITLES[name] for name in plants}, given.output.with_suffix(".png"))
    print(table(result))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
