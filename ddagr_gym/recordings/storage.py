"""A recording as one Parquet file: columns, and the meta data as JSON in the file's key-value meta data.

The key is ``ddagr_gym.recording``. Its JSON holds ``schema_version`` and the fields of
:class:`~ddagr_gym.recordings.schema.RecordingMeta`, and ``rates`` [Hz] for readers without this package.
Columns are float64 in SI units; NaN means no new sample; ``command_valid`` is boolean.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.files import DEFAULT_LIMITS, Limits, write_atomically
from ddagr_gym.recordings.parquet_reader import open_parquet
from ddagr_gym.recordings.schema import CHANNELS, Ranges, Recording, RecordingMeta, RobotGeometry

SCHEMA_VERSION = 1
META_KEY = b"ddagr_gym.recording"


def save_parquet(recording: Recording, path: Path) -> None:
    """Write a recording; an existing file is replaced only when the new one is complete.

    Raises:
        InputError: the path cannot be written.
    """
    import pyarrow as pa
    from pyarrow import parquet

    arrays = {**recording.columns(), "command_valid": recording.command_valid}
    table = pa.table(arrays).replace_schema_metadata({META_KEY: json.dumps(_to_json(recording)).encode()})
    write_atomically(path, lambda temporary: parquet.write_table(table, temporary, compression="zstd"))


def load_parquet(path: Path, limits: Limits = DEFAULT_LIMITS) -> Recording:
    """Read a recording that :func:`save_parquet` wrote.

    Raises:
        InputError: no recording's meta data, another schema version, damage, or too large a file.
    """
    with open_parquet(path, limits) as file:
        content = _meta_json(path, file.schema_arrow.metadata)
        table = file.read(use_threads=False)
    try:
        columns = {name: np.asarray(table.column(name).to_numpy(), dtype=np.float64) for name in table.column_names}
        valid = columns.pop("command_valid") != 0
        t = columns.pop("t")
    except (KeyError, ValueError, TypeError) as error:
        raise InputError(f"{path.name} lacks or garbles a column of the schema ({error}): import it again.") from None
    channels = {name: columns[name] for name in CHANNELS if name in columns}
    extras = {name: value for name, value in columns.items() if name not in CHANNELS}
    return Recording(t, channels, valid, _from_json(path, content), extras)


def is_recording(path: Path, limits: Limits = DEFAULT_LIMITS) -> bool:
    """Whether a Parquet file carries a recording's meta data."""
    with open_parquet(path, limits) as file:
        return META_KEY in (file.schema_arrow.metadata or {})


def _to_json(recording: Recording) -> dict[str, Any]:
    meta = asdict(recording.meta)
    meta["held"] = dict(recording.meta.held)
    return {"schema_version": SCHEMA_VERSION, **meta, "rates": recording.rates()}


def _meta_json(path: Path, metadata: Mapping[bytes, bytes] | None) -> dict[str, Any]:
    raw = (metadata or {}).get(META_KEY)
    if raw is None:
        raise InputError(
            f"{path.name} is a Parquet table without a recording's meta data: import it with a column map."
        )
    try:
        content = json.loads(raw)
        version = content["schema_version"]
    except (ValueError, KeyError, TypeError, RecursionError):
        raise InputError(f"{path.name} has meta data that do not parse: import the drive again.") from None
    if version != SCHEMA_VERSION:
        raise InputError(
            f"{path.name} has the schema version {version!r}, this program reads {SCHEMA_VERSION}: import the "
            "drive again."
        )
    return dict(content)


def _from_json(path: Path, content: Mapping[str, Any]) -> RecordingMeta:
    try:
        geometry = content["geometry"]
        return RecordingMeta(
            robot=str(content["robot"]),
            source=str(content["source"]),
            source_sha256=str(content["source_sha256"]),
            column_map=str(content["column_map"]),
            geometry=None if geometry is None else RobotGeometry(**geometry),
            start_time=float(content["start_time"]),
            segments=_ranges(content["segments"]),
            spans=_ranges(content["spans"]),
            held={str(name): float(period) for name, period in content["held"].items()},
            duplicates_dropped=int(content["duplicates_dropped"]),
            notes=tuple(str(note) for note in content["notes"]),
        )
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise InputError(f"{path.name} has incomplete meta data ({error}): import the drive again.") from None


def _ranges(content: Any) -> Ranges:
    return tuple((int(start), int(stop)) for start, stop in content)
