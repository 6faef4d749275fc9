"""``ddagr freeze-scenarios``: draw the scenario sets once and write them with their hash."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tyro.conf import Positional

from ddagr_gym.commands.progress import Progress
from ddagr_gym.errors import InputError, unknown_name

EXAMPLES = (
    "ddagr freeze-scenarios V --output my_scenarios",
    "ddagr freeze-scenarios S0 S1 --output my_scenarios",
)


@dataclass(frozen=True)
class Arguments:
    """Draw scenario sets and freeze them with a hash.

    The shipped sets lie in configs/evaluation/scenarios and are never drawn again. A turn that the controller with the
    true state does not make is marked infeasible.

    Attributes:
        sets: names of the sets.
        output: folder for the files; existing files are not replaced.
    """

    sets: Positional[tuple[str, ...]]
    output: Path


def run(arguments: Arguments) -> None:
    """Draw, judge feasibility, and write."""
    from ddagr_gym.evaluation.scenario_sets import PLANS
    from ddagr_gym.evaluation.scenarios import save_scenarios

    for name in arguments.sets:
        if name not in PLANS:
            raise unknown_name("scenario set", name, PLANS)
        target = arguments.output / f"{name}.json"
        if target.exists():
            raise InputError(f"{target} exists: frozen sets are not drawn again; choose another folder.")
        drawn = list(_judged(name))
        save_scenarios(name, PLANS[name].description, drawn, target)
        infeasible = sum(not feasible for *_, feasible in drawn)
        print(f"{target}: {len(drawn)} scenarios, {infeasible} infeasible")


def _judged(name: str) -> Any:
    from ddagr_gym.envs.options import make_settings
    from ddagr_gym.evaluation.controllers import find_controller
    from ddagr_gym.evaluation.runs import drive_turn
    from ddagr_gym.evaluation.scenario_sets import as_scenario, draw_set

    drawn = draw_set(name)
    with Progress(len(drawn), f"freezing {name}") as progress:
        for number, (seed, episode, recipe) in enumerate(drawn):
            scenario = as_scenario(name, number, seed, episode, recipe)
            settings = make_settings(speed=episode.turn.speed, radius=episode.turn.radius)
            bound = find_controller("true_curvature", episode.turn)
            driven = drive_turn(bound, settings, seed, scenario.episode)
            yield seed, episode, recipe, driven.success
            progress.advance()
