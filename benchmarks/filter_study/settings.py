"""What a study of the filter drives: soils, how many drives, seeds."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path

from ddagr_gym.config import load_config
from ddagr_gym.errors import InputError
from ddagr_gym.physics.soil_draws import get_distribution

SHIPPED_PLAN = Path(__file__).with_name("plan.yaml")


@dataclass(frozen=True)
class FilterStudySettings:
    """Plan of a filter study; every random number follows from ``seed``.

    Attributes:
        seed: of soils, robots, sensors, noise and resampling.
        soil_sets: soil distributions to drive on.
        drives: row turns on each.
        radius: range of commanded turn radii [m].
        matched_drives: drives drawn from the filter's own model.
        force_law_soils: soils of each set on which the force laws are fitted.
        recordings: robot of each real recording, by its name without suffix.
    """

    seed: int
    soil_sets: tuple[str, ...]
    drives: int
    radius: tuple[float, float]
    matched_drives: int
    force_law_soils: int
    recordings: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, least in (("seed", 0), ("drives", 2), ("matched_drives", 2), ("force_law_soils", 1)):
            if getattr(self, name) < least:
                raise InputError(f"{name} is {getattr(self, name)}: a filter study needs at least {least}.")
        if not self.soil_sets:
            raise InputError("soil_sets is empty: name at least one soil distribution.")
        for name in self.soil_sets:
            get_distribution(name)
        if not 0.0 < self.radius[0] <= self.radius[1]:
            raise InputError(f"radius is {self.radius}: give 0 < low <= high in m.")

    @property
    def fingerprint(self) -> str:
        """SHA-256 of the plan."""
        return hashlib.sha256(json.dumps(asdict(self), sort_keys=True).encode()).hexdigest()


def load_filter_study(path: Path = SHIPPED_PLAN) -> FilterStudySettings:
    """Plan from a YAML file; InputError where there is none or its content does not fit."""
    return load_config(path, FilterStudySettings)
