"""What gyro, accelerometer and encoders can know of a row turn at all, and how far the filters are from it.

    python -m benchmarks.velocity_bound [--plants level,weaker] [--scenarios 8] [--checked 5] [--work DIR]
        [--output FILE]

The posterior Cramer-Rao bound of v_x, v_y and the pose at the next row, along turns of B6 on the development scenarios
of ``benchmarks.row_turn_plants``: constant soil, and strength x 0.7 from half of the turn on. Unknown is what the task
draws, with the task's draws as its prior: biases, mass, inertia, motor rate, delay, nine parameters of the soil and its
variation along the way, and size and time of the change. Beside it the errors of every filter on the same readings,
what the bound would be if parts were known, and whether a smoother with the true model reaches it. About five minutes
of one core; what the folder of work holds is not made again. Writes ``benchmarks/results/velocity_bound.json`` and a
picture beside it.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from benchmarks.row_turn_plants import names_of
from benchmarks.velocity_bound.figure import draw
from benchmarks.velocity_bound.study import PLANTS, run
from benchmarks.velocity_bound.summary import summarise_plant, table
from ddagr_gym.errors import InputError
from ddagr_gym.files import write_json

RESULT = Path(__file__).resolve().parents[1] / "results" / "velocity_bound.json"


def main(words: Sequence[str] | None = None) -> int:
    """Command line; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plants", default=",".join(PLANTS), help="names, separated by commas")
    parser.add_argument("--scenarios", type=int, default=8, help="turns of each plant")
    parser.add_argument("--checked", type=int, default=5, help="turns of each plant that a smoother is run on")
    parser.add_argument("--work", type=Path, default=Path("velocity_bound_work"), help="folder of what is finished")
    parser.add_argument("--output", type=Path, default=RESULT, help="JSON file; the picture lies beside it")
    given = parser.parse_args(words)
    try:
        plants = names_of(given.plants, PLANTS, "plant")
        for name, least in (("scenarios", 2), ("checked", 0)):
            if getattr(given, name) < least:
                raise InputError(f"{name} is {getattr(given, name)}: give at least {least}.")
        if given.checked > given.scenarios:
            raise InputError(f"checked is {given.checked}: give at most the {given.scenarios} scenarios.")
    except InputError as error:
        parser.error(str(error))
    try:
        found = run(plants, given.scenarios, given.checked, given.work)
    except KeyboardInterrupt:
        print(f"interrupted; the same command goes on from {given.work}.")
        return 130
    result = {"scenarios": given.scenarios, "plants": {plant: summarise_plant(own) for plant, own in found.items()}}
    write_json(given.output, result)
    draw(result, given.output.with_suffix(".png"))
    print(table(result))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
