"""``ddagr_gym.isolability``: what manoeuvres and sensors could show and tell apart, before any data."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from ddagr_gym.api.nominal import (
    RobotLike,
    SoilLike,
    ThresholdsLike,
    planned_nominal,
    soil_label,
    thresholds_from,
)
from ddagr_gym.api.results import Report, Table, names_of
from ddagr_gym.control.manoeuvres import Manoeuvre, find_manoeuvre
from ddagr_gym.errors import at_least
from ddagr_gym.files import write_json, write_text
from ddagr_gym.progress import counting

if TYPE_CHECKING:
    from ddagr_gym.diagnosis.planning.isolability import Isolability

ManoeuvreLike: TypeAlias = str | os.PathLike[str] | Manoeuvre
"""Name of a built-in drive, path of a CSV file of commands, or a manoeuvre."""


@dataclass(frozen=True, eq=False, repr=False)
class IsolabilityResult(Report):
    """Which effects planned drives could show, how small, and which they could tell apart.

    ``report`` writes isolability.json, isolability.txt and the figure.

    Attributes:
        table: sizes and pairs (:class:`ddagr_gym.diagnosis.planning.isolability.Isolability`).
    """

    table: Isolability

    @property
    def least_detectable(self) -> dict[str, float]:
        """Least detectable distance from neutral of each effect's most visible size; infinite where nothing shows."""
        return {name: self.table.of(name).size for name in self.table.effects}

    def confused_with(self, effect: str) -> tuple[str, ...]:
        """Effects that could not be distinguished from one, the closest first."""
        return self.table.confused(effect)

    @property
    def headline(self) -> str:
        """Robot, soil, manoeuvres, sensors and gates."""
        from ddagr_gym.reporting.isolability_text import table_head

        return table_head(self.table)

    def tables(self) -> Sequence[Table]:
        """One row per size, the effects that show at the smallest sizes first."""
        from ddagr_gym.reporting.isolability_text import HEADER, table_rows

        return [Table(HEADER, table_rows(self.table))]

    def __str__(self) -> str:
        from ddagr_gym.reporting.isolability_text import table_text

        return table_text(self.table)

    def to_json(self, path: str | os.PathLike[str]) -> None:
        """Write the table as JSON, whole or not at all; what cannot be seen or told apart is null."""
        write_json(path, self.table.as_mapping())

    def _fill(self, folder: Path, progress: Callable[[str], None] | None) -> None:
        from ddagr_gym.reporting.isolability_figure import isolability_figure

        self.to_json(folder / "isolability.json")
        write_text(folder / "isolability.txt", f"{self}\n")
        isolability_figure(self.table.as_mapping(), folder / "isolability.png")


def isolability(
    manoeuvres: ManoeuvreLike | Sequence[ManoeuvreLike] = ("stops", "arcs", "spin", "s_weave"),
    sensors: str | Sequence[str] = ("imu", "encoders", "pose"),
    robot: RobotLike = "ddagr",
    soil: SoilLike | None = None,
    *,
    soil_uncertainty: float | None = None,
    thresholds: ThresholdsLike | None = None,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
) -> IsolabilityResult:
    """Say which effects planned drives could show, how small, and which they could tell apart.

    The nominal robot is simulated over the manoeuvres with the sensors' default noise; from its sensitivities follow
    the least detectable size of each effect and the share of its trace that every other effect cannot imitate.

    Args:
        manoeuvres: one or several: names of built-in drives, CSV files of commands, or manoeuvres.
        sensors: some of imu, encoders, pose.
        robot: nominal: name, YAML file or object.
        soil: nominal: name, YAML file or object; where it is None, that of the thresholds, else firm_ground, at four
            times its usual uncertainty.
        soil_uncertainty: factor on how far the soil may be from the nominal one, as for a diagnosis; None is 1 where
            a soil is given.
        thresholds: gates of ``ddagr null-bank``; by default those that ship for the robot, and where none do those that
            normal noise alone asks for (chi-square): real drives need larger sizes then.
        seed: of the sensor noise.
        progress: called with a line of text at every tenth of the effects.

    Returns:
        Least detectable sizes and the pairs that are confused.

    Raises:
        InputError: unknown names, or drives too short for a diagnosis.
        InputWarning: (a warning) no soil is given for another robot than the ddagr; the thresholds were made for
            another robot, soil or uncertainty.

    Examples:
        >>> import ddagr_gym
        >>> result = ddagr_gym.isolability("two_headings", sensors=["imu", "encoders"])
        >>> result.least_detectable["slope"] < 0.05  # rad
        True
        >>> "accelerometer_bias" in result.confused_with("slope")
        False
    """
    from ddagr_gym.diagnosis.planning.isolability import isolability as tabulated
    from ddagr_gym.physics.effects.registry import absolute_effect_kinds

    at_least(seed=(seed, 0))
    nominal, uncertainty = planned_nominal(robot, soil, soil_uncertainty, thresholds)
    drives = _manoeuvres(manoeuvres)
    gates = thresholds_from(thresholds, nominal.robot, nominal.soil_name, uncertainty)
    with counting(len(absolute_effect_kinds()), "effects", progress) as steps:
        table = tabulated(
            nominal.robot,
            nominal.soil,
            drives,
            names_of(sensors),
            thresholds=gates,
            seed=seed,
            soil_name=nominal.soil_name if soil is None else soil_label(soil),
            soil_uncertainty=uncertainty,
            progress=lambda name: steps.advance(),
        )
    return IsolabilityResult(table)


def _manoeuvres(given: ManoeuvreLike | Sequence[ManoeuvreLike]) -> list[Manoeuvre]:
    items = [given] if isinstance(given, str | os.PathLike | Manoeuvre) else given
    return [item if isinstance(item, Manoeuvre) else find_manoeuvre(str(item)) for item in items]
