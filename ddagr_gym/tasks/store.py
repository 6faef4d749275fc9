"""Results of finished tasks by key, so that the same command does only what is missing."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from ddagr_gym.errors import InputError
from ddagr_gym.files import atomic_path, make_folder, read_json

_KEY = re.compile(r"[\w.-]+")


@dataclass(frozen=True)
class Kept:
    """A result that was found.

    Attributes:
        value: of the task, which may be None.
    """

    value: Any


class Store(Protocol):
    """Where results of finished tasks are kept by key."""

    def find(self, key: str) -> Kept | None:
        """The result; None where there is none, or a damaged one."""

    def put(self, key: str, value: Any) -> Any:
        """Keep a result, and give it back."""


class ResultStore:
    """A folder with one JSON file a result; a file is whole or absent.

    Args:
        folder: made where it is absent.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = make_folder(folder)

    def path(self, key: str) -> Path:
        """File of a result.

        Raises:
            ValueError: the key cannot name a file.
        """
        if not _KEY.fullmatch(key):
            raise ValueError(f"key {key!r}: letters, digits, '_', '-' and '.' only")
        return self.folder / f"{key}.json"

    def find(self, key: str) -> Kept | None:
        """The result; None where there is no file, or an empty or damaged one, so that the task is done again."""
        if not self.path(key).exists():
            return None
        try:
            return Kept(self.get(key))
        except InputError:
            return None

    def has(self, key: str) -> bool:
        """Whether :meth:`find` finds the result."""
        return self.find(key) is not None

    def get(self, key: str) -> Any:
        """The result.

        Raises:
            InputError: no file, or a damaged one.
        """
        return read_json(self.path(key), "cannot be read as a result", "delete it and give the same command again")

    def put(self, key: str, value: Any) -> Any:
        """Keep a result, and give it back as :meth:`get` would: a tuple as a list.

        Args:
            key: of the task.
            value: of JSON's kinds, other kinds raise TypeError; with more than ``files.MAXIMUM_JSON`` bytes of text the
                task is done again next time.
        """
        text = json.dumps(value)
        with atomic_path(self.path(key)) as part:
            part.write_text(text, encoding="utf-8")
        return json.loads(text)
