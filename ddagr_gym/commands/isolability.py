"""``ddagr isolability``: what manoeuvres and sensors could show and tell apart, before any data."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ddagr_gym.commands.output import check_output_folder, format_table, output_folder, write_text
from ddagr_gym.commands.ranges import check_at_least
from ddagr_gym.progress import Progress

if TYPE_CHECKING:
    from ddagr_gym.diagnosis.planning.isolability import Isolability

EXAMPLES = (
    "ddagr isolability --manoeuvres straight two_headings --output isolability",
    "ddagr isolability --robot warthog --soil firm_ground --soil-uncertainty 4 --manoeuvres stops arcs spin "
    "--sensors imu encoders",
)


@dataclass(frozen=True)
class Arguments:
    """Say which effects planned drives could show, how small, and which they could tell apart.

    The nominal robot is simulated over the manoeuvres with the sensors' default noise; from its sensitivities follow
    the least detectable size of each effect and the share of its trace that every other effect cannot imitate.

    Attributes:
        output: folder for isolability.json, isolability.txt and the figure; the table is only printed without one.
        manoeuvres: names of built-in drives, or CSV files of commands.
        sensors: some of imu, encoders, pose.
        robot: nominal robot: name (ddagr robots) or YAML file.
        soil: nominal soil: name (ddagr soils) or YAML file.
        soil_uncertainty: as for `ddagr diagnose`.
        thresholds: gates of `ddagr null-bank`; by default those that ship for the robot, and where none do those that
            normal noise alone asks for (chi-square): real drives need larger sizes then.
        seed: of the sensor noise.
        overwrite: replace an output folder that an earlier command wrote.
    """

    output: Path | None = None
    manoeuvres: tuple[str, ...] = ("stops", "arcs", "spin", "s_weave")
    sensors: tuple[str, ...] = ("imu", "encoders", "pose")
    robot: str = "ddagr"
    soil: str = "thesis_a1"
    soil_uncertainty: float = 1.0
    thresholds: Path | None = None
    seed: int = 0
    overwrite: bool = False


def run(arguments: Arguments) -> None:
    """Make the table, print it, write it."""
    from ddagr_gym.commands.gates import gates_for
    from ddagr_gym.control.manoeuvres import find_manoeuvre
    from ddagr_gym.diagnosis.planning.isolability import isolability
    from ddagr_gym.identification.nuisances import NuisancePriors
    from ddagr_gym.physics.effects.registry import effect_kinds
    from ddagr_gym.presets import get_robot, get_soil

    check_at_least(arguments, seed=0)
    if arguments.output is not None:
        check_output_folder(arguments.output, overwrite=arguments.overwrite)
    priors = NuisancePriors().with_soil(arguments.soil_uncertainty)
    robot, soil = get_robot(arguments.robot), get_soil(arguments.soil)
    manoeuvres = [find_manoeuvre(name) for name in arguments.manoeuvres]
    thresholds = gates_for(arguments.thresholds, arguments.robot, arguments.soil, arguments.soil_uncertainty)
    with Progress(len(effect_kinds()), "effects") as progress:
        table = isolability(
            robot,
            soil,
            manoeuvres,
            arguments.sensors,
            thresholds=thresholds,
            seed=arguments.seed,
            soil_name=arguments.soil,
            priors=priors,
            progress=lambda name: progress.advance(),
        )
    print(table_text(table))
    if arguments.output is not None:
        _write(table, arguments.output, overwrite=arguments.overwrite)


def _write(table: Isolability, output: Path, *, overwrite: bool) -> None:
    """Table, JSON and figure."""
    from ddagr_gym.reporting.isolability_figure import isolability_figure

    mapping = table.as_mapping()
    with output_folder(output, overwrite=overwrite) as folder:
        write_text(folder / "isolability.json", json.dumps(mapping, indent=1, allow_nan=False) + "\n")
        write_text(folder / "isolability.txt", table_text(table) + "\n")
        isolability_figure(mapping, folder / "isolability.png")
    print(f"\ntable, JSON and figure: {output}")


def table_text(table: Isolability) -> str:
    """One line per size of an effect, the effects that show at the smallest sizes first."""
    order = sorted(table.effects, key=lambda name: table.of(name).multiples)
    rows = []
    for name in order:
        for item in (entry for entry in table.detectable if entry.effect == name):
            rows.append(
                (name, item.field, _size(item.size), item.unit, _multiples(item.multiples), _rivals(table, name))
            )
    header = ("effect", "size", "least detectable", "unit", "/ least meaningful", "not told from (share of its own)")
    head = (
        f"{table.robot} on {table.soil}: {', '.join(table.manoeuvres)} ({table.duration:.0f} s) with "
        f"{', '.join(table.sensors)}; gates: {table.gates}"
    )
    return f"{head}\n\n{format_table(header, rows)}"


def _size(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "none"


def _multiples(value: float) -> str:
    return f"{value:.2g}" if value < 1e3 else "not seen"


def _rivals(table: Isolability, name: str) -> str:
    if table.of(name).multiples >= 1e3:
        return ""
    row = table.share[table.effects.index(name)]
    pairs = [f"{rival} ({row[table.effects.index(rival)]:.2f})" for rival in table.confused(name)]
    return ", ".join(pairs)
