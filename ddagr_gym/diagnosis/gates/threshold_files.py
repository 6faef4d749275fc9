"""Thresholds of a null bank as files, and those that ship with the package."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from types import UnionType
from typing import Any, get_args

from ddagr_gym.diagnosis.gates.thresholds import SHORT_WINDOW, VERSION, Gate, NullKind, Origin, Thresholds
from ddagr_gym.errors import InputError
from ddagr_gym.files import atomic_path, read_json

GENERAL = "ddagr"
"""Robot whose thresholds serve where a robot has none."""


def save_thresholds(thresholds: Thresholds, path: Path) -> None:
    """Write thresholds as JSON, all or nothing."""
    body = {"version": VERSION, **asdict(thresholds)}
    with atomic_path(path) as part:
        part.write_text(json.dumps(body, indent=1, sort_keys=True) + "\n")


def load_thresholds(path: Path) -> Thresholds:
    """Read thresholds.

    Raises:
        InputError: a file that is missing, no JSON, of another version, without an entry, or with one that makes no
            sense.
    """
    body = read_json(path, "cannot be read as thresholds", "make it with `ddagr null-bank`")
    if not isinstance(body, dict) or body.get("version") != VERSION:
        raise InputError(f"{path} is not a thresholds file of version {VERSION}: make it with `ddagr null-bank`.")
    origin = _origin(body.get("origin"), path)
    try:
        return _thresholds(body, origin)
    except KeyError as error:
        raise InputError(f"{path} has no entry {error}: make it with `ddagr null-bank`.") from None
    except (TypeError, ValueError, AttributeError, OverflowError) as error:
        raise InputError(f"{path} has an entry of another form ({error}): make it with `ddagr null-bank`.") from None


def _thresholds(body: dict[str, Any], origin: Origin | None) -> Thresholds:
    """Thresholds from the mapping of a file."""
    gates = {str(name): Gate(**gate) for name, gate in body["gates"].items()}
    misfit = {str(name): float(value) for name, value in body["misfit"].items()}
    maxima = tuple(float(value) for value in body.get("maxima", ()))
    return Thresholds(
        gates,
        misfit,
        int(body["nulls"]),
        str(body["bank"]),
        float(body["level"]),
        maxima,
        float(body.get("windows", 0.0)),
        float(body.get("duration", SHORT_WINDOW)),
        origin,
    )


def _origin(entry: object, path: Path) -> Origin | None:
    """Origin from its entry in a file; older files have none."""
    if entry is None:
        return None
    types: dict[str, type | UnionType] = {
        "robot": str,
        "soil": str,
        "soil_uncertainty": int | float,
        "seed": int,
        "kind": str,
    }
    kinds = get_args(NullKind)
    if (
        not isinstance(entry, dict)
        or entry.keys() != types.keys()
        or not all(isinstance(entry[name], type_) for name, type_ in types.items())
        or entry["kind"] not in kinds
    ):
        raise InputError(
            f"the origin in {path} is not robot, soil, soil_uncertainty, seed and kind ({' or '.join(kinds)}): make "
            "the file with `ddagr null-bank`."
        )
    return Origin(**entry)


def shipped_thresholds(robot: str) -> Thresholds | None:
    """Thresholds that ship with the package for a robot, or None."""
    path = Path(__file__).resolve().parents[2] / "data" / f"null_bank_{robot}.json"
    return load_thresholds(path) if path.is_file() else None


def usual_thresholds(robot: str) -> Thresholds:
    """Thresholds that a diagnosis takes where none are given: the robot's own, else those of the DDAGR.

    Shipped ones are of simulated drives: what a simulator lacks is not judged by real drives of which it may lack the
    same.
    """
    return shipped_thresholds(robot) or default_thresholds(GENERAL)


def default_thresholds(robot: str) -> Thresholds:
    """Thresholds that ship with the package for drives of three times 60 s.

    Raises:
        InputError: no bank ships for the robot.
    """
    found = shipped_thresholds(robot)
    if found is None:
        raise InputError(
            f"no null bank ships for robot {robot!r}: make one with `ddagr null-bank RUN... --robot {robot}` and give "
            "it as --thresholds."
        )
    return found
