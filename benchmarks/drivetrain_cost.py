"""What a robot's drivetrain costs: time of a step with all of its parts over that of the first-order loop alone.

    python -m benchmarks.drivetrain_cost [--repeats 15]

Both robots start from rest, get the same commands, redrawn every 100 samples, and take turns
(:mod:`benchmarks.speeds.timing`), over 600 samples and over 2400: steps near rest are divided, and dead time, filter
and ramps keep a robot near rest for longer. The aim is a ratio of at most 1.15; the exact loop must cost what it did,
which ``benchmarks.speed`` watches. Writes ``results/drivetrain_cost.json``.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.speeds.timing import Contestant, race, ratio
from ddagr_gym.commands.output import write_text
from ddagr_gym.parameters import Drivetrain, Imu, Robot, Sensors, Soil
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.simulator import Simulator

RESULTS = Path(__file__).with_name("results") / "drivetrain_cost.json"
COUNT, HOLD = 16, 100
SAMPLES = (600, 2400)
CASES = (("ddagr", "thesis_a1", 1.0, 125.0, 100.0), ("warthog", "firm_ground", 4.0, 20.0, 40.0))
"""Robot, soil, scale of the commands [rad/s], sample rate [Hz], inertia J of a bank [kg m^2]."""


def full_drivetrain(scale: float, inertia: float) -> Drivetrain:
    """Every part that costs time."""
    return Drivetrain(
        command_delay=0.2, command_deadband=0.05 * scale, command_ramp=20.0 * scale, integral_rate=2.0,
        load_compliance=1.0 / inertia, acceleration_limit=20.0 * scale, integral_limit=10.0 * scale,
        no_load_speed=4.0 * scale, power_limit=30.0 * scale**2, limit_imbalance=0.1, viscous_rate=0.1,
        coulomb_friction=0.2, turning_limit=0.8 * scale, command_filter=0.2, mean_ramp=15.0 * scale,
        turning_ramp=8.0 * scale,
    )  # fmt: skip


def contestant(name: str, robot: Robot, soil: Soil, scale: float, rate: float, samples: int) -> Contestant:
    """One robot in a batch of COUNT, from rest."""
    commands = scale * np.random.default_rng(0).uniform(0.2, 1.2, (COUNT, samples // HOLD, 2))

    def run() -> float:
        simulator = Simulator(COUNT)
        for n in range(COUNT):
            simulator.configure(n, robot, soil, Sensors(imu=Imu(sample_rate=rate)))
        simulator.reset()
        simulator.step(np.repeat(commands, HOLD, axis=1))
        return float(COUNT * samples)

    return Contestant(name, run)


def measure(repeats: int) -> list[dict[str, Any]]:
    """Ratio of the times by case."""
    found = []
    for (robot_name, soil_name, scale, rate, inertia), samples in product(CASES, SAMPLES):
        robot, soil = get_robot(robot_name), get_soil(soil_name)
        built = replace(robot, drivetrain=full_drivetrain(scale, inertia))
        pair = (("loop", robot), ("drivetrain", built))
        rates = race([contestant(name, item, soil, scale, rate, samples) for name, item in pair], repeats)
        times = ratio(rates, "loop", "drivetrain")
        found.append({"robot": robot_name, "soil": soil_name, "seconds": samples / rate, "times": times})
    return found


def main(arguments: list[str] | None = None) -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--repeats", type=int, default=15)
    parser.add_argument("--output", type=Path, default=RESULTS)
    given = parser.parse_args(arguments)
    results = measure(given.repeats)
    for item in results:
        times = item["times"]
        print(
            f"{item['robot']} on {item['soil']}, {item['seconds']:g} s from rest: a step costs {times['median']} times "
            "one of the loop alone"
        )
    write_text(given.output, json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
