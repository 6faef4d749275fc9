"""Arguments that many tasks have in common: sent once to a worker or node, by the hash of their content."""

from __future__ import annotations

import contextlib
import hashlib
import os
import pickle
import shutil
import tempfile
from abc import ABC, abstractmethod
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from ddagr_gym.files import atomic_path, make_folder

FileContent: TypeAlias = bytes | dict[str, bytes]
"""Of a file, or of the files of a folder by their names."""

_REMEMBERED = 4
"""Contents that a worker keeps in memory (ours): a bank and some drives."""

_contents: OrderedDict[str, Any] = OrderedDict()


class Handle(ABC):
    """Stands for a content among a task's arguments."""

    @abstractmethod
    def content(self) -> Any:
        """The content, in the worker."""


@dataclass(frozen=True)
class SharedFile(Handle):
    """A pickled value in a file that the driver wrote for its own workers."""

    digest: str
    path: str

    def content(self) -> Any:
        """The value, read once a worker."""
        return remembered(self.digest, lambda: pickle.loads(Path(self.path).read_bytes()))


@dataclass(frozen=True)
class SharedPath(Handle):
    """A file of the driver, or a folder of files, by content.

    Attributes:
        digest: SHA-256 of the content.
        path: on the driver.
        fetch: gives the content on another node; None where the driver's path is there.
    """

    digest: str
    path: str
    fetch: Callable[[], FileContent] | None = None

    def content(self) -> Path:
        """Path of a file or folder with this content and the driver's name, written once a node."""
        if self.fetch is None:
            return Path(self.path)
        place = written_folder() / self.digest / Path(self.path).name
        if not place.exists():
            _write(place, self.fetch())
        return place


def written_folder() -> Path:
    """Where a node keeps the files that it got, each in a folder named by its content."""
    return Path(tempfile.gettempdir()) / f"ddagr-gym-{os.getuid()}"


def release(path: Path) -> None:
    """Remove a file or folder that no other task needs, where :class:`SharedPath` wrote it; the driver's own stays.

    Args:
        path: as the task got it.
    """
    if path.parent.parent == written_folder():
        shutil.rmtree(path.parent, ignore_errors=True)


def content_of(path: Path) -> FileContent:
    """Bytes of a file, or of the files of a folder by their names."""
    if path.is_dir():
        return {file.name: file.read_bytes() for file in sorted(path.iterdir()) if file.is_file()}
    return path.read_bytes()


def _write(place: Path, content: FileContent) -> None:
    """Write a file or folder, whole or not at all."""
    if isinstance(content, bytes):
        with atomic_path(place) as part:
            part.write_bytes(content)
        return
    with tempfile.TemporaryDirectory(dir=make_folder(place.parent)) as folder:
        part = make_folder(Path(folder) / place.name)
        for name, data in content.items():
            (part / name).write_bytes(data)
        # where another task of this node was faster, its folder stays
        with contextlib.suppress(OSError):
            part.rename(place)
    if not place.is_dir():
        raise OSError(f"{place} cannot be written")


def remembered(digest: str, load: Callable[[], Any]) -> Any:
    """Content by its hash, loaded where this process does not have it."""
    if digest not in _contents:
        _contents[digest] = load()
        while len(_contents) > _REMEMBERED:
            _contents.popitem(last=False)
    _contents.move_to_end(digest)
    return _contents[digest]


def pickled(value: Any) -> tuple[str, bytes]:
    """Hash and bytes of a value."""
    data = pickle.dumps(value, protocol=pickle.HIGHEST_PROTOCOL)
    return hashlib.sha256(data).hexdigest(), data
