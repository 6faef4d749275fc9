"""Bags that rosbag2 compressed with zstd: whole files, or message by message; unpacked to no more than a limit."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.files import Limits, damaged, open_source

ZSTD = b"\x28\xb5\x2f\xfd"
"""First bytes of everything that zstd wrote; a CDR message begins with 0."""
MOST_EXPANSION = 200
"""Unpacked over packed bytes of a file [-] (ours): sensor messages shrink to a tenth at best, zeros to 1/10000."""
LEAST_ALLOWED = 64 * 2**20
"""Unpacked bytes that any file may have (ours)."""
_BLOCK = 2**20


def allowed_bytes(packed: int, limits: Limits) -> int:
    """Unpacked bytes that a file of ``packed`` bytes may have."""
    return min(limits.bytes, max(LEAST_ALLOWED, MOST_EXPANSION * packed))


def too_large(path: Path) -> InputError:
    """Error for a file that unpacks to more than :func:`allowed_bytes`."""
    return InputError(
        f"{path.name} unpacks to more than {MOST_EXPANSION} times its size or --maximum-bytes: record it again, or "
        "cut it and raise the limit."
    )


def unpacked_message(data: bytes, limits: Limits, path: Path) -> bytes:
    """A message, unpacked where rosbag2 compressed it.

    Args:
        data: as stored.
        limits: on unpacked bytes.
        path: of the file, for messages.

    Raises:
        InputError: more bytes than allowed.
    """
    if not data.startswith(ZSTD):
        return data
    import zstandard

    allowed = allowed_bytes(len(data), limits)
    unpacked: bytes = zstandard.ZstdDecompressor().stream_reader(data, read_size=2**16).read(allowed + 1)
    if len(unpacked) > allowed:
        raise too_large(path)
    return unpacked


def is_compressed(path: Path) -> bool:
    """Whether a file begins as zstd's files do."""
    with open_source(path) as stream:
        return stream.read(len(ZSTD)) == ZSTD


@contextlib.contextmanager
def unpacked_files(paths: Sequence[Path], limits: Limits) -> Iterator[tuple[Path, ...]]:
    """Files in the order given, those that zstd compressed unpacked into a folder that goes at the end.

    Args:
        paths: of the files.
        limits: on unpacked bytes of all together.

    Raises:
        InputError: damaged, or more bytes than allowed.
    """
    with contextlib.ExitStack() as stack:
        folder: Path | None = None
        found, left = [], limits.bytes
        for path in paths:
            if not is_compressed(path):
                found.append(path)
                continue
            folder = folder or Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="ddagr-bag-")))
            target = folder / str(len(found)) / path.name.removesuffix(".zstd")
            target.parent.mkdir()
            left -= _unpack(path, target, Limits(limits.rows, max(left, 1)))
            found.append(target)
        yield tuple(found)


def _unpack(path: Path, target: Path, limits: Limits) -> int:
    """Unpack a file; the number of bytes."""
    import zstandard

    allowed, written = allowed_bytes(path.stat().st_size, limits), 0
    try:
        with open_source(path) as source, open(target, "wb") as sink:
            for block in _blocks(source):
                written += len(block)
                if written > allowed:
                    raise too_large(path)
                sink.write(block)
    except zstandard.ZstdError as error:
        raise damaged(path, error, "is damaged or truncated", "copy it again from its origin") from None
    return written


def _blocks(source: BinaryIO) -> Iterator[bytes]:
    import zstandard

    stream = zstandard.ZstdDecompressor().stream_reader(source, read_across_frames=True)
    while block := stream.read(_BLOCK):
        yield block
