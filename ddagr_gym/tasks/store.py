"""Results of finished tasks by key, so that the same command does only what is missing."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any, Protocol

from ddagr_gym.files import atomic_path, make_folder

_KEY = re.compile(r"[\w.-]+")


class Store(Protocol):
    """Where results of finished tasks are kept by key."""

    def has(self, key: str) -> bool:
        """Whether the result is there."""

    def get(self, key: str) -> Any:
        """The result."""

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

    def has(self, key: str) -> bool:
        """Whether the result is there."""
        return self.path(key).is_file()

    def get(self, key: str) -> Any:
        """The result."""
        return json.loads(self.path(key).read_text(encoding="utf-8"))

    def put(self, key: str, value: Any) -> Any:
        """Keep a result, and give it back as :meth:`get` would: a tuple as a list.

        Args:
            key: of the task.
            value: of JSON's kinds; other kinds raise TypeError.
        """
        text = json.dumps(value)
        with atomic_path(self.path(key)) as part:
            part.write_text(text, encoding="utf-8")
        return json.loads(text)
