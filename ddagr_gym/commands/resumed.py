"""Long commands that go on where they were stopped."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Iterator
from pathlib import Path


@contextlib.contextmanager
def resumable(parts: Path | None) -> Iterator[None]:
    """Work whose finished steps are kept in a folder until it is done.

    Args:
        parts: the folder; removed after the work. It stays where the work ended in an error or was stopped. None where
            nothing is kept.

    Raises:
        KeyboardInterrupt: the work was stopped; says how it goes on, where something is kept.
    """
    try:
        yield
    except KeyboardInterrupt:
        if parts is None or not parts.exists():
            raise
        raise KeyboardInterrupt(f"the same command goes on from {parts}") from None
    if parts is not None:
        shutil.rmtree(parts, ignore_errors=True)
