"""Robots, soils and thresholds from names, paths or objects."""

from __future__ import annotations

import os
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias, Union

from ddagr_gym.errors import InputError, InputWarning
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.presets import full_name, get_robot, get_soil, is_file, robot_names, robot_option, soil_names
from ddagr_gym.recordings.schema import Recording

if TYPE_CHECKING:
    from ddagr_gym.diagnosis.answer.verdict import Diagnosis
    from ddagr_gym.diagnosis.gates.thresholds import Thresholds

RobotLike: TypeAlias = str | os.PathLike[str] | Robot
"""Name of a robot, path of a YAML file, or a robot."""

SoilLike: TypeAlias = str | os.PathLike[str] | Soil
"""Name of a soil, path of a YAML file, or a soil."""

ThresholdsLike: TypeAlias = Union["Thresholds", str, os.PathLike[str]]
"""Thresholds, or the path of a file that ``ddagr null-bank`` wrote."""

DEFAULT_ROBOT, DEFAULT_SOIL = "ddagr", "thesis_a1"
"""Nominal ones where nothing says others."""

UNKNOWN_GROUND = ("firm_ground", 4.0)
"""Nominal soil of ground that nobody named, and the factor on its uncertainty."""

OWN = "given in Python"
"""In reports the name of a soil, or the file of a robot, that is an object and no preset: nothing loads it."""


@dataclass(frozen=True)
class Nominal:
    """The simulator that recordings are compared with, and what reports call it.

    Attributes:
        robot: nominal.
        soil: nominal.
        robot_file: full path of the robot's YAML file, :data:`OWN` for an object that is no preset, "" for a preset.
        soil_name: name of the soil, full path of its YAML file, or :data:`OWN`.
    """

    robot: Robot
    soil: Soil
    robot_file: str
    soil_name: str


def nominal_from(robot: RobotLike, soil: SoilLike) -> Nominal:
    """Robot and soil with their names.

    Raises:
        InputError: an unknown name, with the closest ones; a file that is missing or not valid.
    """
    return Nominal(robot_from(robot), soil_from(soil), _robot_file(robot), soil_name_of(soil))


def recorded_robot(recordings: Sequence[Recording]) -> str | None:
    """Robot that recordings name; None where they name none.

    Raises:
        InputError: recordings of two robots, or of one that is not built in.
    """
    names = sorted({recording.meta.robot for recording in recordings} - {""})
    if len(names) > 1:
        raise InputError(f"the recordings are of the robots {', '.join(names)}: give those of one robot at a time.")
    if names and names[0] not in robot_names():
        raise InputError(f"the recordings are of the robot {names[0]!r}: name it with {robot_option(names[0])}.")
    return names[0] if names else None


def robot_or_recorded(robot: RobotLike | None, recordings: Sequence[Recording]) -> RobotLike:
    """Robot as given, else the recordings' own, else :data:`DEFAULT_ROBOT` with an InputWarning.

    Raises:
        InputError: none is given, and the recordings are of two robots or of one that is not built in.
    """
    if robot is not None:
        return robot
    recorded = recorded_robot(recordings)
    if recorded is None:
        warnings.warn(
            f"{recordings[0].meta.source} does not say which robot drove: it is taken for the {DEFAULT_ROBOT}; name "
            "the robot with --robot (robot=... in Python).",
            InputWarning,
            stacklevel=4,
        )
    return DEFAULT_ROBOT if recorded is None else recorded


def soil_or_usual(
    soil: SoilLike | None, soil_uncertainty: float | None, banks: Sequence[Thresholds | None]
) -> tuple[SoilLike, float]:
    """Nominal soil and its uncertainty as given, else those of the thresholds, else of unknown ground.

    Args:
        soil: None where none is given.
        soil_uncertainty: None where it is not given; then 1 beside a soil.
        banks: thresholds that are given, and those that ship for the robot; the first whose soil can be loaded counts.
    """
    if soil is not None:
        return soil, 1.0 if soil_uncertainty is None else soil_uncertainty
    origins = [bank.origin for bank in banks if bank is not None and bank.origin is not None]
    known = [(item.soil, item.soil_uncertainty) for item in origins if item.soil in soil_names() or is_file(item.soil)]
    soil, usual = [*known, UNKNOWN_GROUND][0]
    return soil, usual if soil_uncertainty is None else soil_uncertainty


def nominal_or_usual(
    recordings: Sequence[Recording],
    robot: RobotLike | None,
    soil: SoilLike | None,
    soil_uncertainty: float | None = None,
    thresholds: ThresholdsLike | None = None,
    *,
    say_soil: bool = True,
) -> tuple[Nominal, float]:
    """Robot and soil as given, else the usual ones, and how uncertain the soil is.

    Args:
        recordings: of the robot.
        robot: as of :func:`robot_or_recorded`.
        soil: as of :func:`soil_or_usual`.
        soil_uncertainty: likewise.
        thresholds: as of :func:`thresholds_from`.
        say_soil: whether an InputWarning says a soil that is not given, but the ddagr's own.

    Raises:
        InputError: an unknown name, with the closest ones; a file that is missing or not valid.
    """
    chosen = robot_or_recorded(robot, recordings)
    return _on_usual_soil(chosen, soil, soil_uncertainty, thresholds, say_soil=say_soil)


