"""Arguments that many tasks have in common: sent once to a worker or node, by the hash of their content."""

from __future__ import annotations

import hashlib
import os
import pickle
import tempfile
from abc import ABC, abstractmethod
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ddagr_gym.files import atomic_path

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
    """A file of the driver, by content.

    Attributes:
        digest: SHA-256 of the bytes.
        path: on the driver.
        fetch: gives the bytes on another node; None where the driver's path is there.
    """

    digest: str
    path: str
    fetch: Callable[[], bytes] | None = None

    def content(self) -> Path:
        """Path of a file with these bytes and the driver's name, written once a node."""
        if self.fetch is None:
            return Path(self.path)
        folder = Path(tempfile.gettempdir()) / f"ddagr-gym-{os.getuid()}" / self.digest
        file = folder / Path(self.path).name
        if not file.is_file():
            with atomic_path(file) as part:
                part.write_bytes(self.fetch())
        return file


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
