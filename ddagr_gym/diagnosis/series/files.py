"""``drives.json``: written and read by its types."""

from __future__ import annotations

from pathlib import Path

import msgspec
from msgspec import inspect

from ddagr_gym.diagnosis.answer.drive_series import SERIES_SCHEMA, DriveSeries
from ddagr_gym.diagnosis.result.files import plain, with_nan
from ddagr_gym.errors import InputError
from ddagr_gym.files import read_json, write_json


def save(series: DriveSeries, path: Path) -> None:
    """Write ``drives.json``, all or nothing; null stands for numbers that are not finite."""
    write_json(path, plain(series))


def load(path: Path) -> DriveSeries:
    """Read a ``drives.json``.

    Raises:
        InputError: no such file, no JSON, another schema, a missing or wrong entry.
    """
    again = "make it again with `ddagr diagnose FOLDER --calibration CAL`"
    mapping = read_json(path, "cannot be read as the answer on many drives", again)
    schema = mapping.get("schema") if isinstance(mapping, dict) else None
    if schema != SERIES_SCHEMA:
        raise InputError(f"{path} has schema {schema!r} and this version reads {SERIES_SCHEMA!r}: {again}.")
    try:
        return msgspec.convert(with_nan(mapping, inspect.type_info(DriveSeries)), DriveSeries)
    except msgspec.ValidationError as error:
        raise InputError(f"{path} is wrong ({error}): {again}.") from None
