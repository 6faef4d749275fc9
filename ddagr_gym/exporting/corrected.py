"""The corrected simulator of a diagnosis or a calibration, and how it may differ from what was found."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from ddagr_gym.calibration import files as calibration_files
from ddagr_gym.config import load_config
from ddagr_gym.envs.calibrated_draws import EFFECTS, MOST_DEVIATIONS, load_draws
from ddagr_gym.errors import InputError
from ddagr_gym.exporting.refitted import RefittedDraws, read_answer, refitted_draws
from ddagr_gym.files import expanded
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.physics.effects import Effect, load_effects, load_intervals
from ddagr_gym.physics.effects.draws import draw_sizes

DIAGNOSIS = "diagnosis.json"

NO_SPREAD = (
    "How sure robot and soil are: this diagnosis does not say it (it is of an earlier version), so that only sizes of "
    "effects are drawn. Diagnose the recordings again for ranges of all."
)
GIVEN = "How sure the given {} may be: what an option gives is fixed in all draws."
OF_RECORDINGS = (
    "What was refitted of single recordings and not of robot or soil: biases of gyro and accelerometer, headings, and "
    "the sample in which commands act."
)
APART = (
    "What sizes of effects have to do with robot and soil: robot and soil are drawn together as they were refitted, "
    "each effect apart from them. A range that both move may be too wide."
)

Kind = TypeVar("Kind", Robot, Soil)


@dataclass(frozen=True)
class Simulated:
    """What our simulator drives.

    Attributes:
        robot: with its drivetrain.
        soil: under all wheels.
        effects: what else was found.
    """

    robot: Robot
    soil: Soil
    effects: tuple[Effect, ...]


@dataclass(frozen=True)
class Corrected:
    """A corrected simulator.

    Attributes:
        found: as it was found.
        draw: another one, as uncertain as it is.
        source: where it comes from, for people.
        spread: where the draws come from, in a sentence.
        fixed: sentences on what the draws leave out.
    """

    found: Simulated
    draw: Callable[[np.random.Generator], Simulated]
    source: str
    spread: str
    fixed: tuple[str, ...] = ()


def load_corrected(
    folder: str | os.PathLike[str],
    ground: str = "",
    robot: Robot | None = None,
    soil: Soil | None = None,
) -> Corrected:
    """The corrected simulator of a folder that ``ddagr diagnose`` or ``ddagr calibrate`` wrote.

    Args:
        folder: of the diagnosis or the calibration.
        ground: of a calibration with several.
        robot: in place of the diagnosis's.
        soil: in place of the diagnosis's.

    Raises:
        InputError: no such folder, a file that is missing or wrong, or an option that does not belong to it.
    """
    path = expanded(folder)
    if (path / calibration_files.NAME).is_file():
        if robot is not None or soil is not None:
            raise InputError(f"{path} is a calibration, which has its robot and soils: leave out --robot and --soil.")
        return _of_calibration(path, ground)
    if not (path / DIAGNOSIS).is_file():
        raise InputError(
            f"{path} holds neither {DIAGNOSIS} nor {calibration_files.NAME}: give a folder that `ddagr diagnose` or "
            "`ddagr calibrate` wrote."
        )
    if ground:
        raise InputError(f"{path} is a diagnosis, which has one ground: leave out --ground {ground}.")
    return _of_diagnosis(path, robot, soil)


def _of_calibration(folder: Path, ground: str) -> Corrected:
    chosen, soil = calibration_files.load_soil(folder, ground)
    draws = load_draws(folder, chosen)
    sensors = load_effects(folder / EFFECTS) if (folder / EFFECTS).is_file() else ()
    effects = (*sensors, *calibration_files.load_slope(folder, chosen))
    found = Simulated(calibration_files.load_robot(folder), soil, effects)

    def draw(rng: np.random.Generator) -> Simulated:
        return Simulated(draws.draw_robot(rng), draws.draw_soil(rng), effects)

    return Corrected(found, draw, f"calibration {folder.name} on {chosen}", "the calibration's spread between drives")


def _of_diagnosis(folder: Path, robot: Robot | None, soil: Soil | None) -> Corrected:
    given_robot = _given_or_file(folder, "robot", robot, Robot)
    given_soil = _given_or_file(folder, "soil", soil, Soil)
    path = folder / EFFECTS
    effects = load_effects(path)
    intervals = load_intervals(path)
    answer = read_answer(folder / DIAGNOSIS)
    refitted = None if answer is None else refitted_draws(answer, given_robot, given_soil, MOST_DEVIATIONS)

    def draw(rng: np.random.Generator) -> Simulated:
        known = zip(effects, intervals, strict=True)
        drawn = tuple(draw_sizes(effect, own, rng, most=MOST_DEVIATIONS) for effect, own in known)
        made_robot, made_soil = (given_robot, given_soil) if refitted is None else refitted.draw(rng)
        return Simulated(made_robot if robot is None else robot, made_soil if soil is None else soil, drawn)

    found = Simulated(given_robot, given_soil, effects)
    own = [name for name, item in (("robot", robot), ("soil", soil)) if item is None and refitted is not None]
    beside = f" and of its refitted {' and '.join(own)}" if own else ""
    spread = f"the 90 % intervals of the effects that were named{beside}"
    return Corrected(found, draw, f"diagnosis {folder.name}", spread, _fixed(refitted, robot, soil))


def _fixed(refitted: RefittedDraws | None, robot: Robot | None, soil: Soil | None) -> tuple[str, ...]:
    """Sentences on what is fixed in the draws of a diagnosis, or drawn apart."""
    given = [name for name, item in (("robot", robot), ("soil", soil)) if item is not None]
    options = (GIVEN.format(" and ".join(given)),) if given else ()
    if len(given) == 2:
        return options
    return (*options, NO_SPREAD) if refitted is None else (*options, OF_RECORDINGS, APART)


def _given_or_file(folder: Path, name: str, given: Kind | None, kind: type[Kind]) -> Kind:
    file = folder / f"{name}.yaml"
    if given is not None:
        return given
    if not file.is_file():
        raise InputError(f"{folder} holds no {file.name}: name the {name} that it was compared with by --{name}.")
    return load_config(file, kind)
