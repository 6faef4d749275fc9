"""Files from strangers: what kind they are, their hash, bounded reading, and writing all or nothing."""

from __future__ import annotations

import contextlib
import gzip
import hashlib
import io
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from ddagr_gym.errors import InputError
from ddagr_gym.files import atomic_path

_MAGIC = (
    (b"PAR1", "parquet"),
    (b"\x89MCAP0\r\n", "mcap"),
    (b"#ROSBAG V", "rosbag"),
    (b"SQLite format 3", "sqlite"),
    (b"\x1f\x8b", "gzip"),
    (b"\x28\xb5\x2f\xfd", "zstd"),
)
_FOREIGN = (
    (b"PK\x03\x04", "a zip archive"),
    (b"BZh", "compressed with bzip2"),
    (b"\xfd7zXZ", "compressed with xz"),
    (b"\x89HDF", "an HDF5 file"),
    (b"MATLAB 5.0", "a MATLAB file"),
)


@dataclass(frozen=True)
class Limits:
    """How much of a foreign file is read before it is refused.

    Attributes:
        rows: most rows or messages (2 million rows are 11 h at 50 Hz, about 0.3 GB in memory).
        bytes: most bytes after decompression.
    """

    rows: int = 2_000_000
    bytes: int = 4 * 2**30

    def __post_init__(self) -> None:
        for name in ("rows", "bytes"):
            value = getattr(self, name)
            if not isinstance(value, int) or value < 1:
                raise InputError(f"the limit on {name} is {value!r}: give a whole number above 0.")

    def check_rows(self, count: int, path: Path) -> None:
        """Raise :class:`InputError` where a file holds more than ``rows`` rows."""
        if count > self.rows:
            raise InputError(
                f"{path.name} holds more than {self.rows:,} rows: cut it into drives, or raise --maximum-rows."
            )


DEFAULT_LIMITS = Limits()


def kind_of(path: Path) -> str:
    """Kind of a source by its first bytes: parquet, mcap, rosbag, sqlite, gzip, zstd, text or folder.

    Raises:
        InputError: absent, empty, unreadable, or a format that no reader takes.
    """
    if path.is_dir():
        return "folder"
    head = _head(path, 16)
    if not head:
        raise InputError(f"{path.name} is empty: give a file with a header and rows.")
    for magic, kind in _MAGIC:
        if head.startswith(magic):
            return kind
    for magic, description in _FOREIGN:
        if head.startswith(magic):
            raise InputError(
                f"{path.name} is {description}: unpack or convert it to CSV, Parquet, MCAP or a bag first."
            )
    return "text"


def _head(path: Path, count: int) -> bytes:
    with open_source(path) as stream:
        return stream.read(count)


@contextlib.contextmanager
def open_source(path: Path) -> Iterator[BinaryIO]:
    """Open a regular file for reading; absence, a pipe or a missing right becomes an :class:`InputError`."""
    if "\0" in str(path):
        raise InputError(f"the path {str(path)!r} holds a NUL byte: give the name of a file.")
    if path.exists() and not path.is_file():
        raise InputError(f"{path} is not a regular file: give a recording's file.")
    try:
        stream = open(path, "rb")  # noqa: SIM115 (closed below; only opening may be blamed on the path)
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}): check the name and the rights.") from None
    with stream:
        yield stream


def sha256_of(path: Path) -> str:
    """SHA-256 of a file, or of the sorted files of a folder with their names [hexadecimal]."""
    digest = hashlib.sha256()
    members = sorted(p for p in path.iterdir() if p.is_file()) if path.is_dir() else [path]
    for member in members:
        if path.is_dir():
            digest.update(member.name.encode() + b"\0")
        with open_source(member) as stream:
            while block := stream.read(2**20):
                digest.update(block)
    return digest.hexdigest()


def damaged(path: Path, error: BaseException, complaint: str, remedy: str) -> InputError:
    """Error of a library about a file as one sentence: file, complaint, first words of the error, remedy."""
    reason = " ".join(str(error).split())[:160] or type(error).__name__
    joint = "" if complaint.startswith(",") else " "
    return InputError(f"{path.name}{joint}{complaint} ({reason}): {remedy}.")


class BoundedStream(io.RawIOBase):
    """Read-only stream that refuses to give more than a number of bytes, against decompression bombs."""

    def __init__(self, stream: BinaryIO, limit: int, name: str) -> None:
        self._stream = stream
        self._limit = limit
        self._name = name
        self._given = 0

    def readable(self) -> bool:
        """Always."""
        return True

    def read(self, size: int = -1) -> bytes:
        """Next bytes; a damaged or endless archive becomes an :class:`InputError`."""
        wanted = 2**20 if size is None or size < 0 else min(size, 2**22)
        try:
            data = self._stream.read(wanted)
        except (OSError, EOFError, zlib.error) as error:
            raise InputError(
                f"{self._name} is damaged or truncated ({error}): copy it again from its origin."
            ) from None
        self._given += len(data)
        if self._given > self._limit:
            raise InputError(
                f"{self._name} unpacks to more than {self._limit:,} bytes: cut it into drives, or raise "
                "--maximum-bytes."
            )
        return data


@contextlib.contextmanager
def open_text(path: Path, limits: Limits) -> Iterator[BoundedStream]:
    """Bounded stream over a text file, unpacked where it is gzip."""
    with open_source(path) as raw:
        packed = raw.read(2) == b"\x1f\x8b"
        raw.seek(0)
        stream: BinaryIO = gzip.GzipFile(fileobj=raw, mode="rb") if packed else raw  # type: ignore[assignment]
        yield BoundedStream(stream, limits.bytes, path.name)


def write_atomically(path: Path, write: Callable[[Path], None]) -> None:
    """:func:`~ddagr_gym.files.atomic_path` for a function that writes a file.

    Args:
        path: file to end up with; parents are made.
        write: fills the temporary file.

    Raises:
        InputError: what ``atomic_path`` refuses, and a disk that is full or may not be written to.
    """
    try:
        with atomic_path(path) as temporary:
            write(temporary)
    except OSError as error:
        raise InputError(f"{path} cannot be written ({error.strerror or error}): check space and rights.") from None