def planned_nominal(
    robot: RobotLike, soil: SoilLike | None, soil_uncertainty: float | None, thresholds: ThresholdsLike | None
) -> tuple[Nominal, float]:
    """Robot and soil of drives that are yet to be made, and how uncertain the soil is.

    Args:
        robot: as :func:`robot_from` takes it.
        soil: as of :func:`soil_or_usual`. Where it is not given an InputWarning says which one is taken, but for the
            ddagr's own.
        soil_uncertainty: likewise.
        thresholds: as of :func:`thresholds_from`.

    Raises:
        InputError: an unknown name, with the closest ones; a file that is missing or not valid.
    """
    return _on_usual_soil(robot, soil, soil_uncertainty, thresholds, say_soil=True)


def _on_usual_soil(
    chosen: RobotLike,
    soil: SoilLike | None,
    soil_uncertainty: float | None,
    thresholds: ThresholdsLike | None,
    *,
    say_soil: bool,
) -> tuple[Nominal, float]:
    """Robot on the soil as given, else on the usual one, which a warning of the caller's caller says."""
    from ddagr_gym.diagnosis.gates.threshold_files import shipped_thresholds

    given = None if thresholds is None else _loaded(thresholds)
    banks = (given, shipped_thresholds(robot_from(chosen).name))
    nominal_soil, uncertainty = soil_or_usual(soil, soil_uncertainty, banks)
    nominal = nominal_from(chosen, nominal_soil)
    if say_soil and soil is None and (nominal.robot.name, nominal.soil_name) != (DEFAULT_ROBOT, DEFAULT_SOIL):
        warnings.warn(
            f"no soil is given: the {nominal.robot.name} is taken to be on {nominal.soil_name}, at {uncertainty:g} "
            "times a soil's usual uncertainty; name a soil with --soil (soil=... in Python) where it is known.",
            InputWarning,
            stacklevel=4,
        )
    return nominal, uncertainty


def check_left_out(calibration: Path, robot: RobotLike | None, soil: SoilLike | None, **options: object) -> None:
    """Refuse what a calibration already says.

    Args:
        calibration: its folder.
        robot: None where none is given, as the others.
        soil: likewise.
        options: further ones by name.

    Raises:
        InputError: one of them is given.
    """
    given = [name for name, value in {"robot": robot, "soil": soil, **options}.items() if value is not None]
    if given:
        raise InputError(f"a calibration and {given[0]} are given: leave out one of them, {calibration} has both.")


def robot_from(given: RobotLike) -> Robot:
    """Robot by name, from a YAML file, or as it is; InputError as :func:`ddagr_gym.presets.get_robot`."""
    return given if isinstance(given, Robot) else get_robot(str(given))


def soil_from(given: SoilLike) -> Soil:
    """Soil by name, from a YAML file, or as it is; InputError as :func:`ddagr_gym.presets.get_soil`."""
    return given if isinstance(given, Soil) else get_soil(str(given))


def soil_name_of(given: SoilLike) -> str:
    """What reports call a soil: name, full path of its file, the preset's name of an equal object, or :data:`OWN`."""
    if isinstance(given, Soil):
        return next((name for name in soil_names() if get_soil(name) == given), OWN)
    return full_name(str(given))


def soil_label(given: SoilLike) -> str:
    """What a figure calls a soil: name or path as it was given; of an object as :func:`soil_name_of`."""
    return soil_name_of(given) if isinstance(given, Soil) else str(given)


def _robot_file(given: RobotLike) -> str:
    if isinstance(given, Robot):
        return "" if given.name in robot_names() and get_robot(given.name) == given else OWN
    return full_name(str(given)) if is_file(given) else ""


def diagnosed_with(answer: Diagnosis) -> tuple[str, str]:
    """Robot, by its file where it has one, and soil that a diagnosis names; the usual ones where it names none."""
    return answer.options.robot_file or answer.robot or DEFAULT_ROBOT, answer.soil or DEFAULT_SOIL


def _loaded(given: ThresholdsLike) -> Thresholds:
    """Thresholds as they are, or from a file; InputError where it cannot be read."""
    from ddagr_gym.diagnosis.gates.threshold_files import load_thresholds
    from ddagr_gym.diagnosis.gates.thresholds import Thresholds

    return given if isinstance(given, Thresholds) else load_thresholds(Path(given))


def thresholds_from(
    given: ThresholdsLike | None, robot: Robot, soil_name: str, soil_uncertainty: float = 1.0
) -> Thresholds | None:
    """Thresholds as given or from a file, or those that ship for a robot; None where none do.

    Those that were made for something else are used with an :class:`~ddagr_gym.errors.InputWarning`.

    Args:
        given: of ``ddagr null-bank``.
        robot: nominal one of the run.
        soil_name: name or full path of the run's nominal soil.
        soil_uncertainty: of the run.

    Raises:
        InputError: the file cannot be read.
    """
    from ddagr_gym.diagnosis.gates.threshold_files import shipped_thresholds

    found = shipped_thresholds(robot.name) if given is None else _loaded(given)
    if found is not None and found.origin is not None:
        warning = found.origin.mismatch(robot.name, soil_name, soil_uncertainty)
        if warning:
            warnings.warn(warning, InputWarning, stacklevel=3)
    return found
