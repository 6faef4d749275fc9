"""``./ddagr benchmark``: speed as ratios against peers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tools import CHECKOUT

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
        output: folder for speed.json, speed.png and speed.svg.
    """

    quick: bool = False
    output: Path = CHECKOUT / "benchmarks" / "results"


def run(arguments: Arguments) -> None:
    """Run benchmarks/speed.py."""
    from benchmarks import speed

    speed.main(["--output", str(arguments.output), *(["--quick"] if arguments.quick else [])])
