"""What the filter's force laws cost against the terramechanic wheel, and the prior of their parameters.

    python -m benchmarks.force_laws [--soils N] [--output FILE]

Each soil is fitted by each law twice: on the thesis's grid of slip and slip angle (chapter 3) and on wheel states of
row turns. Errors are relative to the largest force of the fitted set. The geometric means of the turn fits' medians
over thesis_a1_range and field are the medians of ddagr_gym.estimation.SoilPrior.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from benchmarks.filter_study.force_law_costs import draw_soils, soil_set_costs
from ddagr_gym.files import atomic_path
from ddagr_gym.presets import get_robot

SETS = ("thesis_a1", "thesis_a1_range", "field", "weaker", "stiffer")


def study(soils: int, seed: int = 0) -> dict:
    """Costs by soil set, kind of wheel states and law."""
    robot = get_robot("ddagr")
    result = {}
    for name in SETS:
        result[name] = soil_set_costs(robot, draw_soils(name, robot, soils, seed), seed)
        for kind, laws in result[name].items():
            for law, cost in laws.items():
                print(f"{name:16} {kind:5} {law:24} peak {100 * cost['peak_error_x']:.0f} % "
                      f"{100 * cost['peak_error_y']:.0f} %  rms {100 * cost['rms_error_x']:.1f} % "
                      f"{100 * cost['rms_error_y']:.1f} %", flush=True)  # fmt: skip
    return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--soils", type=int, default=40, help="soils per set")
    parser.add_argument("--output", type=Path, default=Path(__file__).parent / "results" / "force_laws.json")
    arguments = parser.parse_args()
    text = json.dumps(study(arguments.soils), indent=1)
    with atomic_path(arguments.output) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
