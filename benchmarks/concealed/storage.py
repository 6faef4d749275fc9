"""Files of a set: recordings, hashes, atomic writing."""

from __future__ import annotations

import gzip
import hashlib
import json
import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .sensors import COLUMNS


class BenchmarkError(ValueError):
    """Something a person can mend: one sentence with the remedy."""


def csv_bytes(log: Mapping[str, np.ndarray]) -> bytes:
    """A recording as CSV: six significant digits, empty where there is no sample."""
    table = np.column_stack([log[name] for name in COLUMNS])
    rows = [",".join("" if value != value else f"{value:.6g}" for value in row) for row in table.tolist()]
    return ("\n".join([",".join(COLUMNS), *rows]) + "\n").encode()


def digest(data: bytes) -> str:
    """SHA-256 in hexadecimal."""
    return hashlib.sha256(data).hexdigest()


def canonical(value: Any) -> bytes:
    """The one JSON text of a value that is hashed."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=True, allow_nan=False).encode()


def write_json(path: Path, value: Any) -> None:
    """Write JSON for people, all or nothing."""
    temporary = path.with_name(f".{path.name}.part")
    temporary.write_text(json.dumps(value, indent=1, sort_keys=True) + "\n")
    os.replace(temporary, path)


def read_json(path: Path) -> Any:
    """Read JSON; a missing or broken file is a :class:`BenchmarkError`."""
    try:
        return json.loads(path.read_text())
    except FileNotFoundError:
        raise BenchmarkError(f"{path} does not exist: give the file that `generate` wrote.") from None
    except json.JSONDecodeError as error:
        raise BenchmarkError(f"{path} is no JSON ({error}): generate the set again.") from None


def write_case(folder: Path, logs: Mapping[str, Mapping[str, np.ndarray]]) -> dict[str, str]:
    """Write the recordings of a case, all or nothing; return the SHA-256 of each uncompressed CSV."""
    temporary = folder.with_name(f".{folder.name}.part")
    shutil.rmtree(temporary, ignore_errors=True)
    temporary.mkdir(parents=True)
    digests = {}
    for run, log in logs.items():
        data = csv_bytes(log)
        digests[run] = digest(data)
        (temporary / f"{run}.csv.gz").write_bytes(gzip.compress(data, compresslevel=6, mtime=0))
    shutil.rmtree(folder, ignore_errors=True)
    os.replace(temporary, folder)
    return digests


def recording_digest(path: Path) -> str:
    """SHA-256 of a recording's uncompressed CSV."""
    try:
        return digest(gzip.decompress(path.read_bytes()))
    except (OSError, EOFError) as error:
        raise BenchmarkError(f"{path} cannot be read ({error}): generate the set again.") from None
