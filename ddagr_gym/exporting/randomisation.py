"""Ranges as a YAML file that any simulator's randomisation can read."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ddagr_gym.config import dump_config
from ddagr_gym.errors import InputError
from ddagr_gym.exporting.ranges import Range

VERSION = 1


@dataclass(frozen=True)
class Entry:
    """A parameter of the file.

    Attributes:
        value: as found; null for no limit, or where there is none.
        low: 5 % of the draws are below.
        high: 5 % are above.
        distribution: normal, or fixed.
        unit: of the numbers.
        meaning: in words.
        source: where value and range come from.
    """

    value: float | None
    low: float | None
    high: float | None
    distribution: str
    unit: str
    meaning: str
    source: str

    def __post_init__(self) -> None:
        if self.distribution not in ("normal", "fixed"):
            raise InputError(f"distribution is {self.distribution!r}: it is normal or fixed.")
        if self.low is not None and self.high is not None and self.low > self.high:
            raise InputError(f"low is {self.low:g}, above high {self.high:g}: exchange them.")


@dataclass(frozen=True)
class RandomisationFile:
    """Content of ``randomisation.yaml``.

    Attributes:
        version: of this format.
        robot: name of it.
        source: where the numbers come from.
        working_point: mean bank speed at which slip was measured [rad/s].
        draws: from which low and high are percentiles.
        seed: of the draws.
        parameters: by name.
    """

    version: int
    robot: str
    source: str
    working_point: float
    draws: int
    seed: int
    parameters: dict[str, Entry]


def randomisation_file(
    robot: str, source: str, working_point: float, ranges: tuple[Range, ...], *, draws: int, seed: int
) -> RandomisationFile:
    """The file of all ranges; numbers that are not finite become null."""
    entries = {
        item.name: Entry(
            _finite(item.value), _finite(item.low), _finite(item.high), item.distribution, item.unit, item.meaning,
            item.source,
        )
        for item in ranges
    }  # fmt: skip
    return RandomisationFile(VERSION, robot, source, working_point, draws, seed, entries)


def as_text(content: RandomisationFile) -> str:
    """YAML of it."""
    return dump_config(content)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
