"""``ddagr benchmark``: speed as ratios against peers, measured from the checkout."""

from __future__ import annotations

import importlib
import sys
from dataclasses import dataclass
from pathlib import Path

from ddagr_gym.errors import InputError

EXAMPLES = (
    "ddagr benchmark --quick --output speed",
    "ddagr benchmark",
)


@dataclass(frozen=True)
class Arguments:
    """Measure the simulator's speed beside peers and a C kernel, and its accuracy against cost.

    Peers need pip install "gymnasium[mujoco]", the kernel in C a C compiler; what is missing is left out and named.

    Attributes:
        quick: half a minute instead of several, rougher figures, 500 resets instead of 10,000.
        output: folder for speed.json, speed.png and speed.svg; benchmarks/results of the checkout by default.
    """

    quick: bool = False
    output: Path | None = None


def run(arguments: Arguments) -> None:
    """Run benchmarks/speed.py of the checkout that this package is installed from."""
    checkout = Path(__file__).resolve().parents[2]
    if not (checkout / "benchmarks" / "speed.py").is_file():
        raise InputError("the benchmarks are not in the installed package: run ./ddagr benchmark from a checkout.")
    sys.path.insert(0, str(checkout))
    output = checkout / "benchmarks" / "results" if arguments.output is None else arguments.output
    speed = importlib.import_module("benchmarks.speed")
    speed.main(["--output", str(output), *(["--quick"] if arguments.quick else [])])
