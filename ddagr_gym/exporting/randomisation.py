"""Ranges as a YAML file that any simulator's randomisation can read."""

from __future__ import annotations

from dataclasses import dataclass

from ddagr_gym.exporting.ranges import Range

VERSION = 1


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
    parameters: dict[str, Range]
