"""Files of plain numbers, npz without pickle. They are not trusted: size, types, shapes and values are checked."""

from __future__ import annotations

import json
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.files import DAMAGED_ARRAYS, atomic_path

MAXIMUM_BYTES = 1_000_000
"""Largest file that is read."""
MAXIMUM_UNPACKED = 8_000_000
"""Largest sum of its members, unpacked."""
_DESCRIPTION = "description"


def write_arrays(
    path: str | os.PathLike[str], arrays: Mapping[str, NDArray[Any]], description: Mapping[str, Any]
) -> Path:
    """Write arrays and a description as JSON, whole or not at all; the same content gives the same bytes.

    Args:
        path: of the file.
        arrays: by name.
        description: of them.

    Returns:
        The file.
    """
    text = json.dumps(description, sort_keys=True)
    members = {**arrays, _DESCRIPTION: np.frombuffer(text.encode(), dtype=np.uint8)}
    with atomic_path(path) as temporary:
        np.savez_compressed(temporary, **members)  # type: ignore[arg-type]
    return Path(path)


def read_arrays(file: Path, kind: str) -> dict[str, NDArray[Any]]:
    """Arrays by name.

    Args:
        file: to read.
        kind: what it should be, for messages: "a policy".

    Raises:
        InputError: no such file, too large, or damaged.
    """
    try:
        size = file.stat().st_size
        if size > MAXIMUM_BYTES:
            raise InputError(f"{file} has {size} bytes: {kind} may have {MAXIMUM_BYTES} at most.")
        with zipfile.ZipFile(file) as archive:
            unpacked = sum(member.file_size for member in archive.infolist())
        if unpacked > MAXIMUM_UNPACKED:
            raise InputError(f"{file} unpacks to {unpacked} bytes: {kind} may have {MAXIMUM_UNPACKED} at most.")
        with np.load(file, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except InputError:
        raise
    except OSError as error:
        raise InputError(f"{file} cannot be read: {(error.strerror or f'not {kind}').lower()}.") from None
    except DAMAGED_ARRAYS:
        raise InputError(f"{file} is not {kind}: give an .npz file that its training wrote.") from None


def take_array(
    file: Path, arrays: dict[str, NDArray[Any]], name: str, shape: tuple[int, ...], number: type[np.floating[Any]],
    kind: str,
) -> NDArray[Any]:  # fmt: skip
    """One of the arrays, which is taken out; InputError for another shape or type, or values that are not finite."""
    value = arrays.pop(name, None)
    if value is None:
        raise InputError(f"{file} is not {kind}: it has no {name!r}.")
    if value.shape != shape or value.dtype != number:
        raise InputError(f"{file}: {name} is {value.dtype} of shape {value.shape}: {number.__name__} {shape} expected.")
    if not np.isfinite(value).all():
        raise InputError(f"{file}: {name} holds values that are not finite: give {kind} of another training.")
    return value


def take_description(file: Path, arrays: dict[str, NDArray[Any]], kind: str) -> bytes:
    """JSON of the description, not checked, which is taken out of the arrays; InputError where there is none."""
    stored = arrays.pop(_DESCRIPTION, None)
    if stored is None or stored.dtype != np.uint8 or stored.ndim != 1:
        raise InputError(f"{file} is not {kind}: it has no description.")
    return stored.tobytes()
