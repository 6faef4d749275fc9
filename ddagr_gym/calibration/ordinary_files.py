"""``bank.json``: what a comparison needs of ordinary drives; null stands for what is infinite."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.calibration.ordinary_drives import Ordinary
from ddagr_gym.config import Config, dump_config, parse_config
from ddagr_gym.diagnosis.change.ordinary import Reference, Scores
from ddagr_gym.diagnosis.change.robot_on_ground import RobotOnGround
from ddagr_gym.diagnosis.change.weighing import SensorBias, Weighing
from ddagr_gym.errors import InputError
from ddagr_gym.files import read_json, write_text
from ddagr_gym.parameters import Robot, Soil

Array = NDArray[np.float64]

NAME = "bank.json"
VERSION = 3
READ = (2, 3)
"""Versions that are read: the second one also holds scans that nothing reads."""

_FAULT = "is no bank of drives"
_REMEDY = "make it with `ddagr calibrate` from two drives or more, without --no-bank"

DIGITS = 9
"""Of a number in the file (ours): estimates are known to a few."""


def save_ordinary(ordinary: Ordinary, path: Path) -> None:
    """Write ``bank.json``, whole or not at all."""
    body = {"version": VERSION, "ordinary": ordinary_as_mapping(ordinary)}
    write_text(path, json.dumps(body, allow_nan=False) + "\n")


def load_ordinary(path: Path) -> Ordinary:
    """Read what a comparison needs of the drives.

    Raises:
        InputError: no such file, another format, or one without it.
    """
    body = read_json(path, _FAULT, _REMEDY)
    try:
        version = body["version"]
    except (KeyError, TypeError) as error:
        raise _no_bank(path, error) from None
    if version not in READ:
        raise InputError(f"{path} has version {version!r}, this program reads {VERSION}: calibrate again.")
    if not body.get("ordinary"):
        raise InputError(
            f"{path} says nothing of the sizes of effects in ordinary drives: calibrate again with two drives or more "
            "and without --no-bank."
        )
    try:
        return ordinary_from_mapping(body["ordinary"])
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise _no_bank(path, error) from None


def _no_bank(path: Path, error: Exception) -> InputError:
    return InputError(f"{path} {_FAULT} ({error}): {_REMEDY}.")


def ordinary_as_mapping(ordinary: Ordinary) -> dict[str, Any]:
    """Plain mapping of weights and references."""
    given = {item.name: getattr(ordinary.weighing, item.name) for item in fields(Weighing) if item.name != "biases"}
    weighing = {name: None if value is None else _plain(value) for name, value in given.items()}
    weighing["biases"] = [
        {"drive": item.drive, "ground": item.ground, "value": _plain(item.value)} for item in ordinary.weighing.biases
    ]
    return {
        "weighing": weighing,
        "references": [_reference(item) for item in ordinary.references],
        "on_grounds": {ground: _on_ground(item) for ground, item in ordinary.on_grounds.items()},
    }


def ordinary_from_mapping(mapping: Mapping[str, Any]) -> Ordinary:
    """Weights and references of a mapping.

    Raises:
        KeyError, TypeError, ValueError: an entry is missing or wrong.
    """
    given = mapping["weighing"]
    weighing = Weighing(
        window=float(given["window"]),
        history=float(given["history"]),
        lateness=float(given["lateness"]),
        gyro_scale=float(given["gyro_scale"]),
        sigma=_array(given["sigma"]),
        robust=_array(given["robust"]),
        gyro_bias=float(given["gyro_bias"]),
        accelerometer_bias=float(given["accelerometer_bias"]),
        offsets=_array(given.get("offsets", [0.0, 0.0, 0.0])),
        turning=given.get("turning"),
        run_in=float(given.get("run_in", 0.0)),
        biases=tuple(
            SensorBias(str(item["drive"]), str(item["ground"]), _array(item["value"]))
            for item in given.get("biases", ())
        ),
    )
    on_grounds = {str(ground): _on_ground_of(item) for ground, item in mapping.get("on_grounds", {}).items()}
    return Ordinary(weighing, tuple(_reference_of(item) for item in mapping["references"]), on_grounds)


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return [_plain(item) for item in value]
    number = float(value)
    return float(f"{number:.{DIGITS}g}") if np.isfinite(number) else None


def _array(values: Sequence[float | None]) -> Array:
    return np.array([np.inf if value is None else value for value in values], dtype=np.float64)


def _reference(item: Reference) -> dict[str, Any]:
    return {
        "drive": item.drive,
        "ground": item.ground,
        "reversed_gyro": item.reversed_gyro,
        "known_ground": _scores(item.known_ground),
        "other_ground": _scores(item.other_ground),
        "losses": _plain(item.losses),
        "robot": None if item.robot is None else dump_config(item.robot),
        "soil": None if item.soil is None else dump_config(item.soil),
        "moved": {name: _plain(value) for name, value in item.moved.items()},
        "column_map": item.column_map,
        "period": _plain(item.period),
        "holds": None if item.holds is None else {name: _plain(time) for name, time in item.holds.items()},
        "on_ground": _on_ground(item.on_ground),
    }


def _reference_of(mapping: Mapping[str, Any]) -> Reference:
    return Reference(
        str(mapping["drive"]),
        str(mapping["ground"]),
        bool(mapping["reversed_gyro"]),
        _scores_of(mapping["known_ground"]),
        _scores_of(mapping["other_ground"]),
        _array(mapping.get("losses", [])),
        _config_of(mapping.get("robot"), Robot),
        _config_of(mapping.get("soil"), Soil),
        {str(name): float(value) for name, value in mapping.get("moved", {}).items()},
        str(mapping.get("column_map", "")),
        on_ground=_on_ground_of(mapping.get("on_ground", {})),
        period=float(mapping.get("period", 0.0)),
        holds=_holds_of(mapping.get("holds")),
    )


def _holds_of(mapping: Mapping[str, float] | None) -> dict[str, float] | None:
    return None if mapping is None else {str(name): float(time) for name, time in mapping.items()}


def _on_ground(item: RobotOnGround) -> dict[str, dict[str, float]]:
    return {name: {key: _plain(value) for key, value in getattr(item, name).items()} for name in _OF_GROUND}


def _on_ground_of(mapping: Mapping[str, Mapping[str, float]]) -> RobotOnGround:
    return RobotOnGround(
        **{name: {str(key): float(value) for key, value in mapping.get(name, {}).items()} for name in _OF_GROUND}
    )


_OF_GROUND = ("changes", "deviations")


def _config_of(text: str | None, kind: type[Config]) -> Config | None:
    return None if text is None else parse_config(text, kind)


def _scores(item: Scores) -> dict[str, Any]:
    """Symmetric matrices by their upper triangles, row by row."""
    upper = np.triu_indices(len(item.keys))
    matrices = {name: _plain(getattr(item, name)[upper]) for name in ("information", "within", "between")}
    return {"keys": list(item.keys), "gradient": _plain(item.gradient), **matrices}


def _scores_of(mapping: Mapping[str, Any]) -> Scores:
    keys = tuple(str(key) for key in mapping["keys"])
    upper = np.triu_indices(len(keys))

    def matrix(name: str) -> Array:
        found = np.zeros((len(keys), len(keys)))
        values = _array(mapping[name])
        if len(values) != len(upper[0]):
            raise ValueError(f"{name} has {len(values)} numbers, {len(upper[0])} belong there")
        found[upper] = values
        return np.asarray(found + np.triu(found, 1).T)

    return Scores(keys, _array(mapping["gradient"]), matrix("information"), matrix("within"), matrix("between"))
