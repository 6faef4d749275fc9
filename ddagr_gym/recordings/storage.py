"""A recording as one Parquet file: columns, and the meta data as JSON in the file's key-value meta data.

The key is ``ddagr_gym.recording``. Its JSON holds ``schema_version`` and the fields of
:class:`~ddagr_gym.recordings.schema.RecordingMeta`, and ``rates`` [Hz] for readers without this package.
Columns are float64 in SI units; NaN means no new sample; ``command_valid`` is boolean.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.files import atomic_path
from ddagr_gym.parameters import Robot
from ddagr_gym.recordings.channels import CHANNELS
from ddagr_gym.recordings.files import DEFAULT_LIMITS, Limits, write_atomically
from ddagr_gym.recordings.parquet_reader import open_parquet
from ddagr_gym.recordings.schema import Recording, RecordingMeta

if TYPE_CHECKING:
    import pyarrow as pa

SCHEMA_VERSION = 1
META_KEY = b"ddagr_gym.recording"


def save_parquet(recording: Recording, path: Path) -> None:
    """Write a recording; an existing file is replaced only when the new one is complete.

    Raises:
        InputError: the path cannot be written.
    """
    from pyarrow import parquet

    table = arrow_table(recording)
    write_atomically(path, lambda temporary: parquet.write_table(table, temporary, compression="zstd"))


def arrow_table(recording: Recording) -> pa.Table:
    """A recording as a pyarrow.Table that carries its meta data."""
    import pyarrow as pa

    arrays = {**recording.columns(), "command_valid": recording.command_valid}
    return pa.table(arrays).replace_schema_metadata({META_KEY: json.dumps(_to_json(recording)).encode()})


def load_parquet(path: Path, limits: Limits = DEFAULT_LIMITS) -> Recording:
    """Read a recording that :func:`save_parquet` wrote.

    Raises:
        InputError: no recording's meta data, another schema version, damage, or too large a file.
    """
    with open_parquet(path, limits) as file:
        _meta_json(path.name, file.schema_arrow.metadata)  # before the table is read, which may be long
        table = file.read(use_threads=False)
    return recording_of_arrow(table, path.name)


def recording_of_arrow(table: pa.Table, name: str) -> Recording:
    """The recording that a pyarrow.Table of :func:`arrow_table` holds.

    Args:
        table: with a recording's meta data.
        name: of the table in messages.

    Raises:
        InputError: no recording's meta data, another schema version, or a column that is missing or garbled.
    """
    content = _meta_json(name, table.schema.metadata)
    try:
        columns = {key: np.asarray(table.column(key).to_numpy(), dtype=np.float64) for key in table.column_names}
        valid = columns.pop("command_valid") != 0
        t = columns.pop("t")
    except (KeyError, ValueError, TypeError) as error:
        raise InputError(f"{name} lacks or garbles a column of the schema ({error}): import it again.") from None
    channels = {key: columns[key] for key in CHANNELS if key in columns}
    extras = {key: value for key, value in columns.items() if key not in CHANNELS}
    return Recording(t, channels, valid, _from_json(name, content), extras)


def is_recording(path: Path, limits: Limits = DEFAULT_LIMITS) -> bool:
    """Whether a Parquet file carries a recording's meta data."""
    with open_parquet(path, limits) as file:
        return META_KEY in (file.schema_arrow.metadata or {})


def is_recording_table(table: pa.Table) -> bool:
    """Whether a pyarrow.Table carries a recording's meta data."""
    return META_KEY in (table.schema.metadata or {})


def save_drive(path: Path, columns: Mapping[str, NDArray[np.float64]], robot: Robot) -> None:
    """Write a simulated drive, whole or not at all.

    Args:
        path: ends in .parquet (a recording in the common schema) or anything else for CSV.
        columns: as :func:`ddagr_gym.simulator.simulate` returns them.
        robot: that drove.
    """
    if path.suffix.lower() == ".parquet":
        save_parquet(Recording.from_columns(columns, robot, source=path.name), path)
        return
    with atomic_path(path) as temporary:
        table = np.column_stack(list(columns.values()))
        np.savetxt(temporary, table, delimiter=",", fmt="%.9g", header=",".join(columns), comments="")


def _to_json(recording: Recording) -> dict[str, Any]:
    meta = asdict(recording.meta)
    meta["held"] = dict(recording.meta.held)
    return {"schema_version": SCHEMA_VERSION, **meta, "rates": recording.rates()}


def _meta_json(name: str, metadata: Mapping[bytes, bytes] | None) -> dict[str, Any]:
    raw = (metadata or {}).get(META_KEY)
    if raw is None:
        raise InputError(f"{name} is a Parquet table without a recording's meta data: import it with a column map.")
    try:
        content = json.loads(raw)
        version = content["schema_version"]
    except (ValueError, KeyError, TypeError, RecursionError):
        raise InputError(f"{name} has meta data that do not parse: import the drive again.") from None
    if version != SCHEMA_VERSION:
        raise InputError(
            f"{name} has the schema version {version!r}, this program reads {SCHEMA_VERSION}: import the drive again."
        )
    return dict(content)


def _from_json(label: str, content: Mapping[str, Any]) -> RecordingMeta:
    absent = [item.name for item in fields(RecordingMeta) if item.name not in content]
    try:
        found = msgspec.convert(content, RecordingMeta)
    except msgspec.ValidationError as error:
        raise InputError(f"{label} has incomplete meta data ({error}): import the drive again.") from None
    if absent:
        raise InputError(f"{label} has incomplete meta data (without {absent[0]!r}): import the drive again.")
    return found
