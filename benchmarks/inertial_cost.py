"""What the inertial filter costs: of one sample, and of a step of the environment with it over one with the filter.

    python -m benchmarks.inertial_cost [--repeats 15]

Both filters run over the samples of the same turn; the environment plays the same commands and hands its samples to one
filter or to the other. They take turns (:mod:`benchmarks.speeds.timing`). The aims are 1.5 microseconds a sample and a
ratio of at most 1.15. Writes ``results/inertial_cost.json``.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.speeds.timing import Contestant, race, ratio
from ddagr_gym.commands.output import write_text
from ddagr_gym.envs.options import make_settings
from ddagr_gym.envs.turn_batch import SAMPLE_CHANNELS, TurnBatch
from ddagr_gym.estimation import CHANNELS, BatchFilter, FilterModel, InertialFilter, InertialModel
from ddagr_gym.evaluation.controllers import find_controller
from ddagr_gym.evaluation.runs import drive_turn
from ddagr_gym.parameters import Sensors
from ddagr_gym.presets import get_robot

RESULTS = Path(__file__).with_name("results") / "inertial_cost.json"
STEPS = 200  # control steps of a race's turn: 16 s
PASSES = 5  # of the filters over a turn

Use = Callable[[np.ndarray, np.ndarray], object]
"""(commands (1, 2), samples (K, 5)) -> anything; a filter's step."""


def flat_and_inertial() -> tuple[BatchFilter, InertialFilter]:
    """Both filters of the nominal robot."""
    robot = get_robot("ddagr")
    return BatchFilter(FilterModel.of(robot, Sensors()), 1), InertialFilter(InertialModel.of(robot, Sensors()))


def sample_contestants() -> list[Contestant]:
    """Each filter over the samples of one turn; amounts are samples."""
    settings = make_settings(randomisation=False, side="left", soil="thesis_a1")
    turn = settings.draw(np.random.default_rng(0)).turn
    columns = drive_turn(find_controller("B1", turn), settings, 0).columns
    commands = np.column_stack([columns["command_right"], columns["command_left"]])
    readings = np.column_stack([columns[name] for name in CHANNELS])
    flat, inertial = flat_and_inertial()

    def run_flat() -> float:
        for _ in range(PASSES):
            flat.reset()
            flat.step(commands[None], readings[None])
        return float(PASSES * len(readings))

    def run_inertial() -> float:
        for _ in range(PASSES):
            inertial.reset()
            inertial.run(commands, readings)
        return float(PASSES * len(readings))

    return [Contestant("filter", run_flat), Contestant("inertial", run_inertial)]


def environment_contestant(name: str, use: Use) -> Contestant:
    """A turn of one environment whose samples go to a filter; amounts are control steps."""
    batch = TurnBatch(make_settings(randomisation=False, side="left", soil="thesis_a1"))

    def run() -> float:
        rngs = [np.random.default_rng(0)]
        batch.reset([0], rngs, None)
        observations, rewards = batch.new_observations(), np.zeros(1)
        for step in range(STEPS):
            batch.step(np.array([[0.74, 0.04]] if step > 30 else [[0.36, 0.36]]), rngs, rewards, observations)
            use(batch.commands, batch.readings[0, :, : len(SAMPLE_CHANNELS)].copy())
        return float(STEPS)

    return Contestant(name, run)


def environment_contestants() -> list[Contestant]:
    """The environment with either filter."""
    flat, inertial = flat_and_inertial()
    return [
        environment_contestant("filter", lambda commands, samples: flat.step(commands, samples[None])),
        environment_contestant("inertial", inertial.run),
    ]


def measure(repeats: int) -> dict[str, Any]:
    """Microseconds of a sample by filter, and ratios of times: of a sample, and of a step of the environment."""
    samples, steps = race(sample_contestants(), repeats), race(environment_contestants(), repeats)
    return {
        "microseconds_per_sample": {name: round(1e6 / found.median, 3) for name, found in samples.items()},
        "sample_times": ratio(samples, "filter", "inertial"),
        "step_times": ratio(steps, "filter", "inertial"),
    }


def main(arguments: list[str] | None = None) -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--repeats", type=int, default=15)
    parser.add_argument("--output", type=Path, default=RESULTS)
    given = parser.parse_args(arguments)
    found = measure(given.repeats)
    print(f"microseconds of a sample: {found['microseconds_per_sample']}")
    print(f"a step of the environment costs {found['step_times']['median']} times one with the filter")
    write_text(given.output, json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
