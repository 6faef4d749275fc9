"""Folder of a ROS 2 bag: files that ``metadata.yaml`` names, stored as SQLite or MCAP, also compressed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path, PurePosixPath
from typing import Any

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.bag import Bag, joined
from ddagr_gym.recordings.compressed import unpacked_files
from ddagr_gym.recordings.files import DEFAULT_LIMITS, Limits, open_source
from ddagr_gym.recordings.mcap_reader import open_mcap
from ddagr_gym.recordings.sqlite_reader import open_sqlite

NEWEST = 9
"""Version of metadata.yaml up to which its entries are known (ROS 2 Jazzy)."""
_STORAGES = ("sqlite3", "mcap")
_LARGEST_METADATA = 4 * 2**20  # bytes (ours): about ten thousand topics; more is no metadata


@contextmanager
def open_folder(path: Path, limits: Limits = DEFAULT_LIMITS) -> Iterator[Bag]:
    """Topics and messages of all files of a ROS 2 bag, in their order; they can be read while it is open.

    Args:
        path: folder with ``metadata.yaml``.
        limits: on unpacked bytes.

    Raises:
        InputError: no or damaged metadata, files that are missing or damaged, another storage or compression.
    """
    if not (path / "metadata.yaml").is_file():
        raise InputError(
            f"the folder {path.name} has no metadata.yaml: give a ROS 2 bag's folder (`ros2 bag reindex` writes it "
            "anew) or a file."
        )
    information = _information(path)
    storage = information.get("storage_identifier")
    files = _files(path, information)
    with ExitStack() as stack:
        unpacked = stack.enter_context(unpacked_files(files, limits))
        if storage == "mcap":
            yield joined(path, (open_mcap(file, limits) for file in unpacked))
        else:
            yield joined(path, [stack.enter_context(open_sqlite(file, limits)) for file in unpacked])


def _files(path: Path, information: dict[str, Any]) -> tuple[Path, ...]:
    """Files of a bag in the order of its metadata, each once.

    Raises:
        InputError: what its metadata say that this cannot read, or files that are not there.
    """
    _check_readable(path, information)
    names = dict.fromkeys(_file_name(path, str(name)) for name in information["relative_file_paths"])
    if not names:
        raise InputError(f"{path.name}/metadata.yaml names no file: restore it with `ros2 bag reindex`.")
    missing = [name for name in names if not (path / name).is_file()]
    if missing:
        raise InputError(
            f"{path.name} lacks {', '.join(missing[:3])}{' and others' if len(missing) > 3 else ''}, which its "
            "metadata.yaml names: copy the whole bag, or restore the metadata with `ros2 bag reindex`."
        )
    return tuple(path / name for name in names)


def _file_name(path: Path, name: str) -> str:
    """Name inside the folder; bags before Foxy put the folder's name before it."""
    parts = PurePosixPath(name)
    if parts.is_absolute() or ".." in parts.parts or not parts.name:
        raise InputError(f"{path.name}/metadata.yaml names the file {name!r} outside its folder: correct it.")
    return parts.name


def _check_readable(path: Path, information: dict[str, Any]) -> None:
    version, storage = information.get("version"), information.get("storage_identifier")
    if not isinstance(version, int) or version > NEWEST:
        raise InputError(
            f"{path.name}/metadata.yaml has the version {version!r}, versions up to {NEWEST} are read: convert the bag "
            "with `ros2 bag convert`, or give its file."
        )
    if storage not in _STORAGES:
        raise InputError(f"{path.name} is stored as {storage!r}: convert it to {' or '.join(_STORAGES)}.")
    compression = str(information.get("compression_format") or "none").lower()
    if compression not in ("none", "zstd"):
        raise InputError(f"{path.name} is compressed with {compression!r}: unpack it with `ros2 bag convert` first.")


def _information(path: Path) -> dict[str, Any]:
    """Content of a ROS 2 bag's metadata.yaml."""
    import yaml

    with open_source(path / "metadata.yaml") as stream:
        data = stream.read(_LARGEST_METADATA + 1)
    try:
        content = yaml.safe_load(data.decode("utf-8")) if len(data) <= _LARGEST_METADATA else None
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError, ValueError):
        content = None
    information = content.get("rosbag2_bagfile_information") if isinstance(content, dict) else None
    if not isinstance(information, dict) or not isinstance(information.get("relative_file_paths"), list):
        raise InputError(f"{path.name}/metadata.yaml is not a ROS 2 bag's: restore it with `ros2 bag reindex`.")
    return information
