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
from ddagr_gym.files import expanded
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.physics.effects import Effect, load_effects, load_intervals
from ddagr_gym.physics.effects.draws import draw_sizes

DIAGNOSIS = "diagnosis.json"

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
    """

    found: Simulated
    draw: Callable[[np.random.Generator], Simulated]
    source: str
    spread: str


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
    effects = load_effects(folder / EFFECTS) if (folder / EFFECTS).is_file() else ()
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

    def draw(rng: np.random.Generator) -> Simulated:
        known = zip(effects, intervals, strict=True)
        drawn = tuple(draw_sizes(effect, own, rng, most=MOST_DEVIATIONS) for effect, own in known)
        return Simulated(given_robot, given_soil, drawn)

    found = Simulated(given_robot, given_soil, effects)
    return Corrected(found, draw, f"diagnosis {folder.name}", "the 90 % intervals of the effects that were named")


def _given_or_file(folder: Path, name: str, given: Kind | None, kind: type[Kind]) -> Kind:
    file = folder / f"{name}.yaml"
    if given is not None:
        return given
    if not file.is_file():
        raise InputError(f"{folder} holds no {file.name}: name the {name} that it was compared with by --{name}.")
    return load_config(file, kind)
