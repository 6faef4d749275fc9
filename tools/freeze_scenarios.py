"""``./ddagr freeze-scenarios``: draw the scenario sets once and write them with their hash."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tyro.conf import Positional

from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.progress import Progress

EXAMPLES = (
    "ddagr freeze-scenarios V --output my_scenarios",
    "ddagr freeze-scenarios S0 S1 --output my_scenarios",
)


@dataclass(frozen=True)
class Arguments:
    """Draw scenario sets and freeze them with a hash.

    The shipped sets lie in configs/evaluation/scenarios and are never drawn again.

    Attributes:
        sets: names of the sets.
        output: folder for the files; existing files are not replaced.
    """

    sets: Positional[tuple[str, ...]]
    output: Path


def run(arguments: Arguments) -> None:
    """Draw and write."""
    from benchmarks.scenario_sets import PLANS, draw_effects, draw_set
    from ddagr_gym.evaluation.scenarios import SUFFIX, save_scenarios

    for name in arguments.sets:
        if name not in PLANS:
            raise unknown_name("scenario set", name, PLANS)
        target = arguments.output / f"{name}{SUFFIX}"
        if target.exists():
            raise InputError(f"{target} exists: frozen sets are not drawn again; choose another folder.")
    if not arguments.sets:
        raise InputError(f"no scenario set is named: give some of {', '.join(PLANS)}.")
    with Progress(len(arguments.sets), "freezing") as progress:
        for name in arguments.sets:
            plan = PLANS[name]
            drawn = draw_set(name)
            target = save_scenarios(name, plan.description, drawn, arguments.output, plan.law, draw_effects(name))
            progress.advance()
            print(f"{target}: {plan.count} scenarios")
