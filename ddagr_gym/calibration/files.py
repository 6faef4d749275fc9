"""``calibration.json``: written and read by its types."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

import msgspec

from ddagr_gym.calibration.result import SCHEMA, SCHEMA_VERSION, Calibration
from ddagr_gym.config import load_config
from ddagr_gym.diagnosis.result.files import finite_or_null, with_nan
from ddagr_gym.errors import InputError
from ddagr_gym.files import read_json, write_text
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.physics.effects.slope import Slope

NAME = "calibration.json"
ROBOT = "robot.yaml"
PAGE = "calibration.html"

_PAST_FILE_NAMES = "/\\\0"
"""Characters that a file's name cannot hold."""


def soil_file(ground: str) -> str:
    """Name of the file of a ground's soil."""
    return f"soil_{ground}.yaml"


def check_ground_name(ground: str) -> None:
    """Refuse names of grounds that cannot be part of a file's name; InputError."""
    if not ground or any(character in ground for character in _PAST_FILE_NAMES):
        raise InputError(f"the ground {ground!r} becomes the name of a file: give one without slashes.")


def as_text(calibration: Calibration) -> str:
    """JSON of a calibration; null stands for numbers that are not finite."""
    content = asdict(calibration)
    for name in ("currents", "imu"):
        if content[name] is None:
            del content[name]
    return json.dumps(finite_or_null(content), indent=1, allow_nan=False) + "\n"


def save(calibration: Calibration, path: Path) -> None:
    """Write ``calibration.json``, whole or not at all."""
    write_text(path, as_text(calibration))


def load(folder: Path) -> Calibration:
    """The calibration of a folder that ``ddagr calibrate`` wrote.

    Raises:
        InputError: no such folder or file, no JSON, or not of this schema.
    """
    path = folder / NAME if folder.is_dir() else folder
    mapping = read_json(path, "cannot be read as a calibration", "make it with `ddagr calibrate`")
    if not isinstance(mapping, dict) or mapping.get("schema") != SCHEMA:
        raise InputError(f"{path} holds no calibration: make it with `ddagr calibrate`.")
    if mapping.get("schema_version") != SCHEMA_VERSION:
        raise InputError(
            f"{path} has version {mapping.get('schema_version')!r} of its format, this program reads "
            f"{SCHEMA_VERSION}: calibrate again."
        )
    try:
        return msgspec.convert(with_nan(mapping, msgspec.inspect.type_info(Calibration)), Calibration)
    except msgspec.ValidationError as error:
        raise InputError(f"{path}: {error}: make it again with `ddagr calibrate`.") from None


def robot_file(folder: Path) -> str:
    """Path of the calibrated robot of a folder; InputError where ``ddagr calibrate`` did not write it."""
    if not (folder / ROBOT).is_file():
        raise InputError(f"{folder} is no folder that `ddagr calibrate` wrote, it has no {ROBOT}: give its path.")
    return str(folder / ROBOT)


def load_robot(folder: Path) -> Robot:
    """Calibrated robot of a folder; InputError where it is missing or wrong."""
    return load_config(folder / ROBOT, Robot)


def load_slope(folder: Path, ground: str) -> tuple[Slope, ...]:
    """Slope of a calibrated ground in the frame of its poses; empty where it is level."""
    return tuple(Slope.of_gradient(*item.gradient) for item in load(folder).slopes if item.ground == ground)


def ground_to_add(folder: Path, ground: str) -> str:
    """That a ground could be named where a calibration knows a single one and none was named; "" otherwise.

    Args:
        folder: that ``ddagr calibrate`` wrote.
        ground: that was named; "" for none.
    """
    try:
        grounds = () if ground else load(folder).grounds
    except InputError:
        return ""  # whoever needs the calibration says what is wrong with it
    if len(grounds) != 1:
        return ""
    return f"the calibration knows one ground: add --ground {grounds[0]} if the drive was on it."


def load_soil(folder: Path, ground: str = "") -> tuple[str, Soil]:
    """Calibrated soil of a ground, and the ground.

    Args:
        folder: that ``ddagr calibrate`` wrote.
        ground: may be left out where there is only one.

    Raises:
        InputError: an unknown ground, or none named of several.
    """
    grounds = load(folder).grounds
    if not ground and len(grounds) > 1:
        raise InputError(f"{folder} is calibrated on {', '.join(grounds)}: name one of them with --ground.")
    chosen = ground or grounds[0]
    if chosen not in grounds:
        raise InputError(f"{folder} is not calibrated on {chosen!r}: choose from {', '.join(grounds)}.")
    return chosen, load_config(folder / soil_file(chosen), Soil)
